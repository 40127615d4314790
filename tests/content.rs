//! The shipped map: made the same every time, committed as made, small, sound, and worth culling.

use glam::Vec3;
use q3rays::assets::bsp::file::Bsp;
use q3rays::assets::bsp::lumps::{SURFACE_PATCH, surface_flags};
use q3rays::content::showcase::{generate, map};
use std::path::PathBuf;

fn showcase() -> Bsp {
    map().build().unwrap()
}

fn leaf_at(bsp: &Bsp, point: Vec3) -> &q3rays::assets::bsp::lumps::Leaf {
    let mut child = 0;
    while child >= 0 {
        let node = &bsp.nodes[child as usize];
        let plane = &bsp.planes[node.plane as usize];
        child = node.children[usize::from(Vec3::from(plane.normal).dot(point) < plane.dist)];
    }
    &bsp.leafs[(-1 - child) as usize]
}

/// Fails where `baseq3/` differs from what the code makes; `Q3RAYS_UPDATE_CONTENT=1 cargo test --test content` rewrites it.
#[test]
fn the_committed_files_are_what_the_code_makes() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("baseq3");
    let update = std::env::var_os("Q3RAYS_UPDATE_CONTENT").is_some();
    for (path, bytes) in generate().unwrap() {
        let file = root.join(&path);
        if update {
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(&file, &bytes).unwrap();
        }
        let committed = std::fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        assert!(committed == bytes, "{path} is not what the code makes");
    }
}

#[test]
fn all_files_together_are_small_and_every_shader_has_its_image() {
    let files = generate().unwrap();
    assert!(files.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() < 3_000_000);
    let script = files
        .iter()
        .find(|(p, _)| p.ends_with(".shader"))
        .map(|(_, b)| String::from_utf8_lossy(b))
        .unwrap();
    let exists = |path: &str| files.iter().any(|(p, _)| p == path);
    for shader in &showcase().shaders {
        let name = shader.name.text();
        let defined = script.lines().any(|line| line == name);
        assert!(
            name.starts_with("textures/common/") || defined || exists(&format!("{name}.png")),
            "{name}"
        );
    }
    for image in script.lines().filter_map(|line| line.trim().strip_prefix("map ")) {
        if image.starts_with('$') {
            continue;
        }
        assert!(exists(image), "{image}");
    }
    for side in ["rt", "lf", "bk", "ft", "up", "dn"] {
        assert!(exists(&format!("env/showcase_{side}.png")));
    }
}

#[test]
fn spawns_stand_in_open_space() {
    let bsp = showcase();
    let text = String::from_utf8_lossy(&bsp.entities).into_owned();
    let spawns: Vec<&str> = text
        .split('{')
        .filter(|e| e.contains("info_player_deathmatch"))
        .collect();
    assert!(spawns.len() >= 6);
    for spawn in spawns {
        let origin = spawn.split("\"origin\" \"").nth(1).unwrap().split('"').next().unwrap();
        let v: Vec<f32> = origin.split(' ').map(|n| n.parse().unwrap()).collect();
        for corner in 0..8 {
            let sign = |bit: i32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let z = if corner & 4 == 0 { -24.0 } else { 32.0 };
            let point = Vec3::new(v[0] + 15.0 * sign(1), v[1] + 15.0 * sign(2), v[2] + z);
            assert!(
                leaf_at(&bsp, point).cluster >= 0,
                "the player at {origin} stands in solid at {point}"
            );
        }
    }
}

#[test]
fn normals_and_winding_agree() {
    let bsp = showcase();
    for surface in bsp.surfaces.iter().filter(|s| s.kind != SURFACE_PATCH) {
        let indices = &bsp.indices[surface.first_index as usize..][..surface.index_count as usize];
        for t in indices.chunks_exact(3) {
            let v = [0, 1, 2].map(|i| &bsp.vertices[(surface.first_vertex + t[i]) as usize]);
            let p = v.map(|v| Vec3::from(v.position));
            let turn = (p[1] - p[0]).cross(p[2] - p[0]);
            let normal: Vec3 = v.iter().map(|v| Vec3::from(v.normal)).sum();
            assert!(
                turn.dot(normal) < 0.0,
                "{:?}",
                bsp.shaders[surface.shader as usize].name
            );
        }
    }
    for surface in bsp.surfaces.iter().filter(|s| s.kind == SURFACE_PATCH) {
        let (w, h) = (surface.patch_width as usize, surface.patch_height as usize);
        let at = |x: usize, y: usize| &bsp.vertices[surface.first_vertex as usize + y * w + x];
        let p = |x: usize, y: usize| Vec3::from(at(x, y).position);
        let front = (p(1, 0) - p(0, 0)).cross(p(0, h - 1) - p(0, 0));
        assert!(front.dot(Vec3::from(at(0, 0).normal)) >= 0.0);
    }
}

/// A few hundred lamps' worth of pairs: culling by visibility has to matter, and every drawn surface to be listed.
#[test]
fn visibility_matters_and_surfaces_are_listed() {
    let bsp = showcase();
    let visibility = bsp.visibility.as_ref().unwrap();
    let n = visibility.cluster_count;
    let seen = (0..n)
        .map(|a| (0..n).filter(|&b| visibility.sees(a, b)).count())
        .sum::<usize>();
    let (kept, all) = (seen, (n * n) as usize);
    eprintln!("{kept} of {all} cluster pairs see each other");
    assert!(kept * 2 < all);
    let mut listed = vec![false; bsp.surfaces.len()];
    bsp.leaf_surfaces.iter().for_each(|&s| listed[s as usize] = true);
    let world = bsp.models[0].surface_count as usize;
    let lost: Vec<usize> = (0..world).filter(|&s| !listed[s]).collect();
    assert!(lost.is_empty(), "{lost:?}");
    assert!(bsp.shaders.iter().any(|s| s.surface_flags & surface_flags::SKY != 0));
    assert_eq!(bsp.models.len(), 2);
}
