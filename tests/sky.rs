//! Skies as they are seen: alike by both tracers at any size of the image, and steady where the view turns.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::{camera, gpu_film, quiet, real};
use gpu_fixture::with_device;
use q3rays::reference::renderer::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::{GpuRenderer, radiance};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::Settings;
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;

/// Small: a pixel covers many texels.
const SIZE: (u32, u32) = (128, 72);

/// Nothing but what shines by itself, and textures.
fn unlit() -> Settings {
    Settings {
        illumination: false,
        ..Settings::default()
    }
}

/// From the first spawn up into the sky.
fn upwards(scene: &Scene, yaw: f32) -> Camera {
    let at = q3rays::scene::spawns::view(&scene.spawns[0], 90.0);
    camera(at.eye, -50.0, at.yaw + yaw, 90.0)
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|c| f64::from(*c)).sum::<f64>() / (3 * pixels.len()) as f64
}

/// Mean distance of an image from another over its mean.
fn distance(image: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let off = image.iter().flatten().zip(truth.iter().flatten());
    let sum: f64 = off.map(|(a, b)| f64::from((a - b).abs())).sum();
    sum / (3 * truth.len()) as f64 / mean(truth)
}

#[test]
fn both_tracers_filter_skies_alike() {
    // Stars in a box; clouds.
    for map in ["wrackdm17", "oa_dm4"] {
        let scene = real(map);
        let view = upwards(&scene, 0.0);
        let cpu = CpuRenderer::new(&scene);
        let far = |filter_textures| {
            let settings = Settings {
                filter_textures,
                ..unlit()
            };
            cpu.accumulate(&view, SIZE, &settings, 0..1, &quiet).0.mean
        };
        let own = far(true);
        let filtered = distance(&own, &far(false));
        with_device(|device| {
            let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
            let off = distance(&gpu_film(&gpu, &view, SIZE, &unlit(), 1).mean, &own);
            println!("{map}: apart {off:.1e}; from full resolution {filtered:.3}");
            assert!(off < 1e-3, "{map}: {off}");
            assert!(filtered > 30.0 * off, "{map}: filtered {filtered}");
        });
    }
}

#[test]
fn stars_keep_their_light_while_the_view_turns() {
    let scene = real("wrackdm17");
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut view = renderer.view(SIZE).unwrap();
        let mut last = upwards(&scene, 0.0);
        for index in 0..12 {
            last = upwards(&scene, 0.7 * index as f32);
            let input = FrameInput {
                camera: last,
                settings: unlit(),
                lights: &[],
                polygons: &[],
                entities: &[],
                sample_index: index,
                accumulated: 0,
                exposure_blend: 1.0,
                reuse: true,
                output: true,
            };
            renderer.frame(&mut view, &input).unwrap();
        }
        let seen = radiance(&view).unwrap();
        let truth = gpu_film(&gpu, &last, SIZE, &unlit(), 512).mean;
        let (off, ratio) = (distance(&seen, &truth), mean(&seen) / mean(&truth));
        println!("moving {off:.4}, mean {ratio:.4}");
        // Frames blended by anti-aliasing alone would be 0.056 off.
        assert!(off < 0.02, "{off}");
        assert!((ratio - 1.0).abs() < 0.003, "mean {ratio}");
    });
}
