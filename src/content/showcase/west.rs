//! Gallery and corridor.

use super::fittings::{Archway, long_room, pillar, skirting, wall_lamp};
use super::palette::{Palette, room};
use crate::assets::bsp::build::{Bounds, CellId, Entity, Face, MapBuilder, Solid, sweep};
use glam::Vec3;

/// The cells at the two ends of a long room.
pub struct Ends {
    pub first: CellId,
    pub last: CellId,
}

/// A long room north of the atrium with small lamps in four colours between half-columns.
pub fn gallery(map: &mut MapBuilder, p: &Palette, atrium: CellId) -> Ends {
    let bounds = Bounds::new([-576, 448, 0], [576, 704, 208]);
    let parts = long_room(
        map,
        "gallery",
        bounds,
        0,
        &[-240, 240],
        room(p.plaster, p.wood, p.plaster),
    );
    let door = Archway {
        bounds: Bounds::new([-80, 384, 0], [80, 448, 184]),
        axis: 1,
        rise: 64.0,
        walls: p.stone,
        floor: p.tiles,
    };
    door.build(map, "gallery door", atrium, parts[1]);
    let gaps = [
        Bounds::new([-80, 440, 0], [80, 448, 64]),
        Bounds::new([-584, 512, 0], [-576, 640, 64]),
        Bounds::new([576, 512, 0], [584, 640, 64]),
    ];
    skirting(map, p.trim, &bounds, &gaps);
    for (i, x) in (-504..=504).step_by(144).enumerate() {
        wall_lamp(map, p, [x, 704, 112], Face::MinY, [32, 56], p.colored[i % 4]);
        if i % 2 == 1 {
            let south = if x < 0 { x - 40 } else { x + 40 };
            wall_lamp(map, p, [south, 448, 112], Face::MaxY, [28, 32], p.colored[(i + 2) % 4]);
        }
        if x < 504 {
            pillar(map, p, [x + 72, 688], [0, 208], 12);
        }
    }
    // Coves round off wall and ceiling.
    for (y, inward) in [(448.0, 40.0), (704.0, -40.0)] {
        let profile = [
            Vec3::new(-576.0, y, 168.0),
            Vec3::new(-576.0, y, 208.0),
            Vec3::new(-576.0, y + inward, 208.0),
        ];
        let cove = sweep(&profile, Vec3::X * 1152.0, 192.0).facing(Vec3::new(0.0, 576.0, 100.0), false);
        map.patch(cove, p.plaster.shader);
    }
    // Benches and a light of the old kind over the middle.
    for x in [-300, 300] {
        map.pillar(Bounds::new([x - 64, 560, 12], [x + 64, 592, 20]), p.wood);
        map.pillar(Bounds::new([x - 56, 564, 0], [x - 44, 588, 12]), p.metal);
        map.pillar(Bounds::new([x + 44, 564, 0], [x + 56, 588, 12]), p.metal);
    }
    map.entity(Entity::light(Vec3::new(0.0, 576.0, 176.0), 90.0, [1.0, 0.86, 0.66]));
    Ends {
        first: parts[0],
        last: parts[2],
    }
}

/// The long corridor in the west with its strips of light, and the passage with the sliding door to the
/// atrium. Returns its southern end.
pub fn corridor(map: &mut MapBuilder, p: &Palette, atrium: CellId, gallery: &Ends) -> CellId {
    let bounds = Bounds::new([-768, -800, 0], [-608, 736, 176]);
    let faces = room(p.concrete, p.metal, p.concrete);
    let parts = long_room(map, "corridor", bounds, 1, &[-608, -224, 160, 480], faces);
    let door = Archway {
        bounds: Bounds::new([-608, 512, 0], [-576, 640, 160]),
        axis: 0,
        rise: 40.0,
        walls: p.concrete,
        floor: p.wood,
    };
    door.build(map, "corridor door", gallery.first, parts[4]);
    for (i, y) in (-704..=640).step_by(192).enumerate() {
        let mut faces = [Some(p.trim); 6];
        faces[Face::MinZ as usize] = Some(p.strip);
        map.solid(Bounds::new([-706, y - 56, 170], [-670, y + 56, 176]), faces);
        if i > 0 {
            rib(map, p, y - 96);
        }
    }
    let passage_bounds = Bounds::new([-608, -64, 0], [-384, 64, 144]);
    let faces = room(p.metal, p.metal, p.concrete);
    map.passage("sliding door", parts[2], atrium, passage_bounds, faces);
    wall_lamp(map, p, [-440, 64, 104], Face::MinY, [24, 16], p.sconce);
    wall_lamp(map, p, [-560, -64, 104], Face::MaxY, [24, 16], p.colored[0]);
    sliding_door(map, p);
    parts[0]
}

/// A frame of trim around the corridor's section.
fn rib(map: &mut MapBuilder, p: &Palette, y: i32) {
    let doorway = Bounds::new([-608, -64, 0], [-384, 64, 144]);
    let parts = [
        Bounds::new([-768, y - 8, 0], [-756, y + 8, 176]),
        Bounds::new([-620, y - 8, 0], [-608, y + 8, 176]),
        Bounds::new([-756, y - 8, 164], [-620, y + 8, 176]),
    ];
    for part in parts.iter().filter(|part| !part.grown(1).overlaps(&doorway)) {
        map.pillar(*part, p.trim);
    }
}

fn sliding_door(map: &mut MapBuilder, p: &Palette) {
    let trim = Some(p.trim);
    let face = Some(p.door);
    let leaf = Solid {
        bounds: Bounds::new([-508, -64, 0], [-496, 64, 144]),
        faces: [face, face, trim, trim, trim, trim],
        contents: p.door.shader,
        carves: false,
    };
    let door = Entity::new("func_door")
        .with("angle", "-1")
        .with("speed", "200")
        .with("wait", "2")
        .with("lip", "12");
    map.brush_model(vec![leaf], door);
}
