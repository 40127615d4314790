//! Every installed map is read and written back byte for byte.

mod common;

use common::{installed, real};
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::lumps::Lump;
use q3rays::assets::vfs::FileSource;
use q3rays::assets::vfs::search_path::map_path;

/// Maps that tests/setup.sh installs.
const MAPS: usize = 85;

fn int(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

/// A lump as the file has it, found without the reader under test.
fn stored(file: &[u8], lump: Lump) -> &[u8] {
    let at = 8 + lump as usize * 8;
    &file[int(file, at)..][..int(file, at + 4)]
}

#[test]
fn every_lump_of_every_map_is_written_back_byte_for_byte() {
    let files = installed();
    let maps: Vec<String> = files
        .maps()
        .into_iter()
        .map(|m| m.name)
        .filter(|m| m != "showcase")
        .collect();
    assert!(
        maps.len() >= MAPS,
        "{} maps instead of {MAPS}: run tests/setup.sh",
        maps.len()
    );
    let (mut lumps, mut bytes) = (0, 0);
    for name in &maps {
        let file = files.read(&map_path(name)).unwrap().unwrap();
        let bsp = Bsp::read(&file).unwrap_or_else(|e| panic!("{name}: {e}"));
        for lump in Lump::ALL {
            let expected = stored(&file, lump);
            assert!(bsp.lump_bytes(lump) == expected, "{name}: {} lump", lump.name());
            lumps += 1;
            bytes += expected.len();
        }
        // The file as a whole: reading what was written gives the same map, and the same bytes again.
        let written = bsp.write();
        for lump in Lump::ALL {
            assert!(stored(&written, lump) == stored(&file, lump), "{name}: {}", lump.name());
        }
        let again = Bsp::read(&written).unwrap_or_else(|e| panic!("{name}, written: {e}"));
        assert!(again.write() == written, "{name}");
    }
    println!("{} maps, {lumps} lumps, {bytes} bytes", maps.len());
}

#[test]
fn scenes_of_maps_hold_together() {
    for name in ["showcase", "oa_dm1", "oa_koth2", "oacmpdm5", "islanddm", "q3dm6ish"] {
        let scene = real(name);
        let g = &scene.geometry;
        assert!(!g.triangles.is_empty() && !scene.spawns.is_empty(), "{name}");
        let vertices = g.positions.len();
        for t in &g.triangles {
            assert!(t.vertices.iter().all(|v| (*v as usize) < vertices), "{name}");
            assert!((t.material as usize) < scene.materials.len(), "{name}");
            assert!(t.fallback_row <= scene.rows.all_row, "{name}");
        }
        let all: Vec<u32> = scene.rows.pvs.lights(scene.rows.all_row).collect();
        assert!(all.iter().copied().eq(0..scene.lights.lights.len() as u32), "{name}");
    }
}
