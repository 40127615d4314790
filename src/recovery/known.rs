//! Light that the map's files explain: irradiance at luxels of each emissive shader, sun, dome and of the light entities.
//!
//! Every term has its own scale in the fit, because what stands in today's scripts is not always what a map was lit with.
//! Irradiances are E/π in luxel units.

use super::dome::{self, Domes};
use super::emitter::{Emitter, direct, emitters, splash};
use super::luxels::{Luxel, SAMPLE_OFFSET};
use super::random::Random;
use super::visibility::Occluders;
use crate::reference::light_sample::{PointSampling, Target, sample_light};
use crate::reference::surface::SurfaceHit;
use crate::scene::Scene;
use crate::scene::lights::{LightSource, LightTable};
use crate::scene::records::{LIGHT_TRIANGLE, NONE};
use crate::scene::sampling::triangle;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// What a term stands for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TermKind {
    /// Emissive surfaces of a material.
    Surface(u32),
    /// Emissive sprites.
    Sprites,
    /// Light entities.
    Entities,
    /// A sun, by its number from the brightest on.
    Sun(u32),
    /// A sky dome, by its number.
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

/// Collects the terms of a scene; light entities are left out where they are `hidden`, and pieces of area lights end where
/// they give a byte if the compiler was `fast`.
pub fn terms(occluders: &Occluders, receivers: &[Luxel], hidden: bool, fast: bool, seed: u32) -> Vec<Term> {
    let scene = occluders.scene;
    let domes = Domes::new(&scene.lights);
    let (kinds, of_light) = kinds(scene, &domes, hidden);
    let radiance: Vec<Vec3> = kinds.iter().map(|k| term_radiance(scene, &domes, k)).collect();
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
    let others = Others::new(occluders, of_light);
    let rows: Vec<Vec<Vec3>> = receivers
        .par_iter()
        .enumerate()
        .map(|(i, luxel)| {
            let mut random = Random::new(seed, 0x4b4e, i as u32);
            let mut values = surfaces(occluders, &emitters, &radiance, luxel, &mut random);
            others.add(&radiance, luxel, &mut values, &mut random);
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
fn kinds(scene: &Scene, domes: &Domes, hidden: bool) -> (Vec<TermKind>, Vec<u32>) {
    let lights = &scene.lights;
    let suns = suns_by_brightness(lights);
    let kind_of = |i: usize| match lights.sources[i] {
        LightSource::EmissiveTriangle | LightSource::SkyTriangle => Some(TermKind::Surface(lights.lights[i].material)),
        LightSource::EmissiveSprite => Some(TermKind::Sprites),
        LightSource::PointEntity | LightSource::SpotEntity => (!hidden).then_some(TermKind::Entities),
        LightSource::Sun => suns.iter().position(|s| *s == i).map(|n| TermKind::Sun(n as u32)),
        LightSource::SkyDome => Some(TermKind::Dome(domes.of_light[i])),
        // Lights that were recovered before are what is looked for.
        LightSource::Recovered | LightSource::RecoveredSky => None,
    };
    let mut number: BTreeMap<TermKind, u32> = (0..lights.lights.len()).filter_map(kind_of).map(|k| (k, 0)).collect();
    number.values_mut().zip(0..).for_each(|(n, i)| *n = i);
    let of_light = (0..lights.lights.len())
        .map(|i| kind_of(i).map_or(NONE, |k| number[&k]))
        .collect();
    (number.into_keys().collect(), of_light)
}

/// The term of each light by the name that it has in lights files; `None` for those that were recovered.
pub fn light_terms(scene: &Scene) -> Vec<Option<String>> {
    let (kinds, of_light) = kinds(scene, &Domes::new(&scene.lights), false);
    let names: Vec<String> = kinds.iter().map(|k| in_lights_file(&name(scene, k))).collect();
    of_light.iter().map(|t| names.get(*t as usize).cloned()).collect()
}

/// A term's name as one word.
pub fn in_lights_file(name: &str) -> String {
    name.replace(char::is_whitespace, ":")
}

/// The suns among a scene's lights. Their order there means nothing: the brightest comes first, then the lowest azimuth.
fn suns_by_brightness(lights: &LightTable) -> Vec<usize> {
    let mut suns: Vec<usize> = (0..lights.lights.len())
        .filter(|&i| lights.sources[i] == LightSource::Sun)
        .collect();
    let light = |i: usize| &lights.lights[i];
    let brightness = |i: usize| light(i).radiance.iter().sum::<f32>();
    suns.sort_by(|&a, &b| {
        brightness(b)
            .total_cmp(&brightness(a))
            .then(light(a).p1[0].total_cmp(&light(b).p1[0]))
            .then(light(a).p1[1].total_cmp(&light(b).p1[1]))
    });
    suns
}

fn name(scene: &Scene, kind: &TermKind) -> String {
    match kind {
        TermKind::Surface(material) => scene.material_sources[*material as usize].name.clone(),
        TermKind::Sprites => "sprites".to_owned(),
        TermKind::Entities => "entities".to_owned(),
        TermKind::Sun(n) => format!("sun {}", n + 1),
        TermKind::Dome(n) => format!("dome {}", n + 1),
    }
}

/// What a term's irradiance at strength 1 is multiplied by.
fn term_radiance(scene: &Scene, domes: &Domes, kind: &TermKind) -> Vec3 {
    match kind {
        TermKind::Surface(material) => scene.material_sources[*material as usize]
            .emission()
            .map_or(Vec3::ZERO, |e| e.radiance),
        TermKind::Dome(n) => domes.strengths[*n as usize],
        TermKind::Sprites | TermKind::Entities | TermKind::Sun(_) => Vec3::ONE,
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
                    let place = occluders.spread(luxel, random);
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
struct Others<'a> {
    occluders: &'a Occluders<'a>,
    of_light: Vec<u32>,
    /// Lights of suns: the compiler asks no PVS for them (and some maps' outlying terrain sees nothing by theirs).
    suns: Vec<u32>,
    /// Terms of domes.
    domes: BTreeSet<u32>,
}

impl<'a> Others<'a> {
    fn new(occluders: &'a Occluders<'a>, of_light: Vec<u32>) -> Self {
        let sources = &occluders.scene.lights.sources;
        let of_source = |source: LightSource| (0..of_light.len()).filter(move |&i| sources[i] == source);
        Self {
            suns: of_source(LightSource::Sun).map(|i| i as u32).collect(),
            domes: of_source(LightSource::SkyDome).map(|i| of_light[i]).collect(),
            occluders,
            of_light,
        }
    }

    fn add(&self, radiance: &[Vec3], luxel: &Luxel, values: &mut [Vec3], random: &mut Random) {
        let scene = self.occluders.scene;
        let sides = if luxel.two_sided { 2 } else { 1 };
        for side in 0..sides {
            let normal = if side == 0 { luxel.normal } else { -luxel.normal };
            let at = receiver(luxel, normal);
            for l in scene.rows.pvs.lights(luxel.cluster) {
                let rays = match scene.lights.sources[l as usize] {
                    LightSource::EmissiveTriangle | LightSource::SkyTriangle => continue,
                    LightSource::Sun | LightSource::SkyDome => continue,
                    _ if self.occluders.filtered => SUN_RAYS,
                    _ => 1,
                };
                self.add_light(l as usize, rays, luxel, &at, values, random);
            }
            for &l in &self.suns {
                self.add_light(l as usize, SUN_RAYS, luxel, &at, values, random);
            }
        }
        if !self.domes.is_empty() {
            let through_sky = dome::irradiance(self.occluders, luxel, random);
            for &term in &self.domes {
                values[term as usize] = radiance[term as usize] * through_sky;
            }
        }
    }

    /// Adds what one light gives the side of a luxel that `at` is.
    fn add_light(
        &self,
        light: usize,
        rays: u32,
        luxel: &Luxel,
        at: &SurfaceHit,
        values: &mut [Vec3],
        random: &mut Random,
    ) {
        let scene = self.occluders.scene;
        let term = self.of_light[light];
        if term == NONE {
            return;
        }
        let offset = at.geometric_normal * SAMPLE_OFFSET;
        let turn = random.unit();
        let points = if rays > 1 {
            PointSampling::Area
        } else {
            PointSampling::Centre
        };
        for i in 0..rays {
            // A rank-1 lattice, moved at random.
            let u = [(i as f32 + 0.5) / rays as f32, (i as f32 * 0.618_034 + turn).fract()];
            let Some(sample) = sample_light(scene, &scene.lights.lights[light], at, u, points) else {
                continue;
            };
            let origin = self.occluders.spread(luxel, random).position + offset;
            let seen = match sample.target {
                Target::Point(p) => self.occluders.sees(origin, p),
                Target::Sky(direction) => self.occluders.sees_sky(origin, direction),
            };
            if seen {
                values[term as usize] += sample.value / rays as f32;
            }
        }
    }
}

/// A luxel in the form that the light samplers take.
fn receiver(luxel: &Luxel, normal: Vec3) -> SurfaceHit {
    SurfaceHit::receiver(luxel.position, normal, luxel.cluster)
}
