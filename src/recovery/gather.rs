//! What arrives from other surfaces and from the sky, gathered once from the stored light itself.

use super::emitter::NEAREST;
use super::encoding::Encoding;
use super::luxels::{Luxel, SAMPLE_OFFSET};
use super::point::POINT;
use super::random::Random;
use super::visibility::Occluders;
use crate::assets::bsp::lumps::{LIGHTMAP_BYTES, LIGHTMAP_SIZE};
use crate::reference::trace::Hit;
use crate::scene::Scene;
use crate::scene::records::MATERIAL_SKY;
use crate::scene::sampling::tangents;
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

/// What the stored light is read with.
pub struct Gather<'a> {
    occluders: &'a Occluders<'a>,
    encoding: Encoding,
    table: [f32; 256],
    /// Lights that say how bright clamped luxels really are: position and power.
    lights: Vec<(Vec3, Vec3)>,
}

impl<'a> Gather<'a> {
    /// Reads stored light by an encoding; where it is clamped, `lights` (positions and powers) may say that it is more.
    pub fn new(occluders: &'a Occluders<'a>, encoding: Encoding, lights: Vec<(Vec3, Vec3)>) -> Self {
        Self {
            occluders,
            encoding,
            table: std::array::from_fn(|b| encoding.decode_byte(b as u8)),
            lights,
        }
    }

    /// Gathers over the cosine-weighted hemisphere of every luxel.
    pub fn all(&self, luxels: &[Luxel], seed: u32) -> Vec<Gathered> {
        let one = |(i, luxel)| self.one(luxel, &mut Random::new(seed, 0x4741, i as u32));
        luxels.par_iter().enumerate().map(one).collect()
    }

    fn one(&self, luxel: &Luxel, random: &mut Random) -> Gathered {
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
            let Some(hit) = self.occluders.closest(origin, direction) else {
                continue;
            };
            let scene = self.occluders.scene;
            let triangle = scene.geometry.triangles[hit.triangle as usize];
            if scene.materials[triangle.material as usize].flags & MATERIAL_SKY != 0 {
                out.sky += 1.0;
            } else {
                out.indirect += self.reflected(&hit, origin + direction * hit.t as f32, direction);
            }
        }
        out.sky /= RAYS as f32;
        out.indirect /= RAYS as f32;
        out
    }

    /// Radiance that a surface reflects by what is stored of it; its back is black.
    fn reflected(&self, hit: &Hit, position: Vec3, direction: Vec3) -> Vec3 {
        let scene = self.occluders.scene;
        let triangle = scene.geometry.triangles[hit.triangle as usize];
        let [a, b, c] = scene.geometry.corners(hit.triangle);
        let source = &scene.material_sources[triangle.material as usize];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let behind = normal.dot(direction) > 0.0;
        if behind && !source.two_sided {
            return Vec3::ZERO;
        }
        let texture = &scene.textures[scene.materials[triangle.material as usize].texture as usize];
        let bytes = stored(scene, hit);
        let mut light = Vec3::from(bytes.map(|b| self.table[usize::from(b)]));
        if !self.lights.is_empty() && self.encoding.is_clamped(bytes) {
            light = light.max(self.direct(position, if behind { -normal } else { normal }));
        }
        Vec3::from(texture.mean_encoded) * BOUNCE_ALBEDO * light
    }

    /// E/π of the lights at a place.
    fn direct(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let origin = position + normal * SAMPLE_OFFSET;
        let mut sum = Vec3::ZERO;
        for (light, power) in &self.lights {
            let to = *light - position;
            let d2 = to.length_squared();
            let cosine = normal.dot(to);
            if cosine <= 0.0 {
                continue;
            }
            let value = *power * (POINT * cosine / (d2.sqrt() * d2.max(NEAREST * NEAREST)));
            if value.max_element() > NOTEWORTHY && self.occluders.sees(origin, *light) {
                sum += value;
            }
        }
        sum
    }
}

/// Light that a clamped luxel may owe its brightness to, luxel units.
const NOTEWORTHY: f32 = 0.2;

/// Stored bytes at a hit: the nearest luxel's, or the nearest vertex's.
fn stored(scene: &Scene, hit: &Hit) -> [u8; 3] {
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let [b1, b2] = hit.barycentrics.map(|b| b as f32);
    let weights = [1.0 - b1 - b2, b1, b2];
    let page = usize::try_from(scene.bsp.surfaces[triangle.surface as usize].lightmap)
        .ok()
        .filter(|p| (p + 1) * LIGHTMAP_BYTES <= scene.bsp.lightmaps.len());
    let Some(page) = page else {
        let mut nearest = 0;
        for i in 1..3 {
            if weights[i] > weights[nearest] {
                nearest = i;
            }
        }
        let [r, g, b, _] = scene.geometry.attributes[triangle.vertices[nearest] as usize]
            .color
            .to_le_bytes();
        return [r, g, b];
    };
    let (mut s, mut t) = (0.0, 0.0);
    for (v, w) in triangle.vertices.into_iter().zip(weights) {
        let [x, y] = scene.geometry.attributes[v as usize].lightmap_uv;
        s += x * w;
        t += y * w;
    }
    let at = |x: f32| ((x * LIGHTMAP_SIZE as f32) as usize).min(LIGHTMAP_SIZE - 1);
    let texel = ((page * LIGHTMAP_SIZE + at(t)) * LIGHTMAP_SIZE + at(s)) * 3;
    [0, 1, 2].map(|c| scene.bsp.lightmaps[texel + c])
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
