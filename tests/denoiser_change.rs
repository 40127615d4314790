//! How soon denoised frames follow what changes: a lamp that goes out, and something that moves out of the light.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::{camera, scene};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::{Bounds, Entity, Mapping, Paint, Solid};
use q3rays::assets::bsp::lumps::{content_flags, surface_flags};
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::{GpuRenderer, film, radiance};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, Settings};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::clock::Clock;
use q3rays::scene::entity_geometry::EntityState;
use q3rays::scene::lights::point_light;
use q3rays::scene::records::Light;

const SIZE: (u32, u32) = (160, 90);
/// Frames before the change, and most that are waited for after it.
const BEFORE: u32 = 24;
const MOST: u32 = 64;

/// A box with a lamp under its ceiling, and below that a board that `carrier` carries; `deform`: a line of its script.
fn board(deform: &str, carrier: Entity) -> Scene {
    let script = format!(
        "textures/fixture/board\n{{\n{deform}\t{{\n\t\tmap $lightmap\n\t}}\n\t{{\n\t\tmap $whiteimage\n\t\tblendFunc filter\n\t}}\n}}\n"
    );
    scene(&boxed("board", &script, |map, _| {
        let paint = Paint {
            shader: map.shader("textures/fixture/board", surface_flags::NODLIGHT, content_flags::SOLID),
            mapping: Mapping::Fit,
        };
        let solid = Solid {
            bounds: Bounds::new([-40, -40, -4], [40, 40, 4]),
            faces: [Some(paint); 6],
            contents: paint.shader,
            carves: false,
        };
        map.brush_model(vec![solid], carrier.with("origin", "140 128 150"));
        map.entity(Entity::light(Vec3::new(140.0, 128.0, 240.0), 300.0, [1.0; 3]));
        map.entity(Entity::light(Vec3::new(230.0, 20.0, 100.0), 40.0, [1.0; 3]));
    }))
}

fn settings(gradients: bool) -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        gradients,
        ..Settings::default()
    }
}

fn view() -> Camera {
    camera([16.0, 128.0, 90.0], 25.0, 0.0, 90.0)
}

/// From below: the board's lower face and nothing else in the middle of the image.
fn view_of_board(y: f32, fov: f32) -> Camera {
    camera([140.0, y, 20.0], -89.0, 0.0, fov)
}

/// What a frame shows beside the map, and from where.
#[derive(Clone, Copy)]
struct Shown<'a> {
    camera: Camera,
    lights: &'a [Light],
    entities: &'a [EntityState],
    /// The scene's time.
    clock: Clock,
}

fn input<'a>(shown: Shown<'a>, settings: &Settings, index: u32, accumulated: u32) -> FrameInput<'a> {
    FrameInput {
        camera: shown.camera,
        settings: Settings {
            clock: shown.clock,
            ..*settings
        },
        lights: shown.lights,
        polygons: &[],
        entities: shown.entities,
        sample_index: index,
        accumulated,
        exposure_blend: 1.0,
        reuse: accumulated == 0,
        output: accumulated == 0,
    }
}

fn truth(renderer: &GpuRenderer, shown: Shown<'_>) -> Vec<[f32; 3]> {
    let every = Settings {
        random_lights: 0,
        ..settings(true)
    };
    let mut view = renderer.view(SIZE).unwrap();
    for n in 0..64 {
        renderer.frame(&mut view, &input(shown, &every, n, n + 1)).unwrap();
    }
    film(&view, 64).unwrap().mean
}

/// The middle of the image.
fn middle(_: &[[f32; 3]], _: &[[f32; 3]]) -> Vec<usize> {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    (0..width * height)
        .filter(|i| (i % width).abs_diff(width / 2) < width / 4 && (i / width).abs_diff(height / 2) < height / 4)
        .collect()
}

/// Pixels of the lower half whose truth changes by more than three tenths.
fn changed(before: &[[f32; 3]], after: &[[f32; 3]]) -> Vec<usize> {
    let half = before.len() / 2;
    (half..before.len())
        .filter(|i| {
            let (a, b) = (before[*i][1], after[*i][1]);
            (a - b).abs() > 0.3 * a.max(b)
        })
        .collect()
}

fn mean(image: &[[f32; 3]], region: &[usize]) -> f64 {
    region.iter().map(|i| f64::from(image[*i][1])).sum::<f64>() / region.len() as f64
}

/// Pixels to look at, by the truth before and after.
type Region = fn(&[[f32; 3]], &[[f32; 3]]) -> Vec<usize>;

/// Frames after the last of `steps` until the region's mean is within 10% of the new truth and stays there for 8 frames;
/// none if that takes longer than is waited for.
fn frames_to_follow(renderer: &GpuRenderer, steps: &[Shown<'_>], settings: &Settings, region: Region) -> Option<u32> {
    let (first, last) = (steps[0], steps[steps.len() - 1]);
    let (before, after) = (truth(renderer, first), truth(renderer, last));
    let region = region(&before, &after);
    assert!(region.len() > 200, "{} pixels change", region.len());
    let wanted = mean(&after, &region);
    assert!(wanted > 0.0, "nothing lights the region");
    let mut view = renderer.view(SIZE).unwrap();
    let mut index = 0;
    let mut show = |shown: Shown<'_>| {
        renderer.frame(&mut view, &input(shown, settings, index, 0)).unwrap();
        index += 1;
        (mean(&radiance(&view).unwrap(), &region) / wanted - 1.0).abs() < 0.1
    };
    for _ in 0..BEFORE {
        show(first);
    }
    for step in &steps[1..steps.len() - 1] {
        show(*step);
    }
    let good: Vec<bool> = (0..MOST).map(|_| show(last)).collect();
    let held = good.windows(8).position(|w| w.iter().all(|g| *g));
    held.map(|frames| frames as u32 + 1)
}

#[test]
fn what_changes_is_followed_within_four_frames_with_gradients() {
    with_device(|device| {
        let scene = board("", Entity::new("func_door").with("angle", "-1"));
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let number = scene.entities.iter().position(|e| e.class() == "func_door").unwrap() as u32;
        let lamp = [point_light(Vec3::new(100.0, 70.0, 60.0), 200.0, Vec3::ONE)];
        let below = [point_light(Vec3::new(140.0, 90.0, 30.0), 200.0, Vec3::ONE)];
        let near = [point_light(Vec3::new(140.0, 128.0, 130.0), 50.0, Vec3::ONE)];
        let at = |offset: Vec3| {
            [EntityState {
                entity: number,
                offset,
                hidden: false,
            }]
        };
        let along = |way: Vec3| -> Vec<_> { (0..=8).map(|i| at(way * i as f32)).collect() };
        let shown = |camera: Camera, lights, entities| Shown {
            camera,
            lights,
            entities,
            clock: Clock::default(),
        };
        let (aside, past, down) = (along(Vec3::Y * 10.0), along(Vec3::Y * 5.0), along(Vec3::NEG_Z * 8.0));
        let slides: Vec<_> = aside.iter().map(|places| shown(view(), &[], &places[..])).collect();
        let passes: Vec<_> = past
            .iter()
            .map(|places| shown(view_of_board(148.0, 14.0), &near, &places[..]))
            .collect();
        let sinks: Vec<_> = down
            .iter()
            .map(|places| shown(view_of_board(128.0, 40.0), &below, &places[..]))
            .collect();
        let (lit, unlit) = (shown(view(), &lamp, &[]), shown(view(), &[], &[]));
        let cases: [(&str, Vec<Shown<'_>>, Region); 6] = [
            ("a lamp goes out", vec![lit, unlit], changed),
            ("a lamp goes on", vec![unlit, lit], changed),
            (
                "a board moves out of the light at once",
                vec![slides[0], slides[8]],
                changed,
            ),
            ("a board moves out of the light in 8 frames", slides.clone(), changed),
            ("a board passes by a lamp in 8 frames", passes, middle),
            ("a board moves to a lamp in 8 frames", sinks, middle),
        ];
        for (name, steps, region) in &cases {
            follows(&renderer, name, steps, &settings(true), *region);
        }
    });
}

/// Fails if changes are not followed within four frames with gradients, or are without.
fn follows(renderer: &GpuRenderer, name: &str, steps: &[Shown<'_>], settings: &Settings, region: Region) {
    let with = frames_to_follow(renderer, steps, settings, region);
    let without = Settings {
        gradients: false,
        ..*settings
    };
    let without = frames_to_follow(renderer, steps, &without, region);
    println!("{name}: {with:?} frames with gradients, {without:?} without");
    let with = with.filter(|n| *n <= 4);
    assert!(with.is_some(), "{name}: not followed with gradients");
    assert!(
        without.is_none_or(|n| Some(n) > with),
        "{name}: followed as soon without gradients"
    );
}

#[test]
fn what_turns_or_deforms_is_followed_with_and_without_reused_samples() {
    // Half a second in eight frames: the board turns by 60° about an axis that lies across its lower face, or sinks by 64 units.
    let turning = Entity::new("func_rotating")
        .with("spawnflags", "4")
        .with("speed", "120");
    let sinking = "\tdeformVertexes move 0 0 -128 sawtooth 0 1 0 1\n";
    let near = [point_light(Vec3::new(140.0, 226.0, 100.0), 200.0, Vec3::ONE)];
    let below = [point_light(Vec3::new(140.0, 90.0, 30.0), 200.0, Vec3::ONE)];
    let cases = [
        ("a board turns", board("", turning), &near),
        ("a board deforms", board(sinking, Entity::new("func_static")), &below),
    ];
    with_device(|device| {
        for (name, scene, lights) in &cases {
            let gpu = SceneGpu::new(device, scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            let step = |i: u32| Shown {
                camera: view_of_board(128.0, 14.0),
                lights: &lights[..],
                entities: &[],
                clock: Clock::from_seconds(f64::from(i) / 16.0),
            };
            let steps: Vec<_> = (0..=8).map(step).collect();
            for reuse_denoised in [true, false] {
                let settings = Settings {
                    reuse_denoised,
                    ..settings(true)
                };
                let reused = if reuse_denoised { "with" } else { "without" };
                follows(
                    &renderer,
                    &format!("{name}, {reused} reused samples"),
                    &steps,
                    &settings,
                    middle,
                );
            }
        }
    });
}
