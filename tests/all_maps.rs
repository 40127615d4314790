//! Every map of the installed games, at every spawn point: loads, renders, and leaves a row of numbers.
//!
//! Takes minutes, so it runs on demand: `cargo test --release --test all_maps -- --ignored --nocapture`. With
//! `Q3RAYS_UPDATE_DOCS=1` it rewrites `docs/maps.md`.

use q3rays::assets::vfs::{Install, Vfs};
use q3rays::content::embedded::EMBEDDED;
use q3rays::reference::CpuRenderer;
use q3rays::render::settings::{LightSampling, Settings};
use q3rays::scene::clock::Clock;
use q3rays::scene::lights::LightSource;
use q3rays::scene::report::Report;
use q3rays::scene::spawns::{overview, view};
use q3rays::scene::{Scene, camera::Camera};
use std::fmt::Write;
use std::time::Instant;

const SIZE: (u32, u32) = (160, 90);
const SAMPLES: u32 = 2;
const LIGHTS: u32 = 8;
/// Time of the scene.
const SECONDS: f64 = 3.3;
/// OpenArena's maps as Debian packages them.
const EXPECTED: usize = 85;
/// Below this share of its baked light in known lights a map is told to be dark for want of its light entities: see the
/// physics notes; without the bake at hand, a mean radiance this low at the spawns stands for it.
const DARK: f64 = 0.01;

#[test]
#[ignore = "minutes; see the module's documentation"]
fn every_map_renders_at_every_spawn() {
    let files = Vfs::mount(&Install::discover(None), EMBEDDED);
    let maps = files.maps();
    assert!(
        maps.len() > EXPECTED,
        "found {} maps; tests/setup.sh installs OpenArena's {EXPECTED}",
        maps.len()
    );
    let settings = Settings {
        random_lights: LIGHTS,
        light_sampling: LightSampling::Bvh,
        // Things that move have moved.
        clock: Clock::from_seconds(SECONDS),
        ..Settings::default()
    };
    let mut table = String::from(
        "| map | triangles | emissive | sky faces | point | sprite | sun | dome | clusters | in cluster at 0.25 | by leafs | \
         all lights | load ms | spawns | black | mean | remark |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut failures = Vec::new();
    for map in &maps {
        let start = Instant::now();
        let scene = match Scene::load(&files.focused_on(&map.name), &map.name) {
            Ok(scene) => scene,
            Err(e) => {
                failures.push(e.to_string());
                continue;
            }
        };
        let load = start.elapsed();
        let report = Report::new(&scene);
        let cameras: Vec<Camera> = match scene.spawns.len() {
            0 => vec![overview(&scene.bsp, 90.0)],
            _ => scene.spawns.iter().map(|s| view(s, 90.0)).collect(),
        };
        let renderer = CpuRenderer::new(&scene);
        let (mut black, mut pixels, mut sum) = (0, 0, 0.0);
        for (i, camera) in cameras.iter().enumerate() {
            let (film, _) = renderer.accumulate(camera, SIZE, &settings, 0..SAMPLES, &|_| {});
            if film.non_finite() > 0 {
                failures.push(format!(
                    "{} spawn {i}: {} pixels are not finite",
                    map.name,
                    film.non_finite()
                ));
            }
            black += film.black();
            pixels += film.mean.len();
            sum += film.mean.iter().flatten().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        }
        let count = |s| scene.lights.count(s);
        let points = count(LightSource::PointEntity) + count(LightSource::SpotEntity);
        let mean = sum / pixels as f64;
        let remark = match (mean < DARK, points == 0) {
            (true, true) => "dark: its light entities were stripped by the compiler",
            (true, false) => "dark",
            _ => "",
        };
        writeln!(
            table,
            "| {} | {} | {} | {} | {points} | {} | {} | {} | {}{} | {:.1}% | {:.2}% | {:.2}% | {} | {} | {:.1}% | {mean:.3} | {remark} |",
            map.name,
            report.triangles,
            count(LightSource::EmissiveTriangle),
            count(LightSource::SkyTriangle),
            count(LightSource::EmissiveSprite),
            count(LightSource::Sun),
            count(LightSource::SkyDome),
            report.clusters,
            if report.vised { "" } else { " (unvised)" },
            report.receivers.by_nudge[0] * 100.0,
            report.receivers.surface_leafs * 100.0,
            report.receivers.all_lights * 100.0,
            load.as_millis(),
            scene.spawns.len(),
            100.0 * black as f64 / pixels as f64,
        )
        .expect("writing to a string");
        println!("{} {:?}", map.name, start.elapsed());
    }
    assert!(failures.is_empty(), "{failures:#?}");
    if std::env::var_os("Q3RAYS_UPDATE_DOCS").is_some() {
        let head = format!(
            "# Every map\n\nMade by `Q3RAYS_UPDATE_DOCS=1 cargo test --release --test all_maps -- --ignored`: all maps found, with the lights that their files describe (`rt_lights known`), each \
             rendered at every spawn point at {}x{} on the CPU tracer with {LIGHTS} random lights (`rt_lightSampling bvh`) and {SAMPLES} samples a pixel, {SECONDS} seconds after the start. \
             *Black* is the share of pixels without any radiance (noise included), *mean* the mean radiance in luxel units, \
             *in cluster at 0.25*, *by leafs* and *all lights* say how receivers find their light list \
             ([architecture](architecture.md)). Load time is for two cores, script and image decoding included.\n\n",
            SIZE.0, SIZE.1
        );
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/maps.md"), head + &table).expect("docs/maps.md");
    }
}
