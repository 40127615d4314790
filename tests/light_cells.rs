//! What light cells choose by is near enough to what lights give: the second moment of the estimate that takes one light by
//! them is compared with the least that any choice of one light can have.
//!
//! `cargo test --release --test light_cells -- --ignored --nocapture` prints it for ten views, and what cells take to make.

mod common;

use common::installed;
use glam::Vec3;
use q3rays::reference::light_cells;
use q3rays::reference::light_choice::LobeChances;
use q3rays::reference::light_sample::{PointSampling, sample_light};
use q3rays::reference::renderer::CpuRenderer;
use q3rays::reference::surface::{SurfaceHit, classify, offset_point};
use q3rays::reference::trace::Tracer;
use q3rays::reference::visibility::visible;
use q3rays::render::settings::Settings;
use q3rays::scene::light_cells::place;
use q3rays::scene::light_power::luminance;
use q3rays::scene::records::NONE;
use q3rays::scene::sampling::{key, unit};
use q3rays::scene::{Scene, spawns};
use rayon::prelude::*;
use std::time::Instant;

const SIZE: (u32, u32) = (64, 36);
/// Points that are looked at on each light from each pixel.
const POINTS: u32 = 4;

fn scene_and_seconds(map: &str) -> (Scene, f64) {
    let mut scene = Scene::load(&installed().focused_on(map), map).expect("an installed map");
    let begun = Instant::now();
    light_cells::fill(&mut scene);
    (scene, begun.elapsed().as_secs_f64())
}

/// Second moments over the squared mean of a view's irradiance.
struct Moments {
    /// With one light taken by the cells.
    cells: f64,
    /// With one light taken in proportion to the root of its own second moment, which is the least.
    least: f64,
}

fn moments(scene: &Scene, spawn: usize) -> Moments {
    let settings = Settings::default();
    let camera = spawns::view(&scene.spawns[spawn], 90.0);
    let aovs = CpuRenderer::new(scene).aovs(&camera, SIZE, &settings);
    let tracer = Tracer::new(scene);
    let lists = &scene.rows.pvs;
    let pixel = |i: usize| -> Option<[f64; 3]> {
        let (position, normal) = (Vec3::from(aovs.position[i]), Vec3::from(aovs.geo_normal[i]));
        let (_, row) = (normal != Vec3::ZERO).then(|| classify(scene, position, normal, NONE))?;
        let at = SurfaceHit::receiver(position, normal, row);
        if row == NONE || scene.cells.find(row, place(position, normal)).entries.is_empty() {
            return None;
        }
        let chances = LobeChances::new(scene, &settings, lists, row, place(position, normal));
        let (mut mean, mut second, mut roots) = (0.0, 0.0, 0.0);
        for light in lists.lights(row) {
            let (mut first, mut square) = (0.0, 0.0);
            for k in 0..POINTS {
                let random = |d| unit(key(i as u32, light.wrapping_mul(17).wrapping_add(k), d));
                let record = &scene.lights.lights[light as usize];
                let sampling = PointSampling::SolidAngle;
                let Some(sample) = sample_light(scene, record, &at, [random(1), random(2)], sampling) else {
                    continue;
                };
                if luminance(sample.value.into()) > 0.0 {
                    let share = visible(scene, &tracer, offset_point(position, normal), &sample);
                    let value = f64::from(luminance((sample.value * share).into()));
                    first += value / f64::from(POINTS);
                    square += value * value / f64::from(POINTS);
                }
            }
            if square > 0.0 {
                mean += first;
                roots += square.sqrt();
                let chance = f64::from(chances.chance(light));
                assert!(chance > 0.0, "light {light} lights pixel {i} and is never chosen there");
                second += square / chance;
            }
        }
        Some([mean, second, roots * roots])
    };
    let pixels: Vec<[f64; 3]> = (0..(SIZE.0 * SIZE.1) as usize)
        .into_par_iter()
        .filter_map(pixel)
        .collect();
    let [mean, second, least] = [0, 1, 2].map(|k| pixels.iter().map(|p| p[k]).sum::<f64>() / pixels.len() as f64);
    Moments {
        cells: second / (mean * mean),
        least: least / (mean * mean),
    }
}

/// Views of few and of many lights; in two of them cells that went by power, or by light without shadows, had second moments
/// a thousand times the least.
#[test]
fn cells_know_what_lights_a_view() {
    for (map, spawn) in [("oa_dm1", 0), ("kaos", 1), ("am_galmevish2", 1)] {
        let (scene, _) = scene_and_seconds(map);
        let m = moments(&scene, spawn);
        println!("{map}, {spawn}: {:.1}, least {:.1}", m.cells, m.least);
        assert!(m.cells < 25.0 * m.least, "{map}, {spawn}: {} over {}", m.cells, m.least);
    }
}

#[test]
#[ignore = "a table for the docs"]
fn table() {
    println!("| map, spawn | second moment | least | seconds | cells | entries |\n|---|---:|---:|---:|---:|---:|");
    let views = [
        ("oa_dm1", 0),
        ("am_galmevish2", 1),
        ("ctf_compromise", 0),
        ("oa_minia", 1),
        ("kaos", 1),
        ("oa_dm4", 1),
        ("wrackdm17", 1),
        ("slimefac", 0),
        ("am_thornish", 0),
        ("oacmpctf3", 0),
    ];
    for (map, spawn) in views {
        let (scene, seconds) = scene_and_seconds(map);
        let m = moments(&scene, spawn);
        println!(
            "| {map}, {spawn} | {:.1} | {:.1} | {seconds:.1} | {} | {} |",
            m.cells,
            m.least,
            scene.cells.count(),
            scene.cells.entries.len()
        );
    }
}
