//! From a loaded scene to a lit one: which lights it has, what is left over, and what lights are chosen by.

pub mod ambient;
pub mod kept_cells;

use crate::assets::vfs::FileSource;
use crate::recovery::cache::{LoadError, Loaded, load_or_recover};
use crate::recovery::encoding::lights_kept_unasked;
use crate::recovery::{LightsFile, Options, RecoveryError, scene_lights};
use crate::reference::trace::Tracer;
use crate::scene::Scene;
use crate::scene::lights::LightSource;
use std::path::PathBuf;
use std::time::Instant;

/// Which lights a scene gets (`rt_lights`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lights {
    /// Those that the files describe, as they describe them, and those found in the lightmaps, both at the strength that
    /// the bake shows.
    All,
    /// Those that the files describe.
    Known,
    /// Those found in the lightmaps.
    Recovered,
}

impl Lights {
    /// Its value in the console.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Known => "known",
            Self::Recovered => "recovered",
        }
    }
}

/// Folders for what takes time to find.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Lights files.
    pub lights: PathBuf,
    /// Light cells.
    pub cells: PathBuf,
}

/// What was done about a scene's lights.
#[derive(Debug, Default)]
pub struct Lighting {
    /// Lights file used, and where it came from; `None` where only known lights were asked for or there is nothing to
    /// recover.
    pub loaded: Option<Loaded>,
    /// Why nothing was recovered, where that was asked for; one sentence.
    pub note: Option<String>,
    /// What could not be kept or read back, one sentence each.
    pub warnings: Vec<String>,
}

/// Whether a map's lights have to be looked for: the compiler keeps light entities or none at all.
fn wanted(scene: &Scene) -> bool {
    let kept = |s: &LightSource| matches!(s, LightSource::PointEntity | LightSource::SpotEntity);
    !scene.bsp.lightmaps.is_empty()
        && !scene.lights.sources.iter().any(kept)
        && !lights_kept_unasked(&scene.entities, &scene.lights)
}

/// Gives a loaded scene its lights, the ambient light that they leave over, and its light cells. `progress` gets the share
/// done of a recovery, 0..1.
///
/// # Errors
/// [`LoadError`] where a lights file of the paks is wrong or files cannot be read.
pub fn light(
    scene: &mut Scene,
    files: &dyn FileSource,
    which: Lights,
    kept: &Kept,
    options: &Options,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Lighting, LoadError> {
    let start = Instant::now();
    let mut out = Lighting::default();
    if which != Lights::Known {
        match load_or_recover(
            scene,
            files,
            &kept.lights,
            options,
            wanted(scene) || which == Lights::Recovered,
            progress,
        ) {
            Ok(loaded) => out.loaded = loaded,
            Err(LoadError::Recovery(e @ (RecoveryError::NoLightmaps { .. } | RecoveryError::TooFewLuxels { .. }))) => {
                out.note = Some(e.to_string());
            }
            Err(e) => return Err(e),
        }
    }
    if let Some(loaded) = &out.loaded {
        scene_lights::apply(scene, &loaded.file, which == Lights::All);
    } else if which == Lights::Recovered {
        scene_lights::apply(scene, &LightsFile::default(), false);
    }
    scene.timings.push(("recovery", start.elapsed()));
    let start = Instant::now();
    let tracer = Tracer::new(scene);
    let cells = kept_cells::path(&kept.cells, &scene.name, which.name());
    let (cells, warning) = kept_cells::load_or_build(scene, &tracer, &cells);
    scene.cells = cells;
    out.warnings.extend(
        out.loaded
            .as_ref()
            .and_then(|l| l.warning.clone())
            .into_iter()
            .chain(warning),
    );
    scene.timings.push(("light cells", start.elapsed()));
    let start = Instant::now();
    scene.ambient = ambient::left_over(scene, &tracer, out.loaded.as_ref().map(|l| &l.file));
    scene.timings.push(("ambient", start.elapsed()));
    Ok(out)
}
