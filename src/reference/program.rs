//! Stages of a material at a point. Counterpart of `shaders/include/program.glsl`.

use super::texture::{sample, sample_encoded};
use crate::assets::image::decode_srgb;
use crate::scene::Scene;
use crate::scene::blending::{Blending, Shade};
use crate::scene::clock::Clock;
use crate::scene::program::{OVERBRIGHT, wave_at};
use crate::scene::records::*;
use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};
use std::f32::consts::TAU;

/// Where the light of `alphaGen lightingSpecular` stands, units.
const SPECULAR_LIGHT: Vec3 = Vec3::new(-960.0, 1980.0, 96.0);
/// Waves of turbulence per unit of space.
const TURBULENCE: f32 = 1.0 / 1024.0;
/// Level of detail of an image's last level, its mean.
const MEAN_LOD: f32 = 64.0;
/// Radius of the world that clouds lie around, units.
const CLOUD_WORLD: f32 = 4096.0;

/// What stages look at.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub uv: Vec2,
    pub lightmap_uv: Vec2,
    /// Encoded vertex colour.
    pub colour: Vec4,
    /// World position.
    pub position: Vec3,
    pub normal: Vec3,
    /// Unit vector to the viewer.
    pub to_viewer: Vec3,
    /// Distance to the viewer, units.
    pub distance: f32,
    /// Level of detail of an image of one texel; −∞ for full resolution.
    pub lod: f32,
}

impl Point {
    /// A point of which only texture, level of detail and place are known.
    pub fn on_texture(uv: Vec2, lod: f32, position: Vec3, to_viewer: Vec3) -> Self {
        Self {
            uv,
            lightmap_uv: uv,
            colour: Vec4::ONE,
            position,
            normal: to_viewer,
            to_viewer,
            distance: 0.0,
            lod,
        }
    }
}

fn wave(w: &Wave, clock: Clock, offset: f32) -> f32 {
    wave_at(w, w.phase + clock.fraction(w.rate) + offset)
}

fn around_middle(m: Mat2, uv: Vec2) -> Vec2 {
    m * (uv - 0.5) + 0.5
}

/// Texture coordinates of a stage, and how many times as dense as the surface's they are.
fn coordinates(scene: &Scene, s: &Stage, p: &Point, clock: Clock) -> (Vec2, f32) {
    let mut uv = match s.tc_gen {
        TC_LIGHTMAP => p.lightmap_uv,
        TC_ENVIRONMENT => {
            let reflected = p.normal * (2.0 * p.normal.dot(p.to_viewer)) - p.to_viewer;
            Vec2::new(0.5 + reflected.y * 0.5, 0.5 - reflected.z * 0.5)
        }
        TC_VECTOR => {
            let [a, b] = s.tc_vectors.map(Vec3::from);
            Vec2::new(p.position.dot(a), p.position.dot(b))
        }
        _ => p.uv,
    };
    let mut density = 1.0;
    for m in &scene.tables.tc_mods[s.first_mod as usize..(s.first_mod + s.mod_count) as usize] {
        match m.kind {
            TC_SCROLL => uv += Vec2::new(clock.fraction(m.rates[0]), clock.fraction(m.rates[1])),
            TC_TURBULENCE => {
                let at = Vec2::new(p.position.x + p.position.z, p.position.y) * TURBULENCE;
                let phase = m.wave.phase + clock.fraction(m.wave.rate);
                let swing = |x: f32| {
                    let turn = x + phase;
                    ((turn - turn.floor()) * TAU).sin() * m.wave.amplitude
                };
                uv += Vec2::new(swing(at.x), swing(at.y));
            }
            TC_STRETCH => {
                let w = wave(&m.wave, clock, 0.0);
                let scale = if w == 0.0 { 1.0 } else { 1.0 / w };
                uv = around_middle(Mat2::from_diagonal(Vec2::splat(scale)), uv);
                density *= scale.abs();
            }
            TC_ROTATE => {
                let (sin, cos) = (clock.fraction(m.rates[0]) * TAU).sin_cos();
                uv = around_middle(Mat2::from_cols(Vec2::new(cos, sin), Vec2::new(-sin, cos)), uv);
            }
            _ => {
                let matrix = Mat2::from_cols_array(&m.matrix);
                uv = matrix * uv + Vec2::from(m.offset);
                density *= matrix.determinant().abs().sqrt();
            }
        }
    }
    (uv, density)
}

fn texture_of(s: &Stage, clock: Clock) -> u32 {
    let frame = (clock.fraction(s.frame_rate) * s.frames as f32) as u32;
    s.textures[frame.min(s.frames - 1) as usize]
}

fn alpha_factor(s: &Stage, p: &Point, clock: Clock) -> f32 {
    match s.alpha_source {
        SOURCE_WAVE => wave(&s.alpha_wave, clock, 0.0).clamp(0.0, 1.0),
        SOURCE_VERTEX => p.colour.w,
        SOURCE_ONE_MINUS_VERTEX => 1.0 - p.colour.w,
        SOURCE_SPECULAR => {
            let to_light = (SPECULAR_LIGHT - p.position).normalize_or_zero();
            let reflected = p.normal * (2.0 * p.normal.dot(to_light)) - to_light;
            let l = reflected.dot(p.to_viewer).max(0.0);
            let squared = l * l;
            (squared * squared).min(1.0)
        }
        SOURCE_PORTAL => (p.distance / s.alpha).clamp(0.0, 1.0),
        _ => s.alpha,
    }
}

fn rgb_factor(s: &Stage, p: &Point, clock: Clock) -> Vec3 {
    match s.rgb_source {
        SOURCE_WAVE => Vec3::splat(wave(&s.rgb_wave, clock, 0.0).clamp(0.0, 1.0)),
        SOURCE_VERTEX => (p.colour.xyz() * OVERBRIGHT).min(Vec3::ONE),
        SOURCE_ONE_MINUS_VERTEX => Vec3::ONE - (p.colour.xyz() * OVERBRIGHT).min(Vec3::ONE),
        _ => s.rgb.into(),
    }
}

fn texel(scene: &Scene, s: &Stage, p: &Point, clock: Clock, encoded: bool, mean: bool) -> Vec4 {
    if s.flags & STAGE_WHITE != 0 {
        return Vec4::ONE;
    }
    let texture = &scene.textures[texture_of(s, clock) as usize];
    let (uv, density) = coordinates(scene, s, p, clock);
    let size = (texture.width * texture.height) as f32;
    let lod = if mean {
        MEAN_LOD
    } else {
        p.lod + 0.5 * size.log2() + density.max(f32::MIN_POSITIVE).log2()
    };
    let clamp = s.flags & STAGE_CLAMP != 0;
    if encoded {
        sample_encoded(texture, uv, lod, clamp)
    } else {
        sample(texture, uv, lod, clamp)
    }
}

/// Encoded colour and alpha of a stage. `mean`: its image's mean stands for the image.
fn stage_colour(scene: &Scene, s: &Stage, p: &Point, clock: Clock, mean: bool) -> Vec4 {
    texel(scene, s, p, clock, true, mean) * rgb_factor(s, p, clock).extend(alpha_factor(s, p, clock))
}

fn stages<'a>(scene: &'a Scene, material: &Material) -> &'a [Stage] {
    &scene.tables.stages[material.first_stage as usize..(material.first_stage + material.stage_count) as usize]
}

/// What the material does with light at a point. `glossy`: glossy stages reflect.
pub fn shade(scene: &Scene, material: &Material, p: &Point, clock: Clock, glossy: bool) -> Shade {
    let mut blending = Blending::new(glossy);
    for s in stages(scene, material) {
        let mean = glossy && s.flags & STAGE_GLOSSY != 0;
        blending.stage(s, stage_colour(scene, s, p, clock, mean));
    }
    blending.shade()
}

/// Alpha that the material's alpha test looks at, full resolution.
pub fn tested_alpha(scene: &Scene, material: &Material, p: &Point, clock: Clock) -> f32 {
    if material.alpha_stage == NONE {
        let texture = &scene.textures[material.texture as usize];
        return sample(texture, p.uv, 0.0, material.flags & MATERIAL_CLAMP != 0).w;
    }
    let s = &scene.tables.stages[material.alpha_stage as usize];
    texel(scene, s, p, clock, false, false).w * alpha_factor(s, p, clock)
}

/// What the stages that shine show, linear: emission without its factor.
pub fn shining(scene: &Scene, material: &Material, p: &Point, clock: Clock) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for s in stages(scene, material).iter().filter(|s| s.flags & STAGE_EMISSION != 0) {
        let c = texel(scene, s, p, clock, false, false);
        let alpha = if s.source == BLEND_SRC_ALPHA {
            c.w * alpha_factor(s, p, clock)
        } else {
            1.0
        };
        sum += c.xyz() * rgb_factor(s, p, clock).map(decode_srgb) * alpha;
    }
    sum
}

/// Where clouds are seen in a direction: their texture coordinates.
pub fn cloud_coordinates(direction: Vec3, height: f32) -> Vec2 {
    let r = CLOUD_WORLD;
    let z = direction.z;
    let t = (z * z * r * r + 2.0 * r * height + height * height).sqrt() - z * r;
    let v = (direction * t + Vec3::new(0.0, 0.0, r)).normalize();
    Vec2::new(v.x.clamp(-1.0, 1.0).acos(), v.y.clamp(-1.0, 1.0).acos())
}
