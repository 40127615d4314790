//! Light that the map's files explain: irradiance at luxels of each emissive shader, sun, dome and of the light entities.
//!
//! Every term has its own scale in the fit, because what stands in today's scripts is not always what a map was lit with.
//! Irradiances are E/π in luxel units.

use super::luxels::Luxel;
use super::random::Random;
use super::visibility::Occluders;
use crate::reference::light_sample::{Target, sample_light};
use crate::reference::surface::SurfaceHit;
use crate::scene::Scene;
use crate::scene::lights::LightSource;
use crate::scene::records::{LIGHT_TRIANGLE, LIGHT_TWO_SIDED, Light, NONE};
use crate::scene::sampling::triangle;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f32::consts::PI;

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
/// Beyond this many times its size an emitter counts as a point.
const FAR: f32 = 5.0;
/// Backsplash: v = L·area·cos/(60·d²) for the usual 5 percent.
const BACKSPLASH: f32 = 1.0 / 60.0 / 5.0;
/// No point light is nearer than this, units.
pub const NEAREST: f32 = 16.0;

/// Least extent that emitters are cut to, units, and most pieces of one triangle.
const LEAST_PIECE: f32 = 8.0;
const MOST_PIECES: usize = 256;

struct Emitter {
    term: u32,
    corners: [Vec3; 3],
    centre: Vec3,
    normal: Vec3,
    area: f32,
    /// Square of the greatest distance of a corner from the centre.
    size2: f32,
    two_sided: bool,
    /// Where the backsplash is, and its strength relative to the radiance.
    splash: (Vec3, f32),
    /// Squares of the distances at which light and backsplash are a byte at most and `-fast` drops them.
    reach2: [f32; 2],
}

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

/// The pieces that the compiler makes of an emissive triangle: halved along its longest edge while it is too large.
fn emitters(scene: &Scene, light: &Light, term: u32, fast: bool) -> Vec<Emitter> {
    let p0 = Vec3::from(light.p0);
    let (e1, e2) = (Vec3::from(light.p1), Vec3::from(light.p2));
    let normal = e1.cross(e2).normalize_or(Vec3::Z);
    let source = &scene.material_sources[light.material as usize];
    let [percent, distance] = source.backsplash;
    let strongest = source.emission().map_or(0.0, |e| e.radiance.max_element()) * 255.0;
    let most = source.light_subdivide.max(LEAST_PIECE);
    let mut waiting = vec![[p0, p0 + e1, p0 + e2]];
    let mut out = Vec::new();
    while let Some([a, b, c]) = waiting.pop() {
        let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
        if (greatest - least).max_element() > most && out.len() + waiting.len() < MOST_PIECES {
            // The longest edge first.
            let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]]
                .into_iter()
                .max_by(|x, y| x[0].distance(x[1]).total_cmp(&y[0].distance(y[1])))
                .unwrap_or([a, b, c]);
            let middle = (a + b) * 0.5;
            waiting.push([a, middle, c]);
            waiting.push([middle, b, c]);
            continue;
        }
        let centre = (a + b + c) / 3.0;
        let area = (b - a).cross(c - a).length() * 0.5;
        out.push(Emitter {
            term,
            corners: [a, b, c],
            centre,
            normal,
            area,
            size2: [a, b, c]
                .map(|p| p.distance_squared(centre))
                .into_iter()
                .fold(0.0, f32::max),
            two_sided: light.flags & LIGHT_TWO_SIDED != 0,
            reach2: if fast {
                [strongest * area / PI, strongest * area * percent.max(0.0) * BACKSPLASH]
            } else {
                [f32::INFINITY; 2]
            },
            splash: (centre + normal * (distance + 1.0), percent.max(0.0) * BACKSPLASH * area),
        });
    }
    out
}

/// Lambert's form factor of a triangle as seen from a receiver, clipped at its horizon: E/π for radiance 1.
pub fn form_factor(position: Vec3, normal: Vec3, corners: [Vec3; 3]) -> f32 {
    let relative = corners.map(|c| c - position);
    let heights = relative.map(|r| normal.dot(r));
    let mut polygon = [Vec3::ZERO; 4];
    let mut n = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        if heights[i] > 0.0 {
            polygon[n] = relative[i];
            n += 1;
        }
        if (heights[i] > 0.0) != (heights[j] > 0.0) && n < 4 {
            polygon[n] = relative[i] + (relative[j] - relative[i]) * (heights[i] / (heights[i] - heights[j]));
            n += 1;
        }
    }
    if n < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    for i in 0..n {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let cross = a.cross(b);
        let sine = cross.length();
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) * normal.dot(cross) / sine;
        }
    }
    sum.abs() / (2.0 * PI)
}

/// Unshadowed E/π of an emitter of radiance 1.
fn direct(e: &Emitter, luxel: &Luxel) -> f32 {
    let to = e.centre - luxel.position;
    let facing = -e.normal.dot(e.corners[0] - luxel.position);
    if facing <= 0.0 && !e.two_sided {
        return 0.0;
    }
    let d2 = to.length_squared();
    if d2 > e.reach2[0] {
        return 0.0;
    }
    if d2 > FAR * FAR * e.size2 {
        let cos = luxel.cosine(to);
        return cos * (e.normal.dot(to)).abs() * e.area / (PI * d2 * d2);
    }
    let front = form_factor(luxel.position, luxel.normal, e.corners);
    if luxel.two_sided {
        front + form_factor(luxel.position, -luxel.normal, e.corners)
    } else {
        front
    }
}

/// Unshadowed E/π of an emitter's backsplash at radiance 1.
fn splash(e: &Emitter, luxel: &Luxel) -> f32 {
    let to = e.splash.0 - luxel.position;
    let d = to.length();
    if d <= 0.0 || d * d > e.reach2[1] {
        return 0.0;
    }
    e.splash.1 * luxel.cosine(to / d) / (d * d).max(NEAREST * NEAREST)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn form_factors_meet_closed_forms() {
        // A very large ceiling fills the hemisphere: E/π = L.
        let far = 1e5;
        let ceiling = [
            Vec3::new(-far, -far, 1.0),
            Vec3::new(3.0 * far, -far, 1.0),
            Vec3::new(-far, 3.0 * far, 1.0),
        ];
        assert!((form_factor(Vec3::ZERO, Vec3::Z, ceiling) - 1.0).abs() < 1e-3);
        // A wall that begins at the receiver's floor and goes on for ever covers half of it.
        let wall = [
            Vec3::new(1.0, -far, -far),
            Vec3::new(1.0, far, -far),
            Vec3::new(1.0, 0.0, far),
        ];
        assert!((form_factor(Vec3::ZERO, Vec3::Z, wall) - 0.5).abs() < 2e-2);
        // Behind the horizon there is nothing.
        let below = ceiling.map(|p| Vec3::new(p.x, p.y, -1.0));
        assert_eq!(form_factor(Vec3::ZERO, Vec3::Z, below), 0.0);
        // A small distant triangle: A·cos·cos'/(π d²).
        let small = [
            Vec3::new(30.0, 0.0, 40.0),
            Vec3::new(30.5, 0.0, 40.0),
            Vec3::new(30.0, 0.5, 40.0),
        ];
        let expected = 0.125 * 0.8 * 0.8 / (PI * 2500.0);
        assert!((form_factor(Vec3::ZERO, Vec3::Z, small) / expected - 1.0).abs() < 0.03);
    }
}
