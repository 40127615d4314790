//! From the eye through layers to the surface that is shaded. Counterpart of `shaders/include/layers.glsl`.
//!
//! Layers are met one after another, the next nearest each time, so their order is exact for any number of them; they are
//! composed in linear light (thesis, sections 6.3 and 6.4). A lit layer would want light of its own: one that lies on an opaque
//! surface shares that surface's, and of others and what is behind them one is chosen at random in proportion to what each
//! can contribute.

use super::direct::SampleAddress;
use super::portal::go_through;
use super::primary::CameraRay;
use super::surface::{SurfaceHit, drawn, emission_seen, surface_at};
use super::trace::{Hit, Tracer};
use super::visibility::ON_RECEIVER;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::light_power::luminance;
use crate::scene::records::{MATERIAL_LAYER, MATERIAL_PORTAL};
use crate::scene::sampling::{DIM_LAYER, bits2, key, unit};
use glam::Vec3;

const FAR: f64 = f32::MAX as f64;
/// Surfaces that a ray goes through at most; what is behind is too faint to matter long before.
pub const MOST_LAYERS: u32 = 1024;
/// A ray of which less than this share goes on ends.
const LEAST_SHARE: f32 = 1e-5;

/// What a camera ray comes to.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The surface to be shaded, and the hit.
    pub surface: Option<(SurfaceHit, Hit)>,
    /// Share of its light that comes through the layers.
    pub share: Vec3,
    /// Radiance that it emits, before the layers.
    pub emission: Vec3,
    /// Radiance of the layers.
    pub layers: Vec3,
}

/// A lit layer that may be what is shaded.
#[derive(Clone, Copy)]
struct Pending {
    surface: SurfaceHit,
    hit: Hit,
    /// Share of light from before it that comes through layers.
    share: Vec3,
    /// What fog leaves of that.
    fog: f32,
}

/// Follows a camera ray. `cone`: width of the ray's cone at distance 1.
pub fn see(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    ray: CameraRay,
    cone: f32,
    address: SampleAddress,
) -> Seen {
    let mut out = Seen {
        surface: None,
        share: Vec3::ONE,
        emission: Vec3::ZERO,
        layers: Vec3::ZERO,
    };
    let mut ray = ray;
    // Way of the legs before, units, and the mirrors and portals gone through.
    let mut travelled = 0.0;
    let mut depth = 0;
    let mut pending: Option<Pending> = None;
    let mut after = None;
    let mut dimension = DIM_LAYER;
    // Fog on the way to the last surface, and what it leaves.
    let mut fog = (Vec3::ZERO, 1.0);
    for _ in 0..MOST_LAYERS {
        let hit = tracer.next(scene, ray.origin, ray.direction, FAR, after);
        let Some(hit) = hit.filter(|_| out.share.max_element() > LEAST_SHARE) else {
            // Nothing behind: the layer takes all.
            if let Some(p) = pending {
                out.surface = Some((p.surface, p.hit));
                out.share = p.share * p.fog;
            }
            return out;
        };
        after = Some(hit);
        let material = &scene.materials[scene.geometry.triangles[hit.triangle as usize].material as usize];
        let wide = cone * (1.0 + travelled / hit.t as f32);
        let surface = surface_at(scene, tracer, &hit, ray.direction, wide);
        if !drawn(material, surface.front) {
            continue;
        }
        let layer = material.flags & MATERIAL_LAYER != 0;
        let there = scene.fogs.at(ray.origin, ray.direction, hit.t as f32);
        out.layers += out.share * (there.0 - fog.0);
        fog = there;
        if let Some(p) = pending {
            if !layer && (hit.t - p.hit.t) as f32 <= ON_RECEIVER {
                out.surface = Some((folded(&p.surface, &surface), hit));
                out.share = p.share * fog.1;
                out.emission =
                    p.surface.through * emission_seen(scene, &surface, ray.direction, settings.shown_emission);
                return out;
            }
            let own = luminance((p.share * p.surface.albedo).into());
            let rest = luminance(out.share.into());
            let chance = own / (own + rest).max(f32::MIN_POSITIVE);
            let [bits, _] = bits2(
                settings.sequence,
                key(settings.seed, address.pixel, dimension),
                address.index,
            );
            dimension += 1;
            if settings.choose_layers && unit(bits) < chance {
                out.surface = Some((p.surface, p.hit));
                out.share = p.share * p.fog / chance;
                return out;
            }
            if settings.choose_layers {
                out.share /= 1.0 - chance;
            }
            pending = None;
        }
        let emission = emission_seen(scene, &surface, ray.direction, settings.shown_emission);
        if !layer {
            out.surface = Some((surface, hit));
            out.emission = emission;
            out.share *= fog.1;
            return out;
        }
        out.layers += out.share * emission * fog.1;
        if material.flags & MATERIAL_PORTAL != 0 {
            out.share *= surface.through * fog.1;
            depth += 1;
            if depth > settings.max_depth {
                return out;
            }
            let number = scene.geometry.triangles[hit.triangle as usize].surface;
            ray = go_through(scene, number, &surface, ray.direction);
            travelled += hit.t as f32;
            after = None;
            fog = (Vec3::ZERO, 1.0);
            continue;
        }
        if surface.albedo != Vec3::ZERO {
            pending = Some(Pending {
                surface,
                hit,
                share: out.share,
                fog: fog.1,
            });
        }
        out.share *= surface.through;
    }
    out
}

/// An opaque surface with a lit layer on it.
fn folded(layer: &SurfaceHit, surface: &SurfaceHit) -> SurfaceHit {
    SurfaceHit {
        albedo: layer.albedo + layer.through * surface.albedo,
        through: layer.through,
        ..*surface
    }
}
