//! Shadow rays. Counterpart of `shaders/include/visibility.glsl`.

use super::light_sample::{LightSample, Target};
use super::surface::shade_at;
use super::trace::{Between, Tracer};
use crate::scene::Scene;
use crate::scene::records::{MATERIAL_FILTER, MATERIAL_LAYER};
use glam::Vec3;

/// Layers nearer to a receiver than this many units lie on it: they don't tint its light, only what is seen of it.
pub const ON_RECEIVER: f32 = 1.0;

/// Share of a light sample that reaches a point in front of a surface.
pub fn visible(scene: &Scene, tracer: &Tracer, origin: Vec3, sample: &LightSample) -> Vec3 {
    match sample.target {
        Target::Point(point) => match tracer.between(scene, origin, point - origin, 1.0) {
            Between::Blocked => Vec3::ZERO,
            Between::Free => Vec3::ONE,
            Between::Filtered => filtered(scene, tracer, origin, point - origin, 1.0),
        },
        Target::Sky(direction) => match tracer.sky(scene, origin, direction) {
            None => Vec3::ZERO,
            Some((_, false)) => Vec3::ONE,
            Some((t, true)) => filtered(scene, tracer, origin, direction, t),
        },
    }
}

/// What the layers at 0 < t < `t_max` leave of light.
fn filtered(scene: &Scene, tracer: &Tracer, origin: Vec3, direction: Vec3, t_max: f64) -> Vec3 {
    let mut share = Vec3::ONE;
    let mut after = None;
    while let Some(hit) = tracer.next(scene, origin, direction, t_max, after) {
        let material = &scene.materials[scene.geometry.triangles[hit.triangle as usize].material as usize];
        if material.flags & MATERIAL_LAYER == 0 || share == Vec3::ZERO {
            break;
        }
        if material.flags & MATERIAL_FILTER != 0 && hit.t as f32 * direction.length() >= ON_RECEIVER {
            share *= shade_at(scene, tracer, &hit, direction).through.min(Vec3::ONE);
        }
        after = Some(hit);
    }
    share
}
