//! Sun hall and big hall.

use super::fittings::{Archway, arch_under, ceiling_light, grate, knot, pillar, skirting, wall_lamp};
use super::glass::mirror_and_tubes;
use super::palette::{Palette, room};
use crate::assets::bsp::build::{Bounds, CellId, Face, MapBuilder};
use glam::Vec3;

/// A hall with three tall windows to the south, the third behind a grate.
pub fn sun_hall(map: &mut MapBuilder, p: &Palette, atrium: CellId) -> CellId {
    let bounds = Bounds::new([448, -288, 0], [1216, 288, 320]);
    let hall = map.cell("sun hall", bounds, room(p.plaster, p.checker, p.wood));
    let door = Archway {
        bounds: Bounds::new([384, -80, 0], [448, 80, 192]),
        axis: 0,
        rise: 64.0,
        walls: p.stone,
        floor: p.tiles,
    };
    door.build(map, "sun hall door", atrium, hall);
    let mut sky_faces = [Some(p.sky); 6];
    sky_faces[Face::MaxY as usize] = Some(p.stone);
    let sky = map.cell(
        "sky before the windows",
        Bounds::new([416, -736, -48], [1248, -320, 640]),
        sky_faces,
    );
    for (i, x) in [576, 832, 1088].into_iter().enumerate() {
        let window = Bounds::new([x - 72, -320, 24], [x + 72, -288, 288]);
        map.passage("window", hall, sky, window, room(p.stone, p.marble, p.stone));
        arch_under(map, &window, 1, 72.0, p.stone.shader);
        let pane = Bounds::new([x - 72, -308, 24], [x + 72, -308, 288]);
        if i == 2 {
            grate(map, p, &pane);
        } else {
            map.clip(Bounds::new([x - 72, -310, 24], [x + 72, -306, 288]));
            bars(map, p, x);
        }
    }
    let gaps = [
        Bounds::new([440, -80, 0], [448, 80, 64]),
        Bounds::new([768, 288, 0], [928, 296, 64]),
    ];
    skirting(map, p.trim, &bounds, &gaps);
    for x in [704, 960] {
        pillar(map, p, [x, 80], [0, 304], 20);
        pillar(map, p, [x, -160], [0, 304], 20);
    }
    // Beams under the ceiling rest on the columns.
    for x in [704, 960] {
        map.pillar(Bounds::new([x - 16, -288, 304], [x + 16, 288, 320]), p.trim);
    }
    for x in [560, 1104] {
        wall_lamp(map, p, [x, 288, 176], Face::MinY, [28, 48], p.sconce);
    }
    for x in [576, 832, 1088] {
        ceiling_light(map, p, hall, [[x - 32, -8], [x + 32, 56]], 320, p.coffer);
    }
    hall
}

/// Mullion and transoms of a window.
fn bars(map: &mut MapBuilder, p: &Palette, x: i32) {
    map.pillar(Bounds::new([x - 3, -311, 24], [x + 3, -305, 288]), p.trim);
    for z in [104, 184] {
        map.pillar(Bounds::new([x - 72, -310, z - 2], [x - 3, -306, z + 2]), p.trim);
        map.pillar(Bounds::new([x + 3, -310, z - 2], [x + 72, -306, z + 2]), p.trim);
    }
}

/// The big hall in the north-east: brick, one large light, a dais with a statue, stacked crates.
pub fn big_hall(map: &mut MapBuilder, p: &Palette, gallery: CellId, sun_hall: CellId) -> CellId {
    let bounds = Bounds::new([640, 352, 0], [1472, 1120, 384]);
    let hall = map.cell("big hall", bounds, room(p.brick, p.tiles, p.concrete));
    let doors = [
        ("big hall door", gallery, Bounds::new([576, 512, 0], [640, 640, 176]), 0),
        (
            "big hall arch",
            sun_hall,
            Bounds::new([768, 288, 0], [928, 352, 192]),
            1,
        ),
    ];
    for (name, from, bounds, axis) in doors {
        let door = Archway {
            bounds,
            axis,
            rise: 56.0,
            walls: p.stone,
            floor: p.tiles,
        };
        door.build(map, name, from, hall);
    }
    let gaps = [
        Bounds::new([632, 512, 0], [640, 640, 64]),
        Bounds::new([768, 344, 0], [928, 352, 64]),
    ];
    skirting(map, p.stone, &bounds, &gaps);
    ceiling_light(map, p, hall, [[896, 576], [1216, 896]], 384, p.hall_light);
    for (x, y) in [(800, 480), (1312, 480), (800, 992), (1312, 992)] {
        let square = |half: i32, z0: i32, z1: i32| Bounds::new([x - half, y - half, z0], [x + half, y + half, z1]);
        map.pillar(square(32, 0, 16), p.stone);
        map.pillar(square(24, 16, 352), p.brick);
        map.pillar(square(32, 352, 384), p.stone);
    }
    for (step, half) in [(0, 144), (1, 120), (2, 96)] {
        let bounds = Bounds::new(
            [1056 - half, 736 - half, step * 12],
            [1056 + half, 736 + half, step * 12 + 12],
        );
        map.pillar(bounds, p.checker);
    }
    map.pillar(Bounds::new([1028, 708, 36], [1084, 764, 84]), p.marble);
    knot(map, Vec3::new(1056.0, 736.0, 142.0), 62.0, 14.0, p.marble.shader);
    crates(map, p);
    mirror_and_tubes(map, p, 1472, 736);
    wall_lamp(map, p, [1472, 640, 144], Face::MinX, [24, 48], p.colored[2]);
    wall_lamp(map, p, [1472, 832, 144], Face::MinX, [24, 48], p.colored[1]);
    hall
}

fn crates(map: &mut MapBuilder, p: &Palette) {
    let boxes = [
        ([1376, 1000, 0], 88),
        ([1370, 900, 0], 64),
        ([1280, 1044, 0], 56),
        ([1392, 1012, 88], 56),
        ([672, 1040, 0], 64),
        ([744, 1056, 0], 48),
    ];
    for (at, size) in boxes {
        map.pillar(Bounds::new(at, at.map(|c| c + size)), p.wood);
    }
}
