//! Luxels with their place in the world, and choices of them.

use super::encoding::Encoding;
use super::random::Random;
use crate::assets::bsp::Bsp;
use crate::assets::bsp::lumps::{LIGHTMAP_BYTES, LIGHTMAP_SIZE, content_flags};
use crate::scene::Scene;
use crate::scene::clusters::cluster_at;
use crate::scene::material::Visibility;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// How far off its surface the compiler sampled a luxel, units.
pub const SAMPLE_OFFSET: f32 = 1.0;

/// One luxel.
#[derive(Clone, Copy, Debug)]
pub struct Luxel {
    /// Centre on the surface, world units.
    pub position: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// World vectors from this luxel's centre to the next one's in both directions of the page.
    pub steps: [Vec3; 2],
    /// Square units of surface.
    pub area: f32,
    /// E/π in luxel units, decoded.
    pub stored: Vec3,
    /// All three channels of `stored` are lower bounds.
    pub clamped: bool,
    /// Lit from both sides.
    pub two_sided: bool,
    /// Surface of the map file.
    pub surface: u32,
    /// PVS cluster of the sample's origin.
    pub cluster: u32,
}

impl Luxel {
    /// Where rays to light on the side of `direction` begin.
    pub fn origin(&self, direction: Vec3) -> Vec3 {
        let back = self.two_sided && self.normal.dot(direction) < 0.0;
        self.position + self.normal * if back { -SAMPLE_OFFSET } else { SAMPLE_OFFSET }
    }

    /// A place around the centre as `-filter` spreads each light: `u` and `v` in luxels along the page.
    pub fn moved(&self, u: f32, v: f32) -> Self {
        Self {
            position: self.position + self.steps[0] * u + self.steps[1] * v,
            ..*self
        }
    }

    /// Cosine of a unit direction as the compiler counts it.
    pub fn cosine(&self, direction: Vec3) -> f32 {
        let c = self.normal.dot(direction);
        if self.two_sided { c.abs() } else { c.max(0.0) }
    }
}

/// Whether a material's luxels are evidence: it reflects, does not glow, and has a lightmap that means light.
fn usable(scene: &Scene, material: u32) -> bool {
    let source = &scene.material_sources[material as usize];
    source.surface_light().is_none() && matches!(source.visibility, Visibility::Opaque | Visibility::AlphaTested)
}

/// Area of a triangle in luxels below which it has no luxel of its own (charts that are stored as one colour).
const LEAST_CHART: f32 = 1e-4;

/// All luxels of the world model whose centre lies on their surface and whose sample's origin is in the open.
pub fn all(scene: &Scene, encoding: &Encoding) -> Vec<Luxel> {
    let Some(world) = scene.geometry.meshes.first() else {
        return Vec::new();
    };
    let pages = scene.bsp.lightmaps.len() / LIGHTMAP_BYTES;
    // Triangles of one surface follow each other: a luxel on the edge between two of them is taken once.
    let mut last = vec![u32::MAX; pages * LIGHTMAP_SIZE * LIGHTMAP_SIZE];
    let mut found = Vec::new();
    for t in world.first_triangle..world.first_triangle + world.triangle_count {
        let triangle = scene.geometry.triangles[t as usize];
        let page = scene.bsp.surfaces[triangle.surface as usize].lightmap;
        let Ok(page) = usize::try_from(page) else { continue };
        if page >= pages || !usable(scene, triangle.material) {
            continue;
        }
        let uvs = triangle
            .vertices
            .map(|v| Vec2::from(scene.geometry.attributes[v as usize].lightmap_uv) * LIGHTMAP_SIZE as f32);
        in_triangle(uvs, |x, y, weights, inverse| {
            let texel = (page * LIGHTMAP_SIZE + y) * LIGHTMAP_SIZE + x;
            if last[texel] == triangle.surface {
                return;
            }
            last[texel] = triangle.surface;
            found.push((t, texel, weights, inverse));
        });
    }
    found
        .into_par_iter()
        .filter_map(|(t, texel, weights, inverse)| luxel(scene, encoding, t, texel, weights, inverse))
        .collect()
}

/// What half of the area stores less than, mean of the channels, luxel units.
pub fn median_stored(luxels: &[Luxel]) -> f32 {
    let mut sorted: Vec<(f32, f32)> = luxels.iter().map(|l| (l.stored.element_sum() / 3.0, l.area)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * sorted.iter().map(|(_, area)| f64::from(*area)).sum::<f64>();
    let mut below = 0.0;
    for (stored, area) in sorted {
        below += f64::from(area);
        if below >= half {
            return stored;
        }
    }
    0.0
}

/// Calls `visit` with each luxel (column, row) whose centre is in a triangle of page coordinates, the weights of the second
/// and third corner there, and their change per column and row.
fn in_triangle([a, b, c]: [Vec2; 3], mut visit: impl FnMut(usize, usize, [f32; 2], [[f32; 2]; 2])) {
    let (e1, e2) = (b - a, c - a);
    let det = e1.x * e2.y - e1.y * e2.x;
    if det.abs() < LEAST_CHART || !det.is_finite() {
        return;
    }
    let least = a.min(b).min(c);
    let greatest = a.max(b).max(c);
    let first = (least - 0.5).ceil().max(Vec2::ZERO);
    let last = (greatest - 0.5).floor().min(Vec2::splat((LIGHTMAP_SIZE - 1) as f32));
    let slopes = [[e2.y / det, -e1.y / det], [-e2.x / det, e1.x / det]];
    let mut y = first.y;
    while y <= last.y {
        let mut x = first.x;
        while x <= last.x {
            let p = Vec2::new(x + 0.5, y + 0.5) - a;
            let w1 = p.x * slopes[0][0] + p.y * slopes[1][0];
            let w2 = p.x * slopes[0][1] + p.y * slopes[1][1];
            if w1 >= 0.0 && w2 >= 0.0 && w1 + w2 <= 1.0 {
                visit(x as usize, y as usize, [w1, w2], slopes);
            }
            x += 1.0;
        }
        y += 1.0;
    }
}

fn luxel(
    scene: &Scene,
    encoding: &Encoding,
    t: u32,
    texel: usize,
    [w1, w2]: [f32; 2],
    slopes: [[f32; 2]; 2],
) -> Option<Luxel> {
    let triangle = scene.geometry.triangles[t as usize];
    let [a, b, c] = scene.geometry.corners(t);
    let (e1, e2) = (b - a, c - a);
    let position = a + e1 * w1 + e2 * w2;
    let [na, nb, nc] = triangle
        .vertices
        .map(|v| Vec3::from(scene.geometry.attributes[v as usize].normal));
    let normal = (na * (1.0 - w1 - w2) + nb * w1 + nc * w2).try_normalize()?;
    let steps = slopes.map(|[s1, s2]| e1 * s1 + e2 * s2);
    let origin = position + normal * SAMPLE_OFFSET;
    let cluster = cluster_at(&scene.bsp_nodes, origin)?;
    if in_solid_brush(&scene.bsp, origin) {
        return None;
    }
    let bytes: [u8; 3] = std::array::from_fn(|i| scene.bsp.lightmaps[texel * 3 + i]);
    Some(Luxel {
        position,
        normal,
        steps,
        area: steps[0].cross(steps[1]).length(),
        stored: Vec3::from(bytes.map(|b| encoding.decode_byte(b))),
        clamped: encoding.is_clamped(bytes),
        two_sided: scene.material_sources[triangle.material as usize].two_sided,
        surface: triangle.surface,
        cluster,
    })
}

/// Whether a point in an open leaf lies inside a solid (detail) brush there.
fn in_solid_brush(bsp: &Bsp, point: Vec3) -> bool {
    let Some(leaf) = bsp.leaf_at(point).map(|leaf| &bsp.leafs[leaf]) else {
        return false;
    };
    let first = leaf.first_leaf_brush as usize;
    let numbers = &bsp.leaf_brushes[first..first + leaf.leaf_brush_count as usize];
    numbers.iter().any(|&b| {
        let brush = &bsp.brushes[b as usize];
        let contents = bsp.shaders[brush.shader as usize].content_flags;
        let sides = &bsp.brush_sides[brush.first_side as usize..(brush.first_side + brush.side_count) as usize];
        contents & content_flags::SOLID != 0
            && contents & content_flags::TRANSLUCENT == 0
            && sides.iter().all(|side| {
                let plane = &bsp.planes[side.plane as usize];
                Vec3::from(plane.normal).dot(point) < plane.dist
            })
    })
}

/// Draws up to `count` luxels with probability proportional to `weight`, spread evenly along the list (neighbours in the
/// list are neighbours on a surface), none twice and none of `taken`; marks them there. Returns their indices in order.
pub fn choose(
    luxels: &[Luxel],
    count: usize,
    weight: impl Fn(&Luxel) -> f32,
    taken: &mut [bool],
    random: &mut Random,
) -> Vec<usize> {
    let total: f64 = luxels
        .iter()
        .zip(taken.iter())
        .filter(|(_, taken)| !**taken)
        .map(|(l, _)| f64::from(weight(l)))
        .sum();
    if total <= 0.0 || count == 0 {
        return Vec::new();
    }
    let step = total / count as f64;
    let mut next = f64::from(random.unit()) * step;
    let mut sum = 0.0;
    let mut out = Vec::with_capacity(count);
    for (i, l) in luxels.iter().enumerate() {
        if taken[i] {
            continue;
        }
        sum += f64::from(weight(l));
        if sum > next {
            taken[i] = true;
            out.push(i);
            next += step * ((sum - next) / step).ceil();
        }
    }
    out
}

/// Whether a surface belongs to the third (by number, chosen by hash) that can be held out as a whole.
pub fn held_out_surface(surface: u32, seed: u32) -> bool {
    crate::scene::sampling::key(seed, surface, 0x5f).is_multiple_of(3)
}
