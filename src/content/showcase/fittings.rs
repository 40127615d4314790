//! Parts that several rooms use: arched doorways, lamps, columns, statues.

use super::palette::{Palette, room};
use crate::assets::bsp::build::{
    Bounds, CellId, Face, MapBuilder, Mesh, MeshVertex, Paint, Paints, ShaderId, arch, column, spandrels,
};
use glam::{Vec2, Vec3};

/// An arched doorway (or window) through a wall: a passage whose upper part is filled down to a half-ellipse of `rise`.
/// `axis` (0 or 1) is the way through.
pub struct Archway {
    pub bounds: Bounds,
    pub axis: usize,
    pub rise: f32,
    pub walls: Paint,
    pub floor: Paint,
}

impl Archway {
    /// Makes the passage and its curves.
    pub fn build(&self, map: &mut MapBuilder, name: &str, a: CellId, b: CellId) -> CellId {
        let cell = map.passage(name, a, b, self.bounds, room(self.walls, self.floor, self.walls));
        arch_under(map, &self.bounds, self.axis, self.rise, self.walls.shader);
        cell
    }
}

/// Underside and both fronts of an arch that fills the top of an opening.
pub fn arch_under(map: &mut MapBuilder, opening: &Bounds, axis: usize, rise: f32, shader: ShaderId) {
    let (mins, maxs) = (opening.mins.as_vec3(), opening.maxs.as_vec3());
    let across = 1 - axis;
    let mut left = mins.with_z(maxs.z - rise);
    let mut right = left;
    right[across] = maxs[across];
    let mut depth = Vec3::ZERO;
    depth[axis] = maxs[axis] - mins[axis];
    map.patch(arch(left, right, rise, depth, 96.0), shader);
    let through = depth.normalize_or(Vec3::X);
    for front in [-through, through] {
        for patch in spandrels(left, right, rise, front, 96.0) {
            map.patch(patch, shader);
        }
        left += depth;
        right += depth;
    }
}

/// A round column with square base and capital between two heights.
pub fn pillar(map: &mut MapBuilder, paints: &Palette, at: [i32; 2], z: [i32; 2], radius: i32) {
    let square = |half: i32, from: i32, to: i32| {
        Bounds::new([at[0] - half, at[1] - half, from], [at[0] + half, at[1] + half, to])
    };
    map.pillar(square(radius + 8, z[0], z[0] + 12), paints.marble);
    map.pillar(square(radius + 8, z[1] - 16, z[1]), paints.marble);
    let (from, to) = (z[0] + 12, z[1] - 16);
    // The core keeps players out; the curve around it is what is seen.
    map.solid(square(radius * 2 / 3, from, to), [None; 6]);
    let base = Vec3::new(at[0] as f32, at[1] as f32, from as f32);
    map.patch(
        column(base, radius as f32, (to - from) as f32, 128.0),
        paints.marble.shader,
    );
}

/// A lamp on a wall: a box of `size` around `centre` of its back, which lies on the wall that `facing` leads away from.
/// Its front glows, the rest is trim.
pub fn wall_lamp(map: &mut MapBuilder, paints: &Palette, back: [i32; 3], facing: Face, size: [i32; 2], glow: Paint) {
    const DEPTH: i32 = 6;
    let axis = facing.axis();
    let half = [size[0] / 2, size[0] / 2, size[1] / 2];
    let (mut mins, mut maxs) = (back, back);
    for a in 0..3 {
        mins[a] -= half[a];
        maxs[a] += half[a];
    }
    mins[axis] = back[axis] - if facing.is_max() { 0 } else { DEPTH };
    maxs[axis] = back[axis] + if facing.is_max() { DEPTH } else { 0 };
    let mut faces = [Some(paints.trim); 6];
    faces[facing as usize] = Some(glow);
    map.solid(Bounds::new(mins, maxs), faces);
}

/// A glowing rectangle in a ceiling at height `z` with a frame of trim around it. `rect` is [[min x, min y], [max x, max y]].
pub fn ceiling_light(map: &mut MapBuilder, paints: &Palette, cell: CellId, rect: [[i32; 2]; 2], z: i32, glow: Paint) {
    let [[x0, y0], [x1, y1]] = rect;
    map.panel(cell, Face::MaxZ, Bounds::new([x0, y0, z], [x1, y1, z]), glow);
    const WIDTH: i32 = 8;
    let low = z - 10;
    let frame = [
        Bounds::new([x0 - WIDTH, y0 - WIDTH, low], [x1 + WIDTH, y0, z]),
        Bounds::new([x0 - WIDTH, y1, low], [x1 + WIDTH, y1 + WIDTH, z]),
        Bounds::new([x0 - WIDTH, y0, low], [x0, y1, z]),
        Bounds::new([x1, y0, low], [x1 + WIDTH, y1, z]),
    ];
    for beam in frame {
        map.pillar(beam, paints.trim);
    }
}

/// A skirting board of trim along a room's walls is what tells a floor from a wall: boxes of 4 x 10 units, with gaps
/// (given as boxes) for doorways.
pub fn skirting(map: &mut MapBuilder, paint: Paint, floor: &Bounds, gaps: &[Bounds]) {
    const DEPTH: i32 = 4;
    const HEIGHT: i32 = 10;
    let (lo, hi) = (floor.mins, floor.maxs);
    let top = lo.z + HEIGHT;
    let boards = [
        Bounds::new([lo.x, lo.y, lo.z], [lo.x + DEPTH, hi.y, top]),
        Bounds::new([hi.x - DEPTH, lo.y, lo.z], [hi.x, hi.y, top]),
        Bounds::new([lo.x + DEPTH, lo.y, lo.z], [hi.x - DEPTH, lo.y + DEPTH, top]),
        Bounds::new([lo.x + DEPTH, hi.y - DEPTH, lo.z], [hi.x - DEPTH, hi.y, top]),
    ];
    let holes: Vec<Bounds> = gaps.iter().map(|g| g.grown(DEPTH)).collect();
    for board in boards {
        for piece in board.cut_all(&holes, &[0, 1, 2]) {
            map.pillar(piece, paint);
        }
    }
}

/// An upright or lying two-sided rectangle of grate with an invisible box that stops players. `thin` must be flat along
/// one axis.
pub fn grate(map: &mut MapBuilder, paints: &Palette, thin: &Bounds) {
    let (lo, hi) = (thin.mins.as_vec3(), thin.maxs.as_vec3());
    let corners = if lo.z == hi.z {
        [lo, Vec3::new(hi.x, lo.y, lo.z), hi, Vec3::new(lo.x, hi.y, lo.z)]
    } else {
        [lo, hi.with_z(lo.z), hi, lo.with_z(hi.z)]
    };
    map.quad(corners, paints.grate);
    let mut stop = *thin;
    for axis in 0..3 {
        if stop.mins[axis] == stop.maxs[axis] {
            stop.mins[axis] -= 2;
            stop.maxs[axis] += 2;
        }
    }
    map.clip(stop);
}

/// A closed tube along a torus knot around `centre`, as a triangle soup: `radius` of the whole, `thickness` of the tube.
pub fn knot(map: &mut MapBuilder, centre: Vec3, radius: f32, thickness: f32, shader: ShaderId) {
    const RINGS: usize = 144;
    const SIDES: usize = 12;
    let curve = |t: f64| {
        let (p, q) = (2.0 * t, 3.0 * t);
        let r = 2.0 + q.cos();
        Vec3::new((r * p.cos()) as f32, (r * p.sin()) as f32, -q.sin() as f32) * (radius / 3.0)
    };
    // Whole 64ths hide any difference between machines' sines.
    let snapped = |p: Vec3| (p * 64.0).round() / 64.0;
    let mut mesh = Mesh::default();
    for ring in 0..=RINGS {
        let t = std::f64::consts::TAU * ring as f64 / RINGS as f64;
        let here = curve(t);
        let tangent = (curve(t + 0.01) - curve(t - 0.01)).normalize_or(Vec3::X);
        let side = tangent.cross(here).normalize_or(Vec3::Z);
        let up = side.cross(tangent);
        for i in 0..=SIDES {
            let angle = std::f64::consts::TAU * i as f64 / SIDES as f64;
            let normal = side * angle.cos() as f32 + up * angle.sin() as f32;
            mesh.vertices.push(MeshVertex {
                position: snapped(centre + here + normal * thickness),
                normal: snapped(normal * 64.0).normalize_or(Vec3::Z),
                uv: Vec2::new(ring as f32 / 12.0, i as f32 / SIDES as f32),
            });
        }
    }
    let stride = (SIDES + 1) as u32;
    for ring in 0..RINGS as u32 {
        for i in 0..SIDES as u32 {
            let a = ring * stride + i;
            let (b, c, d) = (a + stride, a + stride + 1, a + 1);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    map.mesh(mesh, shader);
}

/// A long room as a row of cells along `axis`, open to each other, cut at the given coordinates: what one end sees need
/// not be seen from the other.
pub fn long_room(
    map: &mut MapBuilder,
    name: &str,
    bounds: Bounds,
    axis: usize,
    cuts: &[i32],
    faces: Paints,
) -> Vec<CellId> {
    let mut cells: Vec<CellId> = Vec::new();
    let mut from = bounds.mins[axis];
    for &to in cuts.iter().chain([&bounds.maxs[axis]]) {
        let mut part = bounds;
        part.mins[axis] = from;
        part.maxs[axis] = to;
        let cell = map.cell(&format!("{name} {}", cells.len() + 1), part, faces);
        if let Some(&before) = cells.last() {
            map.connect(before, cell);
        }
        cells.push(cell);
        from = to;
    }
    cells
}
