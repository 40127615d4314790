//! The player: seen in mirrors alone, with a weapon that the eye alone sees; and time within an open shutter.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::{camera, gpu_film, installed, quiet, scene};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::{Entity, Mapping, Paint};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, Settings};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Shot;
use q3rays::scene::clock::Clock;
use q3rays::scene::load::LoadOptions;
use q3rays::scene::motion::Motion;
use q3rays::scene::player::Player;

fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        ..Settings::default()
    }
}

fn load(player: Option<Player>) -> Scene {
    let files = installed().focused_on("showcase");
    let options = LoadOptions {
        player,
        ..LoadOptions::default()
    };
    Scene::load_with(&files, "showcase", &options).unwrap()
}

/// Pixels in which two films differ.
fn differing(a: &Film, b: &Film) -> usize {
    let differs = |i: &usize| (0..3).any(|c| (a.mean[*i][c] - b.mean[*i][c]).abs() > 1e-4 * b.mean[*i][c].abs() + 1e-6);
    (0..a.mean.len()).filter(differs).count()
}

#[test]
fn mirrors_show_the_body_and_the_eye_sees_the_weapon() {
    let (alone, played) = (load(None), load(Some(Player::default())));
    let bodies = played.placements.iter().filter(|p| matches!(p.motion, Motion::Body(_)));
    assert!(bodies.count() >= 4, "legs, torso, head and a weapon");
    let size = (64, 36);
    // Before the mirror, and with the back to it.
    let mirror = camera([1330.0, 737.2, 51.3], 0.0, 0.0, 60.0);
    let away = camera([1330.0, 737.2, 51.3], 0.0, 180.0, 60.0);
    with_device(|device| {
        for (view, in_mirror) in [(mirror, true), (away, false)] {
            for draw_gun in [false, true] {
                let at = Settings { draw_gun, ..settings() };
                let gpu = |scene: &Scene| {
                    let gpu = SceneGpu::new(device, scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
                    gpu_film(&gpu, &view, size, &at, 2)
                };
                let cpu = |scene: &Scene| CpuRenderer::new(scene).accumulate(&view, size, &at, 0..2, &quiet).0;
                let films = [("cpu", cpu(&alone), cpu(&played)), ("bvh", gpu(&alone), gpu(&played))];
                for (name, without, with) in &films {
                    let changed = differing(without, with);
                    match (in_mirror, draw_gun) {
                        (false, false) => assert_eq!(changed, 0, "{name}"),
                        _ => assert!(changed > 40, "{name}: {changed} pixels show the player"),
                    }
                }
                let apart = differing(&films[0].2, &films[1].2);
                assert!(apart < 64 * 36 / 100, "the CPU and the GPU differ in {apart} pixels");
            }
        }
        // Reflections do not show the weapon before the eye: the body holds one of its own.
        let count = |kind: fn(&Motion) -> bool| played.placements.iter().filter(|p| kind(&p.motion)).count();
        assert!(count(|m| matches!(m, Motion::View(_))) >= 1);
    });
}

#[test]
fn players_breathe_between_the_frames_of_their_files() {
    let played = load(Some(Player::default()));
    let body = |p: &&q3rays::scene::entity_geometry::Placement| matches!(p.motion, Motion::Body(_)) && p.steps > 1;
    let torso = played.placements.iter().rfind(body).unwrap();
    let meshes = &played.geometry.meshes;
    let at = |seconds: f64| {
        let moment = Clock::from_seconds(seconds).into();
        torso.record(meshes, &moment, &moment)
    };
    let seen: std::collections::BTreeSet<u32> = (0..200).map(|i| at(f64::from(i) * 0.02).mesh).collect();
    assert_eq!(seen.len() as u32, torso.steps);
    // Neighbouring steps are near each other: vertices lie between those of the file's frames.
    let first = |mesh: u32| {
        let m = &meshes[mesh as usize];
        let t = played.geometry.triangles[m.first_triangle as usize];
        Vec3::from(played.geometry.positions[t.vertices[0] as usize])
    };
    for pair in seen.iter().collect::<Vec<_>>().windows(2) {
        assert!(first(*pair[0]).distance(first(*pair[1])) < 2.0);
    }
}

/// What is averaged over an open shutter is the mean over its time, of what moves and of a moving eye.
#[test]
fn an_open_shutter_averages_over_its_time() {
    let script = "textures/fixture/flag\n{\n\tcull none\n\tdeformVertexes move 0 40 0 sawtooth 0 1 0 1\n\t{\n\t\tmap \
                  textures/fixture/grey128\n\t\trgbGen vertex\n\t}\n}\n";
    let fixture = boxed("shutter", script, |map, _| {
        let flag = Paint {
            shader: map.shader("textures/fixture/flag", 0, 0),
            mapping: Mapping::Fit,
        };
        let at = |y: f32, z: f32| Vec3::new(180.0, y, z);
        map.quad(
            [at(90.0, 40.0), at(90.0, 200.0), at(120.0, 200.0), at(120.0, 40.0)],
            flag,
        );
        map.entity(Entity::light(Vec3::new(60.0, 128.0, 200.0), 300.0, [1.0; 3]));
    });
    let scene = scene(&fixture);
    let size = (48, 12);
    let open = camera([30.0, 128.3, 120.7], 0.0, 0.0, 70.0);
    let mut close = open;
    close.eye[1] += 10.0;
    let shot = Shot { open, close };
    let at = Settings {
        shutter: 0.5,
        clock: Clock::from_seconds(3.0),
        random_lights: 0,
        soft_shadows: false,
        ..settings()
    };
    let n = 256;
    let cpu = CpuRenderer::new(&scene);
    let (blurred, _) = cpu.accumulate(shot, size, &at, 0..n, &quiet);
    let mut want = Film::new(size.0, size.1);
    for i in 0..n {
        let share = (i as f32 + 0.5) / n as f32;
        let now = Settings {
            shutter: 0.0,
            clock: at.clock.after(f64::from(0.5 * share)),
            seed: 7,
            ..at
        };
        let (one, _) = cpu.accumulate(&shot.at(share), size, &now, i..i + 1, &quiet);
        want.merge(&one).unwrap();
    }
    let peak = want.mean.iter().map(|p| p[1]).fold(0.0, f32::max);
    for (a, b) in blurred.mean.iter().zip(&want.mean) {
        assert!((a[1] - b[1]).abs() < 0.04 * peak, "{a:?} is not {b:?}");
    }
    let (sharp, _) = cpu.accumulate(&open, size, &Settings { shutter: 0.0, ..at }, 0..n, &quiet);
    assert!(differing(&blurred, &sharp) > 20);
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = q3rays::render::gpu_renderer::GpuRenderer::new(&gpu).unwrap();
        let (film, _) = renderer.accumulate(shot, size, &at, 0..n, &quiet).unwrap();
        assert!(differing(&film, &blurred) < 6, "{}", differing(&film, &blurred));
    });
}
