//! Maps of any size: a grid of rooms full of small triangles, generated in linear time.

use super::drawn::Mesh;
use super::fixtures::{Draft, Fixture};
use super::map::{CellId, MapBuilder, Paint};
use super::shape::{Bounds, Face};
use super::{BuildError, Entity};
use crate::assets::bsp::lumps::{SURFACE_PLANAR, SURFACE_TRIANGLES};
use glam::Vec3;

/// Edge of a room, thickness of the walls, height; units.
const ROOM: i32 = 384;
const WALL: i32 = 32;
const HEIGHT: i32 = 192;
/// Triangles that a room is made for.
const PER_ROOM: usize = 2000;
/// Triangles of one drawn surface at most, as compilers keep them.
const PER_SURFACE: usize = 512;

/// A grid of rooms with staggered doorways, one ceiling light each, filled with tetrahedra and single triangles to the
/// given number of triangles exactly (12 at least: one bare room).
///
/// # Errors
/// None in practice; as [`MapBuilder::build`].
pub fn stress(triangles: usize) -> Result<Fixture, BuildError> {
    let rooms = (triangles / PER_ROOM).max(1);
    let mut draft = Draft::new();
    let grey = draft.grey(128);
    let clutter = draft.grey(160);
    let lights = [1000, 2000, 4000].map(|n| draft.emitter(n, false, 0));
    // A room is worth having only with its light and doorways; tiny maps are one bare room.
    let light_every_room = triangles >= 64;
    let side = (1..).find(|s| s * s >= rooms).unwrap_or(1);
    build_rooms(&mut draft.map, rooms, side, grey, light_every_room.then_some(&lights));
    // Walls are cut by doorways: count what they came to, then fill up.
    let bare = {
        draft.map.unvised();
        let bare = draft.map.build()?;
        draft.map.vised = true;
        let drawn = bare
            .surfaces
            .iter()
            .filter(|s| [SURFACE_PLANAR, SURFACE_TRIANGLES].contains(&s.kind));
        drawn.map(|s| s.index_count as usize / 3).sum::<usize>()
    };
    let mut left = triangles.saturating_sub(bare);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for room in 0..rooms {
        let share = left / (rooms - room);
        left -= share;
        fill(&mut draft.map, room_bounds(room, side), share, clutter, &mut random);
    }
    draft.finish("stress")
}

fn room_bounds(room: usize, side: usize) -> Bounds {
    let pitch = ROOM + WALL;
    let (x, y) = ((room % side) as i32 * pitch, (room / side) as i32 * pitch);
    Bounds::new([x, y, 0], [x + ROOM, y + ROOM, HEIGHT])
}

fn build_rooms(map: &mut MapBuilder, rooms: usize, side: usize, wall: Paint, lights: Option<&[Paint; 3]>) {
    let mut cells: Vec<CellId> = Vec::with_capacity(rooms);
    for room in 0..rooms {
        let bounds = room_bounds(room, side);
        let cell = map.cell("room", bounds, [Some(wall); 6]);
        cells.push(cell);
        if let Some(lights) = lights {
            let (mut mins, mut maxs) = (bounds.mins + ROOM / 2 - 32, bounds.mins + ROOM / 2 + 32);
            mins.z = HEIGHT;
            maxs.z = HEIGHT;
            map.panel(cell, Face::MaxZ, Bounds { mins, maxs }, lights[room % 3]);
        }
        let middle = bounds.mins + ROOM / 2;
        map.entity(Entity::spawn([middle.x, middle.y, 25], 90 * (room % 4) as i32));
        let (column, row) = (room % side, room / side);
        // Staggered doorways keep views short, so that the visible set, too, grows linearly with the map.
        let mut door = |other: usize, mut bounds: Bounds, along: usize, step: usize| {
            bounds.mins[along] += [48, 256][step % 2];
            bounds.maxs[along] = bounds.mins[along] + 80;
            bounds.maxs.z = 128;
            map.passage("doorway", cells[other], cell, bounds, [Some(wall); 6]);
        };
        if column > 0 {
            let mut gap = bounds;
            gap.maxs.x = bounds.mins.x;
            gap.mins.x = bounds.mins.x - WALL;
            door(room - 1, gap, 1, column);
        }
        if row > 0 {
            let mut gap = bounds;
            gap.maxs.y = bounds.mins.y;
            gap.mins.y = bounds.mins.y - WALL;
            door(room - side, gap, 0, row);
        }
    }
}

/// Fills a room with tetrahedra (four triangles) and, for the rest, single triangles.
fn fill(map: &mut MapBuilder, room: Bounds, triangles: usize, paint: Paint, random: &mut Random) {
    let mut left = triangles;
    while left > 0 {
        let mut mesh = Mesh::default();
        let mut space = left.min(PER_SURFACE);
        left -= space;
        while space > 0 {
            let size = random.between(2.0, 10.0);
            let inside = |random: &mut Random, axis: usize| {
                random.between(room.mins[axis] as f32 + 16.0, room.maxs[axis] as f32 - 16.0)
            };
            let centre = Vec3::new(inside(random, 0), inside(random, 1), inside(random, 2));
            let mut corner = || centre + Vec3::from([(); 3].map(|()| random.between(-size, size)));
            let mut points = [corner(), corner(), corner(), corner()];
            if (points[1] - points[0])
                .cross(points[2] - points[0])
                .dot(points[3] - points[0])
                > 0.0
            {
                points.swap(1, 2);
            }
            let [a, b, c, d] = points;
            for corners in [[a, b, c], [a, d, b], [b, d, c], [c, d, a]].into_iter().take(space) {
                mesh.flat_triangle(corners);
                space -= 1;
            }
        }
        map.mesh(mesh, paint.shader);
    }
}

/// SplitMix64: the same sequence everywhere.
struct Random(u64);

impl Random {
    fn between(&mut self, least: f32, most: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        least + (most - least) * ((z >> 40) as f32 / (1 << 24) as f32)
    }
}
