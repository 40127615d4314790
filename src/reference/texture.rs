//! Texture lookups: bilinear in linear light, trilinear by footprint. Counterpart of `shaders/include/texture.glsl`.
//!
//! Filtering is spelled out with single texels and float weights on both sides: the fixed-point weights of texture units
//! would differ between devices by more than the backends are allowed to.

use crate::assets::image::{SRGB_TO_LINEAR, Texture};
use crate::scene::Scene;
use glam::{Vec2, Vec4};

/// Interpolated texture coordinates of a triangle.
pub fn uv_at(scene: &Scene, triangle: u32, [b1, b2]: [f32; 2]) -> Vec2 {
    let [a, b, c] = scene.geometry.triangles[triangle as usize]
        .vertices
        .map(|v| Vec2::from(scene.geometry.attributes[v as usize].uv));
    a * (1.0 - b1 - b2) + b * b1 + c * b2
}

/// What lookups give.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Linear,
    Encoded,
}

fn texel(texture: &Texture, level: usize, x: i32, y: i32, clamp: bool, form: Form) -> Vec4 {
    let (w, h) = texture.level_size(level);
    let (w, h) = (w as i32, h as i32);
    let (x, y) = if clamp {
        (x.clamp(0, w - 1), y.clamp(0, h - 1))
    } else {
        (x.rem_euclid(w), y.rem_euclid(h))
    };
    let p = texture.levels[level][(y * w + x) as usize];
    let table = &*SRGB_TO_LINEAR;
    let colour = |c: u8| match form {
        Form::Linear => table[usize::from(c)],
        Form::Encoded => f32::from(c) / 255.0,
    };
    Vec4::new(colour(p[0]), colour(p[1]), colour(p[2]), f32::from(p[3]) / 255.0)
}

fn bilinear(texture: &Texture, level: usize, uv: Vec2, clamp: bool, form: Form) -> Vec4 {
    let (w, h) = texture.level_size(level);
    // Whole periods are dropped first, so that far coordinates keep their fraction.
    let uv = if clamp {
        uv.clamp(Vec2::ZERO, Vec2::ONE)
    } else {
        uv - uv.floor()
    };
    let p = uv * Vec2::new(w as f32, h as f32) - 0.5;
    let base = p.floor();
    let f = p - base;
    let (x, y) = (base.x as i32, base.y as i32);
    let at = |dx, dy| texel(texture, level, x + dx, y + dy, clamp, form);
    let top = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let bottom = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    top + (bottom - top) * f.y
}

fn trilinear(texture: &Texture, uv: Vec2, lod: f32, clamp: bool, form: Form) -> Vec4 {
    if !uv.is_finite() {
        return Vec4::ZERO;
    }
    let lod = lod.clamp(0.0, (texture.levels.len() - 1) as f32);
    let base = lod.floor();
    let near = bilinear(texture, base as usize, uv, clamp, form);
    let f = lod - base;
    if f == 0.0 {
        return near;
    }
    let far = bilinear(texture, base as usize + 1, uv, clamp, form);
    near + (far - near) * f
}

/// Linear RGB and alpha at texture coordinates; `lod` 0 is the full image.
pub fn sample(texture: &Texture, uv: Vec2, lod: f32, clamp: bool) -> Vec4 {
    trilinear(texture, uv, lod, clamp, Form::Linear)
}

/// The same with RGB as encoded, filtered as such: what stages blend.
pub fn sample_encoded(texture: &Texture, uv: Vec2, lod: f32, clamp: bool) -> Vec4 {
    trilinear(texture, uv, lod, clamp, Form::Encoded)
}
