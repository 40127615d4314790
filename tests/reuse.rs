//! Reuse of light samples between frames and pixels: it has the mean of all lights, also while the camera moves, and less
//! error than without.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::{mean_and_error, quiet, real, spawn_camera};
use gpu_fixture::with_device;
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::{GpuRenderer, radiance};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, Settings};
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;

const SIZE: (u32, u32) = (64, 36);
const FRAMES: u32 = 8;
const SEEDS: u32 = 24;
const BLOCK: usize = 16;

/// Mean green of square blocks of an image.
fn blocks(pixels: &[[f32; 3]]) -> Vec<f64> {
    let (width, across) = (SIZE.0 as usize, SIZE.0 as usize / BLOCK);
    let mut sums = vec![(0.0, 0.0); across * (SIZE.1 as usize).div_ceil(BLOCK)];
    for (i, p) in pixels.iter().enumerate() {
        let (sum, count) = &mut sums[i / width / BLOCK * across + i % width / BLOCK];
        *sum += f64::from(p[1]);
        *count += 1.0;
    }
    sums.into_iter().map(|(sum, count)| sum / count).collect()
}

/// The last of some frames that end at `camera`, each seen `step` units farther along and half a degree further round.
fn last_frame(renderer: &GpuRenderer, camera: &Camera, settings: &Settings, step: f32, reuse: bool) -> Vec<[f32; 3]> {
    let mut view = renderer.view(SIZE).unwrap();
    for index in 0..FRAMES {
        let left = (FRAMES - 1 - index) as f32;
        let mut camera = *camera;
        camera.eye[0] -= step * left;
        camera.yaw -= 0.5 * step.signum() * left * f32::from(u8::from(step != 0.0));
        let input = FrameInput {
            camera,
            settings: *settings,
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated: 0,
            exposure_blend: 1.0,
            reuse,
            output: false,
        };
        renderer.frame(&mut view, &input).unwrap();
    }
    radiance(&view).unwrap()
}

/// Mean squared error over squared mean.
fn error(image: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let squares: f64 = image
        .iter()
        .zip(truth)
        .map(|(a, b)| f64::from(a[1] - b[1]).powi(2))
        .sum();
    let mean: f64 = truth.iter().map(|p| f64::from(p[1])).sum::<f64>() / truth.len() as f64;
    squares / truth.len() as f64 / (mean * mean)
}

#[test]
fn reused_samples_have_the_mean_of_all_lights() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let settings = Settings {
            antialiasing: false,
            ambient: AmbientLight::Off,
            denoiser: false,
            taa: false,
            reuse_neighbours: 2,
            ..Settings::default()
        };
        let cpu = CpuRenderer::new(&scene);
        let all = Settings {
            random_lights: 16,
            ..settings
        };
        let truth = cpu.accumulate(&camera, SIZE, &all, 0..128, &quiet).0.mean;
        let wanted = blocks(&truth);
        for (backend, step) in [(Backend::Bvh, 0.0), (Backend::Bvh, 3.0), (Backend::RayQuery, 0.0)] {
            if backend == Backend::RayQuery {
                assert!(device.has_ray_query(), "no ray queries here: run tests/setup.sh");
            }
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            let (mut means, mut reused, mut fresh) = (Vec::new(), 0.0, 0.0);
            for seed in 0..SEEDS {
                let settings = Settings { seed, ..settings };
                let image = last_frame(&renderer, &camera, &settings, step, true);
                reused += error(&image, &truth);
                fresh += error(&last_frame(&renderer, &camera, &settings, step, false), &truth);
                means.push(blocks(&image));
            }
            let mut worst: f64 = 0.0;
            for (block, wanted) in wanted.iter().enumerate() {
                let of_block: Vec<f64> = means.iter().map(|m| m[block]).collect();
                let (mean, error) = mean_and_error(&of_block);
                // The reference has noise too, a hundredth of a frame's.
                let off = (mean - wanted).abs() / (error + 2e-3 * wanted + 1e-9);
                worst = worst.max(off);
            }
            println!(
                "{backend}, step {step}: {worst:.2} standard errors, error {:.1} times lower",
                fresh / reused
            );
            assert!(
                worst < 4.0,
                "{backend}, step {step}: a block is {worst} standard errors off"
            );
            assert!(
                fresh > 1.5 * reused,
                "{backend}, step {step}: {fresh} without reuse, {reused} with it"
            );
        }
    });
}

/// A view that reuses nothing for a frame starts anew: what it shows then is what a new view shows.
#[test]
fn history_ends_where_reuse_does() {
    with_device(|device| {
        let scene = real("oa_dm1");
        let camera = spawn_camera(&scene, 0);
        let settings = Settings {
            denoiser: false,
            taa: false,
            ..Settings::default()
        };
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let frame = |index: u32, reuse: bool, seed: u32| FrameInput {
            camera,
            settings: Settings { seed, ..settings },
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated: 0,
            exposure_blend: 1.0,
            reuse,
            output: false,
        };
        let mut fresh = renderer.view(SIZE).unwrap();
        renderer.frame(&mut fresh, &frame(9, true, 0)).unwrap();
        let wanted = radiance(&fresh).unwrap();
        // Interrupted by a frame without reuse; interrupted by other settings.
        for between in [frame(3, false, 0), frame(3, true, 5)] {
            let mut view = renderer.view(SIZE).unwrap();
            renderer.frame(&mut view, &frame(2, true, 0)).unwrap();
            renderer.frame(&mut view, &between).unwrap();
            renderer.frame(&mut view, &frame(9, true, 0)).unwrap();
            assert_eq!(radiance(&view).unwrap(), wanted);
        }
        let mut view = renderer.view(SIZE).unwrap();
        renderer.frame(&mut view, &frame(2, true, 0)).unwrap();
        renderer.frame(&mut view, &frame(9, true, 0)).unwrap();
        assert_ne!(radiance(&view).unwrap(), wanted, "nothing was reused");
    });
}
