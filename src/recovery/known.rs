//! Light that the map's files explain: irradiance at luxels of each emissive shader, sun, dome and of the light entities.
//!
//! Every term has its own scale in the fit, because what stands in today's scripts is not always what a map was lit with.
//! Irradiances are E/π in luxel units.

use super::emitter::{Emitter, direct, emitters, splash};
use super::luxels::Luxel;
use super::random::Random;
use super::visibility::Occluders;
use crate::reference::light_sample::{Target, sample_light};
use crate::reference::surface::SurfaceHit;
use crate::scene::Scene;
use crate::scene::lights::LightSource;
use crate::scene::records::{LIGHT_TRIANGLE, NONE};
use crate::scene::sampling::triangle;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// What a term stands for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TermKind {
    /// Emissive surfaces of a material.
    Surface(u32),
    /// Emissive sprites.
    Sprites,
    /// Light entities.
    Entities,
    /// A sun, by its number among the scene's lights.
    Sun(u32),
    /// A sky dome, by its number among the scene's lights.
    Dome(u32),
}

/// Irradiance of one known term at each receiver.
#[derive(Clone, Debug)]
pub struct Term {
    pub kind: TermKind,
    /// As it is called in lights files: the shader, or `sun 1` and the like.
    pub name: String,
    pub values: Vec<Vec3>,
}

/// Rays per receiver that all surface terms share, and the least a term gets.
const SURFACE_RAYS: f32 = 48.0;
const LEAST_RAYS: usize = 4;
/// Rays to a sun's disc.
const SUN_RAYS: u32 = 4;
/// Directions towards a dome.
const DOME_RAYS: u32 = 32;

/// Collects the terms of a scene; light entities are left out where they are `hidden`, and pieces of area lights end where
/// they give a byte if the compiler was `fast`.
pub fn terms(occluders: &Occluders, receivers: &[Luxel], hidden: bool, fast: bool, seed: u32) -> Vec<Term> {
    let scene = occluders.scene;
    let (kinds, of_light) = kinds(scene, hidden);
    let radiance: Vec<Vec3> = kinds.iter().map(|k| term_radiance(scene, k)).collect();
    let emitters: Vec<Vec<Emitter>> = scene
        .lights
        .lights
        .iter()
        .zip(&of_light)
        .map(|(light, &term)| {
            if light.kind == LIGHT_TRIANGLE && term != NONE {
                emitters(scene, light, term, fast)
            } else {
                Vec::new()
            }
        })
        .collect();
    let rows: Vec<Vec<Vec3>> = receivers
        .par_iter()
        .enumerate()
        .map(|(i, luxel)| {
            let mut random = Random::new(seed, 0x4b4e, i as u32);
            let mut values = surfaces(occluders, &emitters, &radiance, luxel, &mut random);
            others(occluders, &of_light, luxel, &mut values, &mut random);
            values
        })
        .collect();
    kinds
        .into_iter()
        .enumerate()
        .map(|(k, kind)| Term {
            name: name(scene, &kind),
            kind,
            values: rows.iter().map(|r| r[k]).collect(),
        })
        .collect()
}

/// The terms in order, and the term of each light.
fn kinds(scene: &Scene, hidden: bool) -> (Vec<TermKind>, Vec<u32>) {
    let lights = &scene.lights;
    let kind_of = |i: usize| match lights.sources[i] {
        LightSource::EmissiveTriangle | LightSource::SkyTriangle => Some(TermKind::Surface(lights.lights[i].material)),
        LightSource::EmissiveSprite => Some(TermKind::Sprites),
        LightSource::PointEntity | LightSource::SpotEntity => (!hidden).then_some(TermKind::Entities),
        LightSource::Sun => Some(TermKind::Sun(i as u32)),
        LightSource::SkyDome => Some(TermKind::Dome(i as u32)),
        // Lights that were recovered before are what is looked for.
        LightSource::Recovered => None,
    };
    let mut number: BTreeMap<TermKind, u32> = (0..lights.lights.len()).filter_map(kind_of).map(|k| (k, 0)).collect();
    number.values_mut().zip(0..).for_each(|(n, i)| *n = i);
    let of_light = (0..lights.lights.len())
        .map(|i| kind_of(i).map_or(NONE, |k| number[&k]))
        .collect();
    (number.into_keys().collect(), of_light)
}

fn name(scene: &Scene, kind: &TermKind) -> String {
    match kind {
        TermKind::Surface(material) => scene.material_sources[*material as usize].name.clone(),
        TermKind::Sprites => "sprites".to_owned(),
        TermKind::Entities => "entities".to_owned(),
        TermKind::Sun(light) => format!("sun {light}"),
        TermKind::Dome(light) => format!("dome {light}"),
    }
}

fn term_radiance(scene: &Scene, kind: &TermKind) -> Vec3 {
    match kind {
        TermKind::Surface(material) => scene.material_sources[*material as usize]
            .emission()
            .map_or(Vec3::ZERO, |e| e.radiance),
        _ => Vec3::ONE,
    }
}

/// The value of every surface term: exact without occluders, times the share of rays that arrive.
fn surfaces(
    occluders: &Occluders,
    emitters: &[Vec<Emitter>],
    radiance: &[Vec3],
    luxel: &Luxel,
    random: &mut Random,
) -> Vec<Vec3> {
    let scene = occluders.scene;
    let mut values = vec![Vec3::ZERO; radiance.len()];
    let mut parts: Vec<(&Emitter, bool, f32)> = Vec::new();
    let mut totals = vec![0.0f32; radiance.len()];
    for l in scene.rows.pvs.lights(luxel.cluster) {
        for e in &emitters[l as usize] {
            for (splashed, value) in [(false, direct(e, luxel)), (true, splash(e, luxel))] {
                if value > 0.0 {
                    parts.push((e, splashed, value));
                    totals[e.term as usize] += value;
                }
            }
        }
    }
    let strength = |k: usize| totals[k] * radiance[k].max_element();
    let all: f32 = (0..totals.len()).map(strength).sum();
    for k in 0..totals.len() {
        if totals[k] <= 0.0 || strength(k) <= 0.0 {
            continue;
        }
        let n = LEAST_RAYS + (SURFACE_RAYS * strength(k) / all) as usize;
        let step = totals[k] / n as f32;
        let mut next = random.unit() * step;
        let (mut sum, mut seen, mut cast) = (0.0, 0, 0);
        for &(e, splashed, value) in &parts {
            if e.term as usize != k {
                continue;
            }
            sum += value;
            while sum > next {
                next += step;
                cast += 1;
                let target = if splashed {
                    Some(e.splash.0)
                } else {
                    point_on(e, luxel, random)
                };
                if let Some(p) = target {
                    let place = spread(occluders, luxel, random);
                    seen += usize::from(occluders.sees(place.origin(p - place.position), p));
                }
            }
        }
        if cast > 0 {
            values[k] = radiance[k] * (totals[k] * seen as f32 / cast as f32);
        }
    }
    values
}

/// A luxel's place for one ray: at random as `-filter` spreads light (1 2 1 is a triangle of half width 1), if it does.
fn spread(occluders: &Occluders, luxel: &Luxel, random: &mut Random) -> Luxel {
    if !occluders.filtered {
        return *luxel;
    }
    let triangle = |random: &mut Random| random.unit() - random.unit();
    let place = luxel.moved(triangle(random), triangle(random));
    if occluders.open(&place) { place } else { *luxel }
}

/// A point just before an emitter, on its side of the receiver's horizon.
fn point_on(e: &Emitter, luxel: &Luxel, random: &mut Random) -> Option<Vec3> {
    const TRIES: usize = 4;
    let side = if e.normal.dot(luxel.position - e.centre) < 0.0 {
        -1.0
    } else {
        1.0
    };
    (0..TRIES).find_map(|_| {
        let [b1, b2] = triangle([random.unit(), random.unit()]);
        let p = e.corners[0] + (e.corners[1] - e.corners[0]) * b1 + (e.corners[2] - e.corners[0]) * b2;
        (luxel.two_sided || luxel.normal.dot(p - luxel.position) > 0.0).then(|| p + e.normal * side)
    })
}

/// Sprites, entities, suns and domes.
fn others(occluders: &Occluders, of_light: &[u32], luxel: &Luxel, values: &mut [Vec3], random: &mut Random) {
    let scene = occluders.scene;
    let sides = if luxel.two_sided { 2 } else { 1 };
    for side in 0..sides {
        let normal = if side == 0 { luxel.normal } else { -luxel.normal };
        let at = receiver(luxel, normal);
        let offset = normal * super::luxels::SAMPLE_OFFSET;
        for l in scene.rows.pvs.lights(luxel.cluster) {
            let term = of_light[l as usize];
            let light = &scene.lights.lights[l as usize];
            let rays = match scene.lights.sources[l as usize] {
                LightSource::EmissiveTriangle | LightSource::SkyTriangle => continue,
                LightSource::Sun => SUN_RAYS,
                LightSource::SkyDome => DOME_RAYS,
                _ if occluders.filtered => SUN_RAYS,
                _ => 1,
            };
            if term == NONE {
                continue;
            }
            let turn = random.unit();
            for i in 0..rays {
                // A rank-1 lattice, moved at random.
                let u = [(i as f32 + 0.5) / rays as f32, (i as f32 * 0.618_034 + turn).fract()];
                let Some(sample) = sample_light(scene, light, &at, u, rays > 1) else {
                    continue;
                };
                let origin = spread(occluders, luxel, random).position + offset;
                let seen = match sample.target {
                    Target::Point(p) => occluders.sees(origin, p),
                    Target::Sky(direction) => occluders.sees_sky(origin, direction),
                };
                if seen {
                    values[term as usize] += sample.value / rays as f32;
                }
            }
        }
    }
}

/// A luxel in the form that the light samplers take.
fn receiver(luxel: &Luxel, normal: Vec3) -> SurfaceHit {
    SurfaceHit {
        position: luxel.position,
        geometric_normal: normal,
        shading_normal: normal,
        uv: Vec2::ZERO,
        albedo: Vec3::ONE,
        material: 0,
        triangle: NONE,
        front: true,
        cluster: luxel.cluster,
        row: luxel.cluster,
    }
}
