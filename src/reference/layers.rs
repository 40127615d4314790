//! From the eye through layers to the surface that is shaded. Counterpart of `shaders/include/layers.glsl`.
//!
//! Layers are met one after another, the next nearest each time, so their order is exact for any number of them; they are
//! composed in linear light (thesis, sections 6.3 and 6.4). A lit layer would want light of its own: one that lies on an opaque
//! surface shares that surface's, and of others and what is behind them one is chosen at random in proportion to what each
//! can contribute.

use super::branches::{
    LEAST_BRANCH, Path, Reflection, bent, emission_met, follows_both, lobe_path, mirrored, split, unsplit,
};
use super::direct::SampleAddress;
use super::portal::go_through;
use super::surface::{SurfaceHit, drawn, surface_at};
use super::trace::{Hit, Tracer};
use super::visibility::ON_RECEIVER;
use crate::render::settings::{Secondary, Settings};
use crate::scene::Scene;
use crate::scene::light_power::luminance;
use crate::scene::records::{MATERIAL_LAYER, MATERIAL_PORTAL, MATERIAL_SKY, SEEN_BY_EYE, SEEN_BY_REFLECTIONS};
use crate::scene::sampling::{DIM_LAYER, bits2, key, unit};
use glam::Vec3;

/// Surfaces that a ray goes through at most; what is behind is too faint to matter long before.
pub const MOST_LAYERS: u32 = 1024;
/// A ray of which less than this share goes on ends.
const LEAST_SHARE: f32 = 1e-5;

/// What a path comes to.
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
    /// Direction in which it is met.
    pub direction: Vec3,
    /// Its lobe is to be lit, too.
    pub glossy: bool,
}

/// A lit layer that may be what is shaded.
#[derive(Clone, Copy)]
struct Pending {
    surface: SurfaceHit,
    hit: Hit,
    direction: Vec3,
    /// Share of light from before it that comes through layers.
    share: Vec3,
    /// What fog leaves of that.
    fog: f32,
    /// Way from the eye, units.
    distance: f32,
}

/// Ways that branched off.
#[derive(Debug, Default)]
pub struct Branches {
    /// Still to be followed.
    pub paths: Vec<Path>,
    /// All that there were.
    pub count: u32,
}

impl Branches {
    fn push(&mut self, path: Option<Path>) {
        self.count += 1;
        self.paths.extend(path);
    }
}

/// Random number 0..1 for a choice on a path.
fn chance(settings: &Settings, address: SampleAddress, dimension: u32) -> f32 {
    let [bits, _] = bits2(
        settings.sequence,
        key(settings.seed, address.pixel, dimension),
        address.index,
    );
    unit(bits)
}

/// Follows a path. `cone`: width of the eye ray's cone at distance 1.
pub fn see(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    path: &Path,
    cone: f32,
    branches: &mut Branches,
) -> Seen {
    let mut ray = path.ray;
    let mut out = Seen {
        surface: None,
        share: path.share,
        emission: Vec3::ZERO,
        layers: Vec3::ZERO,
        direction: ray.direction,
        glossy: false,
    };
    // Way of the legs before, units, and the mirrors, portals and interfaces gone through.
    let mut travelled = path.travelled;
    let mut depth = path.depth;
    let mut lobe = path.lobe;
    let mut kind = if depth > 0 { SEEN_BY_REFLECTIONS } else { SEEN_BY_EYE };
    let mut pending: Option<Pending> = None;
    let mut after = None;
    let mut dimension = DIM_LAYER;
    let mut branch = 0;
    // Fog on the way to the last surface, and what it leaves.
    let mut fog = (Vec3::ZERO, 1.0);
    for _ in 0..MOST_LAYERS {
        let hit = tracer.look(scene, ray.origin, ray.direction, after, kind);
        let Some(hit) = hit.filter(|_| out.share.max_element() > LEAST_SHARE) else {
            // Nothing behind: the layer takes all.
            if let Some(p) = pending {
                out.surface = Some((p.surface, p.hit));
                out.share = p.share * p.fog;
                out.direction = p.direction;
            }
            return out;
        };
        after = Some(hit);
        let material = &scene.materials[scene.geometry.triangles[hit.triangle as usize].material as usize];
        let distance = travelled + hit.t as f32;
        let mut surface = surface_at(scene, tracer, &hit, ray.direction, cone, travelled);
        if !drawn(material, surface.front) {
            continue;
        }
        let layer = material.flags & MATERIAL_LAYER != 0;
        if settings.white && layer {
            continue;
        }
        if settings.white && material.flags & MATERIAL_SKY == 0 {
            surface.whiten();
        }
        let follows = settings.branches() != Secondary::Off && depth < settings.max_depth;
        let reflection = if follows {
            split(material, &mut surface, ray.direction, out.share)
        } else {
            unsplit(&mut surface);
            Reflection::None
        };
        let emission = emission_met(scene, tracer, settings, lobe, &surface, &hit, ray.direction);
        let there = if settings.white {
            fog
        } else {
            scene.fogs.at(ray.origin, ray.direction, hit.t as f32)
        };
        out.layers += out.share * (there.0 - fog.0);
        fog = there;
        if let Some(p) = pending {
            if !layer && distance - p.distance <= ON_RECEIVER {
                out.surface = Some((folded(&p.surface, &surface), hit));
                out.share = p.share * fog.1;
                out.emission = p.surface.through * emission;
                out.direction = ray.direction;
                return out;
            }
            let own = luminance((p.share * p.surface.albedo).into());
            let rest = luminance(out.share.into());
            let likely = own / (own + rest).max(f32::MIN_POSITIVE);
            let u = chance(settings, path.address, dimension);
            dimension += 1;
            if settings.choose_layers && u < likely {
                out.surface = Some((p.surface, p.hit));
                out.share = p.share * p.fog / likely;
                out.direction = p.direction;
                return out;
            }
            if settings.choose_layers {
                out.share /= 1.0 - likely;
            }
            pending = None;
        }
        let share = out.share * fog.1;
        if reflection == Reflection::Glossy {
            let sampled = !layer;
            branches.push(lobe_path(
                settings,
                &Path { depth, ..*path },
                material,
                &surface,
                ray.direction,
                branch,
                share,
                distance,
                sampled,
            ));
            branch += 1;
            // A ray has no more branches than this allows, however many layers it meets.
            depth += 1;
            out.glossy = sampled;
        }
        if reflection == Reflection::Smooth {
            let rest = luminance((surface.albedo + emission + surface.through).into());
            let mut goes_back = rest <= 0.0;
            if !goes_back {
                if follows_both(settings, branches.count) {
                    branches.push(Some(Path {
                        ray: mirrored(&surface, ray.direction),
                        share: share * surface.specular,
                        travelled: distance,
                        depth: depth + 1,
                        address: path.branch_address(branch),
                        lobe: None,
                    }));
                    branch += 1;
                } else {
                    let likely = surface.specular.x.clamp(LEAST_BRANCH, 1.0 - LEAST_BRANCH);
                    goes_back = chance(settings, path.address, dimension) < likely;
                    dimension += 1;
                    out.share /= if goes_back { likely } else { 1.0 - likely };
                }
            }
            depth += 1;
            if goes_back {
                out.share *= surface.specular * fog.1;
                ray = mirrored(&surface, ray.direction);
                kind = SEEN_BY_REFLECTIONS;
                travelled = distance;
                (lobe, after, fog) = (None, None, (Vec3::ZERO, 1.0));
                continue;
            }
        }
        if !layer {
            out.surface = Some((surface, hit));
            out.emission = emission;
            out.share *= fog.1;
            out.direction = ray.direction;
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
            kind = SEEN_BY_REFLECTIONS;
            travelled = distance;
            (lobe, after, fog) = (None, None, (Vec3::ZERO, 1.0));
            continue;
        }
        if surface.albedo != Vec3::ZERO {
            pending = Some(Pending {
                surface,
                hit,
                direction: ray.direction,
                share: out.share,
                fog: fog.1,
                distance,
            });
        }
        out.share *= surface.through;
        if let Some(next) = bent(material, &surface, ray.direction).filter(|_| follows) {
            out.share *= fog.1;
            if let Some(p) = &mut pending {
                p.share *= p.fog;
                p.fog = 1.0;
            }
            ray = next;
            travelled = distance;
            (lobe, after, fog) = (None, None, (Vec3::ZERO, 1.0));
        }
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
