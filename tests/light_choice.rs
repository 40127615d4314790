//! The choice of a light: probabilities are what is told, they add up, and no light that shines on a receiver is left out.

mod common;

use common::real;
use glam::Vec3;
use q3rays::reference::light_choice::Chances;
use q3rays::reference::light_sample::{PointSampling, sample_light};
use q3rays::reference::surface::{SurfaceHit, classify};
use q3rays::render::settings::{LightSampling, Settings};
use q3rays::scene::Scene;
use q3rays::scene::sampling::{key, pcg, unit};
use std::collections::{BTreeMap, BTreeSet};

const ALL: [LightSampling; 4] = [
    LightSampling::Uniform,
    LightSampling::Power,
    LightSampling::Bvh,
    LightSampling::Cells,
];

fn chances<'a>(scene: &'a Scene, light_sampling: LightSampling, at: &SurfaceHit) -> Chances<'a> {
    let settings = Settings {
        light_sampling,
        ..Settings::default()
    };
    Chances::new(scene, &[], &settings, &scene.rows.pvs, at.row, at)
}

/// Points on random surfaces of a map, as receivers.
fn receivers(scene: &Scene, count: u32) -> Vec<SurfaceHit> {
    let g = &scene.geometry;
    let world = g.meshes[0].triangle_count;
    (0..count)
        .map(|i| {
            let triangle = pcg(i ^ 0x5eed) % world;
            let [a, b, c] = g.corners(triangle);
            let (u, v) = (unit(pcg(i + 1000)) * 0.5, unit(pcg(i + 2000)) * 0.5);
            let position = a + (b - a) * u + (c - a) * v;
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
            let (_, row) = classify(scene, position, normal, g.triangles[triangle as usize].fallback_row);
            SurfaceHit::receiver(position, normal, row)
        })
        .collect()
}

#[test]
fn lights_are_chosen_as_often_as_is_told() {
    const N: u32 = 1 << 17;
    let mut compared = 0;
    for map in ["oa_dm1", "am_galmevish2", "kaos"] {
        let scene = real(map);
        for (i, at) in receivers(&scene, 6).iter().enumerate() {
            for sampling in ALL {
                let mut seen: BTreeMap<u32, (f32, u32)> = BTreeMap::new();
                let chances = chances(&scene, sampling, at);
                for n in 0..N {
                    // Stratified, so that frequencies are known better than independent numbers would tell.
                    let bits = (n << 15) | (pcg(n) >> 17);
                    let Some(c) = chances.choose(at, bits) else {
                        continue;
                    };
                    let entry = seen.entry(c.light).or_insert((c.probability, 0));
                    assert!(
                        (entry.0 / c.probability - 1.0).abs() < 1e-5,
                        "two probabilities of one light"
                    );
                    entry.1 += 1;
                }
                let mut told = 0.0;
                for (light, (probability, count)) in &seen {
                    told += f64::from(*probability);
                    let (expected, got) = (f64::from(*probability) * f64::from(N), f64::from(*count));
                    // Within five standard deviations of a binomial.
                    assert!(
                        (got - expected).abs() <= 5.0 * expected.max(1.0).sqrt() + 1.0,
                        "{map}, receiver {i}, {sampling:?}: light {light} chosen {got} times, not {expected}"
                    );
                    compared += 1;
                }
                assert!(
                    told < 1.0 + 1e-4,
                    "{map}, receiver {i}, {sampling:?}: probabilities add up to {told}"
                );
            }
        }
    }
    assert!(compared > 1000);
}

/// The sum over lights of what they give is the mean of what the chosen one gives over its probability.
#[test]
fn nothing_that_shines_is_left_out() {
    const N: u32 = 1 << 18;
    for map in ["oa_dm1", "am_galmevish2", "kaos", "oasago2"] {
        let scene = real(map);
        let mut lit = 0;
        for (i, at) in receivers(&scene, 8).iter().enumerate() {
            // Unshadowed irradiance/π by the lights' middles, so that nothing but the choice is left to chance.
            let listed: BTreeSet<u32> = scene.rows.pvs.lights(at.row).collect();
            let value = |light: u32| {
                let record = &scene.lights.lights[light as usize];
                // Cells may choose lights that the row has not; these are hidden.
                let sample = sample_light(&scene, record, at, [0.3, 0.3], PointSampling::Centre);
                let sample = sample.filter(|_| listed.contains(&light));
                sample.map_or(0.0, |s| f64::from(s.value.max_element()))
            };
            let all: f64 = listed.iter().map(|l| value(*l)).sum();
            lit += usize::from(all > 0.0);
            for sampling in ALL {
                let (mut sum, mut squares) = (0.0, 0.0);
                let chances = chances(&scene, sampling, at);
                for n in 0..N {
                    let bits = pcg(key(i as u32, n, 3));
                    let choice = chances.choose(at, bits);
                    let x = choice.map_or(0.0, |c| value(c.light) / f64::from(c.probability));
                    sum += x;
                    squares += x * x;
                }
                let n = f64::from(N);
                let error = ((squares / n - (sum / n).powi(2)).max(0.0) / n).sqrt();
                assert!(
                    (sum / n - all).abs() <= 4.5 * error + 1e-6 * all,
                    "{map}, receiver {i}, {sampling:?}: {} ± {error} of {all}",
                    sum / n
                );
            }
        }
        assert!(lit >= 4, "{map}: only {lit} receivers are lit at all");
    }
}
