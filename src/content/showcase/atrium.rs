//! The atrium: a square court of columns and arches under a round opening to the sky.

use super::fittings::{arch_under, ceiling_light, knot, pillar, skirting, wall_lamp};
use super::palette::{Palette, room};
use crate::assets::bsp::build::{Bounds, CellId, Face, MapBuilder, Patch, PatchPoint, column};
use glam::{Vec2, Vec3};

/// Half the court's side, its height, and the line on which the columns stand.
const HALF: i32 = 384;
const HEIGHT: i32 = 448;
const ARCADE: i32 = 256;
/// Underside of the beams over the columns.
const BEAM: i32 = 320;
const OCULUS: i32 = 160;

/// Builds the room, its oculus and the sky above.
pub fn build(map: &mut MapBuilder, p: &Palette) -> CellId {
    let bounds = Bounds::new([-HALF, -HALF, 0], [HALF, HALF, HEIGHT]);
    let atrium = map.cell("atrium", bounds, room(p.stone, p.tiles, p.plaster));
    oculus(map, p, atrium);
    arcade(map, p);
    for (x, y) in [(-1, -1), (-1, 1), (1, -1), (1, 1)] {
        let (x, y) = (x * 204, y * 204);
        ceiling_light(map, p, atrium, [[x - 32, y - 32], [x + 32, y + 32]], HEIGHT, p.coffer);
    }
    for along in [-216, 216] {
        wall_lamp(map, p, [-HALF, along, 168], Face::MaxX, [28, 48], p.sconce);
        wall_lamp(map, p, [HALF, along, 168], Face::MinX, [28, 48], p.sconce);
        wall_lamp(map, p, [along, -HALF, 168], Face::MaxY, [28, 48], p.sconce);
        wall_lamp(map, p, [along, HALF, 168], Face::MinY, [28, 48], p.sconce);
    }
    let doors = [
        Bounds::new([-80, HALF, 0], [80, HALF + 8, 64]),
        Bounds::new([-80, -HALF - 8, 0], [80, -HALF, 64]),
        Bounds::new([HALF, -80, 0], [HALF + 8, 80, 64]),
        Bounds::new([-HALF - 8, -64, 0], [-HALF, 64, 64]),
    ];
    skirting(map, p.trim, &bounds, &doors);
    statue(map, p);
    atrium
}

/// A stepped plinth with a knot of bronze.
fn statue(map: &mut MapBuilder, p: &Palette) {
    map.pillar(Bounds::new([-72, -72, 0], [72, 72, 8]), p.marble);
    map.pillar(Bounds::new([-56, -56, 8], [56, 56, 16]), p.marble);
    map.pillar(Bounds::new([-36, -36, 16], [36, 36, 60]), p.stone);
    map.pillar(Bounds::new([-44, -44, 60], [44, 44, 68]), p.marble);
    knot(map, Vec3::new(0.0, 0.0, 106.0), 48.0, 11.0, p.metal.shader);
}

fn oculus(map: &mut MapBuilder, p: &Palette, atrium: CellId) {
    let sky_bounds = Bounds::new([-352, -352, HEIGHT + 32], [352, 352, 832]);
    let mut faces = [Some(p.sky); 6];
    faces[Face::MinZ as usize] = Some(p.stone);
    let sky = map.cell("sky over the atrium", sky_bounds, faces);
    let opening = Bounds::new([-OCULUS, -OCULUS, HEIGHT], [OCULUS, OCULUS, HEIGHT + 32]);
    map.passage("oculus", atrium, sky, opening, room(p.plaster, p.plaster, p.plaster));
    let (radius, low) = (OCULUS as f32, HEIGHT as f32);
    let centre = Vec3::new(0.0, 0.0, low);
    let ring = column(centre, radius, 32.0, 128.0).facing(centre, false);
    map.patch(ring, p.trim.shader);
    // The square hole's corners, below and above, around the round one.
    for (z, look) in [(low, -64.0), (low + 32.0, 64.0)] {
        for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            let corner = Vec3::new(x * radius, y * radius, z);
            let arc = [Vec3::new(x * radius, 0.0, z), corner, Vec3::new(0.0, y * radius, z)];
            let points = (0..9).map(|i| {
                let position = arc[i % 3].lerp(corner, (i / 3) as f32 * 0.5);
                let uv = Vec2::new(position.x, -position.y) / 192.0;
                PatchPoint { position, uv }
            });
            let piece = Patch {
                width: 3,
                height: 3,
                points: points.collect(),
            };
            map.patch(piece.facing(corner + Vec3::Z * look, false), p.plaster.shader);
        }
    }
}

/// Beams on twelve columns, with arches between them.
fn arcade(map: &mut MapBuilder, p: &Palette) {
    const THICK: i32 = 14;
    let (out, inn) = (ARCADE + THICK, ARCADE - THICK);
    for side in [-1, 1] {
        let line = side * ARCADE;
        let (lo, hi) = (line - THICK, line + THICK);
        map.pillar(Bounds::new([-out, lo, BEAM], [out, hi, HEIGHT]), p.stone);
        map.pillar(Bounds::new([lo, -inn, BEAM], [hi, inn, HEIGHT]), p.stone);
        for (from, to) in [(-inn, -104), (-76, 76), (104, inn)] {
            arch_under(
                map,
                &Bounds::new([from, lo, 0], [to, hi, BEAM]),
                1,
                72.0,
                p.stone.shader,
            );
            arch_under(
                map,
                &Bounds::new([lo, from, 0], [hi, to, BEAM]),
                0,
                72.0,
                p.stone.shader,
            );
        }
        // The masonry between neighbouring arches, over the capitals.
        for at in [-90, 90] {
            map.pillar(Bounds::new([at - THICK, lo, 248], [at + THICK, hi, BEAM]), p.stone);
            map.pillar(Bounds::new([lo, at - THICK, 248], [hi, at + THICK, BEAM]), p.stone);
            pillar(map, p, [at, line], [0, 248], 16);
            pillar(map, p, [line, at], [0, 248], 16);
        }
        for other in [-ARCADE, ARCADE] {
            let corner = Bounds::new([lo, other - THICK, 248], [hi, other + THICK, BEAM]);
            map.pillar(corner, p.stone);
            pillar(map, p, [line, other], [0, 248], 16);
        }
    }
}
