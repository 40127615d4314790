//! Light cells kept between runs, since making them takes seconds: one file a map and choice of lights.
//!
//! A file holds the checksum of what its cells were made from; where that is another one, cells are made anew. (They only say
//! how often lights are chosen, so that what the checksum leaves out could cost noise and nothing else.)

use crate::output::atomic;
use crate::output::checksum::fnv1a;
use crate::reference::light_cells::{self, VERSION};
use crate::reference::trace::Tracer;
use crate::scene::Scene;
use crate::scene::light_cells::LightCells;
use crate::scene::records::{CellEntry, LightCell};
use bytemuck::{Pod, pod_read_unaligned};
use std::path::{Path, PathBuf};

/// First bytes of a file. Numbers are as this machine has them: another byte order shows in what follows.
const MAGIC: [u8; 8] = *b"q3rcells";

/// The file of a map's cells.
pub fn path(folder: &Path, map: &str, lights: &str) -> PathBuf {
    let name = map.rsplit('/').next().unwrap_or(map);
    folder.join(format!("{name}-{lights}.cells"))
}

/// Checksum of what cells depend on.
fn origin(scene: &Scene, tracer: &Tracer) -> u64 {
    let version = format!("{VERSION} {}", env!("CARGO_PKG_VERSION"));
    let lists = &scene.rows.pvs;
    let mut parts: Vec<&[u8]> = vec![
        version.as_bytes(),
        bytemuck::cast_slice(&scene.geometry.positions),
        bytemuck::cast_slice(&scene.geometry.triangles),
        bytemuck::cast_slice(&tracer.instances),
        bytemuck::cast_slice(&scene.materials),
        bytemuck::cast_slice(&scene.lights.lights),
        bytemuck::cast_slice(&scene.lights.weights),
        bytemuck::cast_slice(&lists.rows),
        bytemuck::cast_slice(&lists.runs),
    ];
    parts.extend(scene.textures.iter().map(|t| t.levels[0].as_flattened()));
    fnv1a(&parts)
}

fn file(cells: &LightCells, origin: u64) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    for number in [origin, cells.slots.len() as u64, cells.entries.len() as u64] {
        out.extend(number.to_ne_bytes());
    }
    out.extend_from_slice(bytemuck::cast_slice(&cells.slots));
    out.extend_from_slice(bytemuck::cast_slice(&cells.entries));
    out.extend_from_slice(bytemuck::cast_slice(&cells.bounds));
    out.extend(fnv1a(&[&out]).to_ne_bytes());
    out
}

/// Takes `count` records off the front of `bytes`.
fn take<T: Pod>(bytes: &mut &[u8], count: usize) -> Option<Vec<T>> {
    let (own, rest) = bytes.split_at_checked(count.checked_mul(size_of::<T>())?)?;
    *bytes = rest;
    Some(own.chunks_exact(size_of::<T>()).map(pod_read_unaligned).collect())
}

/// The cells of a file: `None` where it is damaged, `Some(None)` where they are another scene's.
fn parse(mut bytes: &[u8], origin: u64, scene: &Scene) -> Option<Option<LightCells>> {
    let (content, sum) = bytes.split_last_chunk::<8>()?;
    if fnv1a(&[content]) != u64::from_ne_bytes(*sum) || !content.starts_with(&MAGIC) {
        return None;
    }
    bytes = &content[MAGIC.len()..];
    let header: Vec<u64> = take(&mut bytes, 3)?;
    if header[0] != origin {
        return Some(None);
    }
    let (slots, entries) = (usize::try_from(header[1]).ok()?, usize::try_from(header[2]).ok()?);
    let cells = LightCells {
        slots: take(&mut bytes, slots)?,
        entries: take(&mut bytes, entries)?,
        bounds: take(&mut bytes, entries)?,
    };
    (bytes.is_empty() && holds(&cells, scene)).then_some(Some(cells))
}

/// Whether everything that cells point at is there, and a search in them ends.
fn holds(cells: &LightCells, scene: &Scene) -> bool {
    let ends = |first: u32, count: u32, of: usize| u64::from(first) + u64::from(count) <= of as u64;
    let slot = |c: &LightCell| ends(c.first, c.count, cells.entries.len());
    let entry = |e: &CellEntry| e.light_count > 0 && ends(e.first_light, e.light_count, scene.lights.lights.len());
    let searchable =
        cells.slots.is_empty() || cells.slots.len().is_power_of_two() && cells.slots.iter().any(|c| c.count == 0);
    searchable && cells.slots.iter().all(slot) && cells.entries.iter().all(entry)
}

/// The cells of a scene, from `path` or made and kept there; one sentence where the file is damaged or cannot be written.
pub fn load_or_build(scene: &Scene, tracer: &Tracer, path: &Path) -> (LightCells, Option<String>) {
    let origin = origin(scene, tracer);
    let mut warning = None;
    if let Ok(bytes) = std::fs::read(path) {
        match parse(&bytes, origin, scene) {
            Some(Some(cells)) => return (cells, None),
            Some(None) => {}
            None => warning = Some(format!("{} is damaged and is made anew", path.display())),
        }
    }
    let cells = light_cells::build(scene, tracer);
    let written = atomic::create_parent(path).and_then(|()| atomic::write(path, &file(&cells, origin)));
    (cells, written.err().map(|e| e.to_string()).or(warning))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::bsp::build::fixtures::{Doorways, chain};
    use crate::assets::vfs::VfsError;

    struct Files(Vec<(String, Vec<u8>)>);

    impl crate::assets::vfs::FileSource for Files {
        fn read(&self, path: &str) -> Result<Option<Vec<u8>>, VfsError> {
            Ok(self.0.iter().find(|f| f.0 == path).map(|f| f.1.clone()))
        }

        fn list(&self, folder: &str, extension: &str) -> Vec<String> {
            let wanted = |p: &&String| p.starts_with(folder) && p.ends_with(extension);
            self.0.iter().map(|f| &f.0).filter(wanted).cloned().collect()
        }
    }

    fn rooms(count: usize) -> Scene {
        let fixture = chain(count, Doorways::InLine, 1000).expect("rooms");
        Scene::load(&Files(fixture.files()), &fixture.name).expect("a scene")
    }

    #[test]
    fn cells_come_back_as_they_were_made() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = path(folder.path(), "maps/a", "all");
        let scene = rooms(3);
        let tracer = Tracer::new(&scene);
        let (made, warning) = load_or_build(&scene, &tracer, &path);
        assert!(made.count() > 0 && warning.is_none(), "{} {warning:?}", made.count());
        let bytes = std::fs::read(&path).expect("kept");
        let origin = origin(&scene, &tracer);
        assert_eq!(parse(&bytes, origin, &scene), Some(Some(made.clone())));
        assert_eq!(load_or_build(&scene, &tracer, &path), (made.clone(), None));
        // Cut short, changed anywhere, or with numbers that lead out of it: no cells, and no panic.
        for length in (0..bytes.len()).step_by(97) {
            assert_eq!(parse(&bytes[..length], origin, &scene), None, "{length} bytes");
        }
        for at in (0..bytes.len()).step_by(101) {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0x40;
            assert_eq!(parse(&wrong, origin, &scene), None, "byte {at}");
        }
        let mut far = made.clone();
        far.entries[0].first_light = u32::MAX;
        assert_eq!(parse(&file(&far, origin), origin, &scene), None);
        // Damaged: said, and made anew.
        std::fs::write(&path, &bytes[..50]).expect("written");
        let (again, warning) = load_or_build(&scene, &tracer, &path);
        assert!(again == made && warning.is_some_and(|w| w.contains("damaged")));
        // Another scene's are not taken.
        let other = rooms(4);
        let (others, warning) = load_or_build(&other, &Tracer::new(&other), &path);
        assert!(others != made && warning.is_none());
    }
}
