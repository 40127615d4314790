//! What arrives from other surfaces and from the sky, gathered once from the stored light itself.

use super::encoding::Encoding;
use super::luxels::Luxel;
use super::random::Random;
use super::visibility::Occluders;
use crate::assets::bsp::lumps::{LIGHTMAP_BYTES, LIGHTMAP_SIZE};
use crate::reference::light_sample::tangents;
use crate::reference::trace::Hit;
use crate::scene::Scene;
use crate::scene::records::MATERIAL_SKY;
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Directions per luxel.
const RAYS: u32 = 64;
/// The compiler's albedo is this times the mean encoded texture colour.
const BOUNCE_ALBEDO: f32 = 0.551;

/// Irradiances at one luxel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    /// E/π of light reflected by what is seen, if everything that is stored bounces once, luxel units.
    pub indirect: Vec3,
    /// Share of the cosine-weighted hemisphere that shows the sky.
    pub sky: f32,
}

/// Gathers over the cosine-weighted hemisphere of every luxel.
pub fn gather(occluders: &Occluders, encoding: &Encoding, luxels: &[Luxel], seed: u32) -> Vec<Gathered> {
    let table: [f32; 256] = std::array::from_fn(|b| encoding.decode_byte(b as u8));
    luxels
        .par_iter()
        .enumerate()
        .map(|(i, luxel)| {
            let mut random = Random::new(seed, 0x4741, i as u32);
            one(occluders, &table, luxel, &mut random)
        })
        .collect()
}

fn one(occluders: &Occluders, table: &[f32; 256], luxel: &Luxel, random: &mut Random) -> Gathered {
    let (t1, t2) = tangents(luxel.normal);
    let origin = luxel.origin(luxel.normal);
    let mut out = Gathered::default();
    let turn = random.unit();
    for i in 0..RAYS {
        let r2 = (i as f32 + random.unit()) / RAYS as f32;
        let phi = TAU * (i as f32 * 0.618_034 + turn).fract();
        let (sin, cos) = phi.sin_cos();
        let r = r2.sqrt();
        let direction = t1 * (r * cos) + t2 * (r * sin) + luxel.normal * (1.0 - r2).max(0.0).sqrt();
        let Some(hit) = occluders.closest(origin, direction) else {
            continue;
        };
        let scene = occluders.scene;
        let triangle = scene.geometry.triangles[hit.triangle as usize];
        if scene.materials[triangle.material as usize].flags & MATERIAL_SKY != 0 {
            out.sky += 1.0;
        } else {
            out.indirect += reflected(scene, table, &hit, direction);
        }
    }
    out.sky /= RAYS as f32;
    out.indirect /= RAYS as f32;
    out
}

/// Radiance that a surface reflects by what is stored of it; its back is black.
fn reflected(scene: &Scene, table: &[f32; 256], hit: &Hit, direction: Vec3) -> Vec3 {
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let [a, b, c] = scene.geometry.corners(hit.triangle);
    let source = &scene.material_sources[triangle.material as usize];
    if (b - a).cross(c - a).dot(direction) > 0.0 && !source.two_sided {
        return Vec3::ZERO;
    }
    let texture = &scene.textures[scene.materials[triangle.material as usize].texture as usize];
    Vec3::from(texture.mean_encoded) * BOUNCE_ALBEDO * stored(scene, table, hit)
}

/// Stored light at a hit: the nearest luxel's, or the vertices'.
fn stored(scene: &Scene, table: &[f32; 256], hit: &Hit) -> Vec3 {
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let [b1, b2] = hit.barycentrics.map(|b| b as f32);
    let weights = [1.0 - b1 - b2, b1, b2];
    let page = usize::try_from(scene.bsp.surfaces[triangle.surface as usize].lightmap)
        .ok()
        .filter(|p| (p + 1) * LIGHTMAP_BYTES <= scene.bsp.lightmaps.len());
    let Some(page) = page else {
        let colours = triangle.vertices.map(|v| {
            let [r, g, b, _] = scene.geometry.attributes[v as usize].color.to_le_bytes();
            Vec3::from([r, g, b].map(|x| table[usize::from(x)]))
        });
        return colours[0] * weights[0] + colours[1] * weights[1] + colours[2] * weights[2];
    };
    let (mut s, mut t) = (0.0, 0.0);
    for (v, w) in triangle.vertices.into_iter().zip(weights) {
        let [x, y] = scene.geometry.lightmap_uvs[v as usize];
        s += x * w;
        t += y * w;
    }
    let at = |x: f32| ((x * LIGHTMAP_SIZE as f32) as usize).min(LIGHTMAP_SIZE - 1);
    let texel = ((page * LIGHTMAP_SIZE + at(t)) * LIGHTMAP_SIZE + at(s)) * 3;
    Vec3::from([0, 1, 2].map(|c| table[usize::from(scene.bsp.lightmaps[texel + c])]))
}

/// Rays of the compiler's `-dirty`: polar angles in degrees, azimuths, and how far they look, units.
const DIRT_ANGLES: [f32; 3] = [14.7, 44.0, 73.3];
const DIRT_AZIMUTHS: u32 = 16;
const DIRT_DEPTH: f32 = 128.0;

/// The factor by which `-dirty` darkens each luxel.
pub fn dirt(occluders: &Occluders, luxels: &[Luxel]) -> Vec<f32> {
    let factor = |luxel: &Luxel| {
        let (t1, t2) = tangents(luxel.normal);
        let origin = luxel.origin(luxel.normal);
        let near = |direction: Vec3| {
            let hit = occluders.closest(origin, direction);
            hit.map_or(0.0, |h| (1.0 - h.t as f32 / DIRT_DEPTH).max(0.0))
        };
        let mut sum = near(luxel.normal);
        for polar in DIRT_ANGLES {
            let (sin, cos) = polar.to_radians().sin_cos();
            for i in 0..DIRT_AZIMUTHS {
                let (s, c) = (TAU * i as f32 / DIRT_AZIMUTHS as f32).sin_cos();
                sum += near(luxel.normal * cos + (t1 * c + t2 * s) * sin);
            }
        }
        1.0 - sum / (1 + DIRT_ANGLES.len() as u32 * DIRT_AZIMUTHS) as f32
    };
    luxels.par_iter().map(factor).collect()
}
