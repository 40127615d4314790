//! Forge, stairs and cellar.

use super::fittings::{Archway, grate, pillar, skirting, wall_lamp};
use super::palette::{Palette, room};
use crate::assets::bsp::build::{Bounds, CellId, Entity, Face, MapBuilder};
use glam::Vec3;

const CELLAR_FLOOR: i32 = -256;

/// South of the atrium: a pit of glowing coals in a brick room, and a shaft with a grate down to the cellar.
pub fn forge(map: &mut MapBuilder, p: &Palette, atrium: CellId) -> CellId {
    let bounds = Bounds::new([-320, -768, 0], [320, -448, 208]);
    let forge = map.cell("forge", bounds, room(p.brick, p.stone, p.concrete));
    let door = Archway {
        bounds: Bounds::new([-80, -448, 0], [80, -384, 176]),
        axis: 1,
        rise: 56.0,
        walls: p.stone,
        floor: p.tiles,
    };
    door.build(map, "forge door", atrium, forge);
    skirting(map, p.stone, &bounds, &[Bounds::new([-80, -448, 0], [80, -440, 64])]);
    map.panel(forge, Face::MinZ, Bounds::new([-232, -704, 0], [-40, -560, 0]), p.ember);
    let rim = [
        Bounds::new([-248, -720, 0], [-24, -704, 14]),
        Bounds::new([-248, -560, 0], [-24, -544, 14]),
        Bounds::new([-248, -704, 0], [-232, -560, 14]),
        Bounds::new([-40, -704, 0], [-24, -560, 14]),
    ];
    for stone in rim {
        map.pillar(stone, p.stone);
    }
    // A hood of metal over the coals, on posts.
    map.pillar(Bounds::new([-264, -736, 136], [-8, -528, 152]), p.metal);
    map.pillar(Bounds::new([-200, -696, 152], [-72, -568, 208]), p.metal);
    for (x, y) in [(-256, -728), (-16, -728), (-256, -536), (-16, -536)] {
        map.pillar(Bounds::new([x - 5, y - 5, 0], [x + 5, y + 5, 136]), p.metal);
    }
    for x in [-200, 200] {
        pillar(map, p, [x, -470], [0, 208], 14);
    }
    wall_lamp(map, p, [320, -608, 128], Face::MinX, [24, 40], p.sconce);
    forge
}

/// Stairs from the corridor's end down to the cellar's level.
pub fn stairs(map: &mut MapBuilder, p: &Palette, corridor: CellId) -> CellId {
    let bounds = Bounds::new([-768, -1088, CELLAR_FLOOR], [-96, -832, 176]);
    let stairs = map.cell("stairs", bounds, room(p.brick, p.stone, p.plaster));
    let door = Archway {
        bounds: Bounds::new([-752, -832, 0], [-624, -800, 152]),
        axis: 1,
        rise: 48.0,
        walls: p.concrete,
        floor: p.metal,
    };
    door.build(map, "stairs door", corridor, stairs);
    map.pillar(Bounds::new([-768, -1088, CELLAR_FLOOR], [-608, -832, 0]), p.stone);
    for step in 0..15 {
        let x = -608 + 24 * step;
        let tread = Bounds::new([x, -1088, CELLAR_FLOOR], [x + 24, -832, -16 * (step + 1)]);
        map.pillar(tread, p.stone);
    }
    for (i, x) in [-640, -480, -320, -160].into_iter().enumerate() {
        let z = [112, 32, -72, -120][i];
        wall_lamp(map, p, [x, -1088, z], Face::MaxY, [28, 48], p.sconce);
    }
    stairs
}

/// The cellar: pillars, one lamp behind a grate, and what falls through the forge's shaft.
pub fn cellar(map: &mut MapBuilder, p: &Palette, stairs: CellId, forge: CellId) -> CellId {
    let bounds = Bounds::new([-64, -1152, CELLAR_FLOOR], [512, -576, -96]);
    let cellar = map.cell("cellar", bounds, room(p.brick, p.concrete, p.concrete));
    let door = Archway {
        bounds: Bounds::new([-96, -1024, CELLAR_FLOOR], [-64, -896, -112]),
        axis: 0,
        rise: 48.0,
        walls: p.stone,
        floor: p.stone,
    };
    door.build(map, "cellar door", stairs, cellar);
    let shaft = Bounds::new([96, -704, -96], [224, -608, 0]);
    map.passage("shaft", cellar, forge, shaft, room(p.metal, p.metal, p.metal));
    grate(map, p, &Bounds::new([96, -704, -4], [224, -608, -4]));
    for (x, y) in [(96, -800), (96, -992), (352, -736)] {
        let square = |half: i32, z0: i32, z1: i32| Bounds::new([x - half, y - half, z0], [x + half, y + half, z1]);
        map.pillar(square(20, CELLAR_FLOOR, -112), p.brick);
        map.pillar(square(28, -112, -96), p.stone);
    }
    // The lamp hangs in a cell of its own, behind bars.
    let glow = Some(p.cellar_lamp);
    map.solid(
        Bounds::new([404, -1036, -140], [428, -1012, -116]),
        [glow, glow, glow, glow, glow, Some(p.metal)],
    );
    map.pillar(Bounds::new([412, -1028, -116], [420, -1020, -96]), p.metal);
    grate(map, p, &Bounds::new([304, -896, CELLAR_FLOOR], [512, -896, -96]));
    grate(map, p, &Bounds::new([304, -1088, CELLAR_FLOOR], [304, -896, -96]));
    map.pillar(Bounds::new([298, -902, CELLAR_FLOOR], [310, -890, -96]), p.metal);
    map.pillar(
        Bounds::new([392, -880, CELLAR_FLOOR], [448, -824, CELLAR_FLOOR + 56]),
        p.wood,
    );
    map.pillar(
        Bounds::new([440, -812, CELLAR_FLOOR], [480, -772, CELLAR_FLOOR + 40]),
        p.wood,
    );
    map.entity(Entity::light(Vec3::new(-8.0, -624.0, -208.0), 40.0, [0.55, 0.7, 1.0]));
    cellar
}
