//! Where recovered lights come from: a lights file in the paks, one recovered before, or a new recovery.

use super::lights_file::{LightsFile, OverrideError, find_override};
use super::recover::{Options, RecoveryError, recover};
use crate::assets::vfs::search_path::map_path;
use crate::assets::vfs::{FileSource, VfsError};
use crate::output::atomic;
use crate::output::checksum::fnv1a;
use crate::scene::Scene;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Changes whenever the same map would give other lights than before.
const VERSION: u32 = 3;

/// Why there are no lights.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error(transparent)]
    Override(#[from] OverrideError),
    #[error(transparent)]
    Recovery(#[from] RecoveryError),
    #[error(transparent)]
    Files(#[from] VfsError),
}

/// Where lights came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// `maps/NAME.lights` of the search path.
    Paks,
    Cache(PathBuf),
    Recovered,
}

/// Lights and where they came from.
#[derive(Clone, Debug)]
pub struct Loaded {
    pub file: LightsFile,
    pub origin: Origin,
    /// The cache could not be read or written.
    pub warning: Option<String>,
}

/// The file in `folder` that holds the lights of a map with these bytes, recovered with these options.
pub fn path(folder: &Path, map: &str, bytes: &[u8], options: &Options) -> PathBuf {
    let options = format!("{VERSION} {options:?}");
    let hash = fnv1a(&[bytes, options.as_bytes()]);
    let name = map.rsplit('/').next().unwrap_or(map);
    folder.join(format!("{name}-{hash:016x}.lights"))
}

/// The lights of a scene: what the paks say, or else, where they are to be looked for (`search`), what `folder` holds or a
/// new recovery, which is kept there.
///
/// # Errors
/// [`LoadError`] where the paks' file is wrong or nothing can be recovered. A cache that fails is a warning.
pub fn load_or_recover(
    scene: &Scene,
    files: &dyn FileSource,
    folder: &Path,
    options: &Options,
    search: bool,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Option<Loaded>, LoadError> {
    if let Some(file) = find_override(files, &scene.name)? {
        return Ok(Some(Loaded {
            file,
            origin: Origin::Paks,
            warning: None,
        }));
    }
    if !search {
        return Ok(None);
    }
    let bytes = files.read(&map_path(&scene.name))?.unwrap_or_else(|| scene.bsp.write());
    let path = path(folder, &scene.name, &bytes, options);
    let mut warning = None;
    if let Ok(text) = std::fs::read_to_string(&path) {
        match LightsFile::parse(&text) {
            Ok(file) => {
                return Ok(Some(Loaded {
                    file,
                    origin: Origin::Cache(path),
                    warning: None,
                }));
            }
            Err(e) => warning = Some(format!("{} is damaged and is made anew: {e}", path.display())),
        }
    }
    let file = LightsFile::from(&recover(scene, options, progress)?);
    let written = atomic::create_parent(&path).and_then(|()| atomic::write(&path, file.to_string().as_bytes()));
    if let Err(e) = written {
        warning = Some(e.to_string());
    }
    Ok(Some(Loaded {
        file,
        origin: Origin::Recovered,
        warning,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_tells_maps_and_options_apart() {
        let (a, b) = (
            Options::default(),
            Options {
                seed: 2,
                ..Options::default()
            },
        );
        let folder = Path::new("x");
        let at = |bytes: &[u8], o: &Options| path(folder, "maps/a", bytes, o);
        assert_eq!(at(b"1", &a), at(b"1", &a));
        assert_ne!(at(b"1", &a), at(b"2", &a));
        assert_ne!(at(b"1", &a), at(b"1", &b));
    }
}
