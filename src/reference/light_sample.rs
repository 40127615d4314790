//! One sample of one light as seen from a receiver. Counterpart of `shaders/include/light_sample.glsl`.
//!
//! Values are contributions to irradiance/π in luxel units, without visibility, already divided by the pdf of the
//! position on the light (area measure for triangles, solid angle for spheres, suns and domes).

use super::surface::{SurfaceHit, emitted, offset_point};
use super::texture::uv_at;
use crate::scene::Scene;
use crate::scene::records::{
    LIGHT_DOME, LIGHT_LINEAR, LIGHT_NO_COSINE, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_SUN, LIGHT_TRIANGLE, LIGHT_TWO_SIDED,
    Light,
};
use crate::scene::sampling::{disc, triangle};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Where the shadow ray goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A point; nothing may lie before it.
    Point(Vec3),
    /// A direction to infinity; the ray must leave through a sky surface.
    Sky(Vec3),
}

/// A light sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Contribution to irradiance/π if nothing is in the way.
    pub value: Vec3,
    pub target: Target,
}

/// Orthonormal tangents of a unit vector (Duff et al. 2017).
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

/// Samples a light; `None` where the sample contributes nothing.
pub fn sample_light(scene: &Scene, light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let sample = match light.kind {
        LIGHT_TRIANGLE => sample_triangle(scene, light, at, u, soft),
        LIGHT_SPHERE => sample_sphere(light, at, u, soft),
        LIGHT_SUN => sample_sun(light, at, u, soft),
        LIGHT_DOME => sample_dome(light, at, u),
        _ => None,
    }?;
    (sample.value.max_element() > 0.0 && sample.value.is_finite()).then_some(sample)
}

/// Cosine at the receiver; 0 where the direction leaves through the surface itself.
fn receiver_cosine(at: &SurfaceHit, direction: Vec3) -> f32 {
    if at.geometric_normal.dot(direction) <= 0.0 {
        0.0
    } else {
        at.shading_normal.dot(direction).max(0.0)
    }
}

fn sample_triangle(scene: &Scene, light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let [b1, b2] = if soft { triangle(u) } else { [1.0 / 3.0; 2] };
    let (e1, e2) = (Vec3::from(light.p1), Vec3::from(light.p2));
    let point = Vec3::from(light.p0) + e1 * b1 + e2 * b2;
    let to_light = point - at.position;
    let d2 = to_light.length_squared();
    if d2 <= 0.0 {
        return None;
    }
    let direction = to_light / d2.sqrt();
    let cos_receiver = receiver_cosine(at, direction);
    let normal = e1.cross(e2).normalize();
    let cos_light = -normal.dot(direction);
    let two_sided = light.flags & LIGHT_TWO_SIDED != 0;
    if cos_receiver <= 0.0 || (cos_light <= 0.0 && !two_sided) || cos_light == 0.0 {
        return None;
    }
    let uv = uv_at(scene, light.triangle, [b1, b2]);
    let radiance = emitted(scene, &scene.materials[light.material as usize], uv, direction);
    let geometry = cos_receiver * cos_light.abs() * light.size / (PI * d2);
    let side = if cos_light > 0.0 { normal } else { -normal };
    Some(LightSample {
        value: radiance * geometry,
        target: Target::Point(offset_point(point, side)),
    })
}

fn sample_sphere(light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let centre = Vec3::from(light.p0);
    let to_centre = centre - at.position;
    let d2 = to_centre.length_squared();
    let r2 = light.size * light.size;
    if d2 <= r2 {
        return None;
    }
    let d = d2.sqrt();
    let axis = to_centre / d;
    // 1 − cos of the cone, without cancellation.
    let sin2 = r2 / d2;
    let cone = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
    let (direction, reach) = if soft {
        let drop = u[0] * cone;
        let cos = 1.0 - drop;
        let sin_2 = drop * (2.0 - drop);
        let phi = TAU * u[1];
        let (t1, t2) = tangents(axis);
        let sin = sin_2.max(0.0).sqrt();
        let direction = axis * cos + t1 * (sin * phi.cos()) + t2 * (sin * phi.sin());
        (direction, d * cos - (r2 - d2 * sin_2).max(0.0).sqrt())
    } else {
        (axis, d - light.size)
    };
    let mut cosine = receiver_cosine(at, direction);
    if cosine <= 0.0 {
        return None;
    }
    if light.flags & LIGHT_NO_COSINE != 0 {
        cosine = 1.0;
    }
    let mut value = if light.flags & LIGHT_LINEAR != 0 {
        Vec3::from(light.radiance) * ((light.p2[2] - d * light.p2[1]).max(0.0) * cosine)
    } else {
        // Solid angle 2π·cone; irradiance/π is radiance · cos · solid angle / π.
        Vec3::from(light.radiance) * (2.0 * cone * cosine)
    };
    if light.flags & LIGHT_SPOT != 0 {
        let spot = Vec3::from(light.p1);
        let along = -to_centre.dot(spot);
        let off = (-to_centre - spot * along).length();
        let edge = if along > 0.0 {
            (light.p2[0] * along - off) / 32.0
        } else {
            0.0
        };
        value *= edge.clamp(0.0, 1.0);
    }
    Some(LightSample {
        value,
        target: Target::Point(at.position + direction * reach),
    })
}

fn sky_sample(at: &SurfaceHit, azimuth: f32, elevation: f32, value: Vec3) -> Option<LightSample> {
    let (se, ce) = elevation.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    let direction = Vec3::new(ca * ce, sa * ce, se);
    let cosine = receiver_cosine(at, direction);
    (cosine > 0.0).then(|| LightSample {
        value: value * cosine,
        target: Target::Sky(direction),
    })
}

fn sample_sun(light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let [x, y] = if soft { disc(u) } else { [0.0; 2] };
    let [azimuth, elevation, radius] = light.p1;
    sky_sample(
        at,
        azimuth + x * radius,
        elevation + y * radius,
        Vec3::from(light.radiance),
    )
}

/// Uniform in azimuth and elevation, as the compiler spreads its suns; the density of directions is 1/(π² cos elevation).
fn sample_dome(light: &Light, at: &SurfaceHit, u: [f32; 2]) -> Option<LightSample> {
    sky_sample(at, TAU * u[0], FRAC_PI_2 * u[1], Vec3::from(light.radiance))
}
