//! Ways that a path may go: what a surface reflects by itself, and where it goes on. Counterpart of
//! `shaders/include/branches.glsl`.

use super::direct::{SampleAddress, light_row};
use super::light_choice::LobeChances;
use super::primary::CameraRay;
use super::surface::{SurfaceHit, emission_seen, emitted, offset_point};
use super::trace::{Hit, Tracer};
use crate::render::settings::{Secondary, Settings, ShownEmission};
use crate::scene::Scene;
use crate::scene::light_cells::place;
use crate::scene::light_power::luminance;
use crate::scene::lights::LightTable;
use crate::scene::optics::{self, Lobe};
use crate::scene::records::{
    Light, MATERIAL_DIELECTRIC, MATERIAL_PANE, MATERIAL_SKY, MATERIAL_SKY_BOX, MATERIAL_STAGES,
    MATERIAL_TWO_SIDED_EMISSION, Material,
};
use crate::scene::sampling::{DIM_LOBE, key, pcg, sample2};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A share of reflected light less than this is not followed.
pub const LEAST_BRANCH: f32 = 1.0 / 1024.0;
/// Branches that one eye ray has at most; at further interfaces one way is chosen at random.
pub const MOST_BRANCHES: u32 = 64;

/// A path on its way from the eye or from a surface.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    pub ray: CameraRay,
    /// Share of the light that it meets which reaches the eye.
    pub share: Vec3,
    /// Way from the eye to its start, units.
    pub travelled: f32,
    /// Mirrors, portals and interfaces on that way.
    pub depth: u32,
    pub address: SampleAddress,
    /// Of a path that was chosen by a lobe.
    pub lobe: Option<LobeStart>,
}

/// How a lobe chose a direction.
#[derive(Clone, Copy, Debug)]
pub struct LobeStart {
    /// Solid angle; 0 where the lobe's surface takes no light samples.
    pub pdf: f32,
    /// Light row of its surface.
    pub row: u32,
    /// Place of its surface among light cells.
    pub place: u32,
}

impl Path {
    /// An eye ray.
    pub fn from_eye(ray: CameraRay, address: SampleAddress) -> Self {
        Self {
            ray,
            share: Vec3::ONE,
            travelled: 0.0,
            depth: 0,
            address,
            lobe: None,
        }
    }

    /// Address of a path that branches off this one as its `n`-th.
    pub fn branch_address(&self, n: u32) -> SampleAddress {
        SampleAddress {
            pixel: pcg(self.address.pixel.wrapping_add(0x9e37_79b9u32.wrapping_mul(n + 1))),
            index: self.address.index,
        }
    }
}

/// How a surface reflects, apart from its albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflection {
    None,
    /// As a mirror.
    Smooth,
    /// In a GGX lobe.
    Glossy,
}

/// Splits what a surface does with light into what it reflects, `specular`, and the rest, which shrinks by that.
pub fn split(material: &Material, s: &mut SurfaceHit, direction: Vec3, share: Vec3) -> Reflection {
    let cosine = -s.shading_normal.dot(direction);
    let (kind, reflected) = if material.flags & MATERIAL_DIELECTRIC != 0 {
        let f = if material.flags & MATERIAL_PANE != 0 {
            optics::fresnel_pane(cosine, material.ior)
        } else {
            optics::fresnel(cosine, if s.front { material.ior.recip() } else { material.ior })
        };
        (Reflection::Smooth, Vec3::splat(f))
    } else if s.specular != Vec3::ZERO {
        (Reflection::Glossy, optics::schlick(s.specular, cosine))
    } else {
        return Reflection::None;
    };
    if luminance((share * reflected).into()) < LEAST_BRANCH {
        s.specular = Vec3::ZERO;
        return Reflection::None;
    }
    s.specular = reflected;
    let rest = Vec3::ONE - reflected;
    s.albedo *= rest;
    s.glow *= rest;
    s.through *= rest;
    kind
}

/// A lobe that is not followed scatters like the rest of its surface.
pub fn unsplit(s: &mut SurfaceHit) {
    s.albedo = (s.albedo + s.specular).min(Vec3::ONE);
    s.specular = Vec3::ZERO;
}

/// The lobe of a glossy surface.
pub fn lobe_of(material: &Material, s: &SurfaceHit, direction: Vec3) -> Lobe {
    Lobe {
        normal: s.shading_normal,
        view: -direction,
        alpha: material.lobe,
    }
}

/// The ray that a smooth surface reflects.
pub fn mirrored(s: &SurfaceHit, direction: Vec3) -> CameraRay {
    let mut out = optics::reflected(direction, s.shading_normal);
    if out.dot(s.geometric_normal) <= 0.0 {
        out = optics::reflected(direction, s.geometric_normal);
    }
    CameraRay {
        origin: offset_point(s.position, s.geometric_normal),
        direction: out.normalize(),
    }
}

/// The ray that goes on behind an interface; `None` where nothing gets through, or nothing bends.
pub fn bent(material: &Material, s: &SurfaceHit, direction: Vec3) -> Option<CameraRay> {
    if material.flags & (MATERIAL_DIELECTRIC | MATERIAL_PANE) != MATERIAL_DIELECTRIC {
        return None;
    }
    let eta = if s.front { material.ior.recip() } else { material.ior };
    let behind = |d: &Vec3| d.dot(s.geometric_normal) < 0.0;
    let out = optics::refracted(direction, s.shading_normal, eta)
        .filter(behind)
        .or_else(|| optics::refracted(direction, s.geometric_normal, eta).filter(behind))?;
    Some(CameraRay {
        origin: offset_point(s.position, -s.geometric_normal),
        direction: out,
    })
}

/// A path in a direction that a surface's lobe chose, and what of it is reflected in `share`. `sampled`: the surface takes
/// light samples as well.
#[allow(clippy::too_many_arguments, reason = "all that a path is made of")]
pub fn lobe_path(
    settings: &Settings,
    from: &Path,
    material: &Material,
    s: &SurfaceHit,
    direction: Vec3,
    n: u32,
    share: Vec3,
    distance: f32,
    sampled: bool,
) -> Option<Path> {
    let lobe = lobe_of(material, s, direction);
    let u = sample2(
        settings.sequence,
        key(settings.seed, from.address.pixel, DIM_LOBE + n),
        from.address.index,
    );
    let (out, weight) = lobe.sample(Vec2::from(u))?;
    if out.dot(s.geometric_normal) <= 0.0 {
        return None;
    }
    Some(Path {
        ray: CameraRay {
            origin: offset_point(s.position, s.geometric_normal),
            direction: out,
        },
        share: share * s.specular * weight,
        travelled: distance,
        depth: from.depth + 1,
        address: from.branch_address(n),
        lobe: Some(LobeStart {
            pdf: if sampled { lobe.pdf(out) } else { 0.0 },
            row: s.row,
            place: place(s.position, s.geometric_normal),
        }),
    })
}

/// Radiance that a path gets from a surface by itself. A lobe finds a light in two ways, each weighted by the balance heuristic
/// (Veach 1997, section 9.2). Lights are as bright in a lobe as they are to the eye: the lobe shows their image.
pub fn emission_met(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    lobe: Option<LobeStart>,
    s: &SurfaceHit,
    hit: &Hit,
    direction: Vec3,
) -> Vec3 {
    let mut seen = emission_seen(scene, s, direction, settings.shown_emission);
    let sky = scene.materials[s.material as usize].flags & MATERIAL_SKY != 0;
    // Light samples of a lobe have found the suns.
    if settings.draw_sun && lobe.is_none_or(|l| l.pdf <= 0.0) && sky {
        seen += suns_seen(&scene.lights, direction, settings.shown_emission);
    }
    let Some((start, number)) = lobe.zip(tracer.light_of(hit.triangle)) else {
        return seen;
    };
    let material = &scene.materials[s.material as usize];
    let sky = material.flags & MATERIAL_SKY != 0;
    if !s.front && !sky && material.flags & MATERIAL_TWO_SIDED_EMISSION == 0 {
        return seen;
    }
    let glow = if sky { Vec3::ZERO } else { s.glow };
    let light = &scene.lights.lights[number as usize];
    let radiance = match settings.shown_emission {
        ShownEmission::Game => seen - glow,
        ShownEmission::Radiance => emitted(scene, material, s.uv, s.position, direction, s.clock) * light.scale,
    };
    let cosine = -s.geometric_normal.dot(direction);
    let mut weight = 1.0;
    if start.pdf > 0.0 && settings.soft_shadows && cosine > 0.0 {
        let (lists, row) = light_row(scene, settings, start.row);
        let chance = LobeChances::new(scene, settings, lists, row, start.place).chance(number);
        let t = hit.t as f32;
        let other = chance * t * t / (cosine * light.size);
        weight = start.pdf / (start.pdf + other);
    }
    glow + radiance * weight
}

/// Greatest radiance of a sun's disc where emission is shown as in the game: that of a lamp without a picture.
const SHOWN_SUN: f32 = 4.0 * 64.0 / 255.0;

/// Radiance of the suns' discs in a direction. Their light is spread evenly over a disc in azimuth and elevation, as it is sampled.
fn suns_seen(lights: &LightTable, direction: Vec3, shown: ShownEmission) -> Vec3 {
    let azimuth = direction.y.atan2(direction.x);
    let elevation = direction.z.clamp(-1.0, 1.0).asin();
    let disc = |sun: &Light| {
        let [a, e, radius] = sun.p1;
        let across = azimuth - a;
        let across = across - TAU * (across / TAU).round();
        let r2 = radius * radius;
        if across * across + (elevation - e) * (elevation - e) > r2 {
            return Vec3::ZERO;
        }
        let radiance = Vec3::from(sun.radiance) / (r2 * elevation.cos().max(1e-4));
        match shown {
            ShownEmission::Game => radiance * (SHOWN_SUN / radiance.max_element().max(f32::MIN_POSITIVE)).min(1.0),
            ShownEmission::Radiance => radiance,
        }
    };
    lights.lights[lights.tree.finite as usize..].iter().map(disc).sum()
}

/// What a light of a material is to the eye over what it lights with.
pub fn shown_over_lit(material: &Material, shown: ShownEmission) -> Vec3 {
    if shown == ShownEmission::Radiance {
        return Vec3::ONE;
    }
    let pictured = material.flags & MATERIAL_SKY != 0 && material.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES) != 0;
    let lit = Vec3::from(if pictured {
        material.sky_scale
    } else {
        material.emission
    });
    let ratio = |i: usize| if lit[i] > 0.0 { material.shown[i] / lit[i] } else { 0.0 };
    Vec3::new(ratio(0), ratio(1), ratio(2))
}

/// Whether both ways are followed at the `n`-th interface of an eye ray.
pub fn follows_both(settings: &Settings, n: u32) -> bool {
    settings.branches() == Secondary::Both && n < MOST_BRANCHES
}
