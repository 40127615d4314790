//! The three backends make the same picture, pixel by pixel, and what still differs has a name. Views of one scene do not
//! disturb each other.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::ties::{Class, Context, Seen, Tally};
use common::{gpu_film, quiet, real, same_bits, spawn_camera};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::metrics::{ImageRgb, Kind, compare};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::{GpuRenderer, film};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::Settings;
use q3rays::scene::bvh::BvhQuality;

fn image(film: &Film) -> ImageRgb {
    ImageRgb {
        width: film.width as usize,
        height: film.height as usize,
        pixels: film.mean.clone(),
    }
}

/// Share of pixels that must be the same.
const SAME: f64 = 0.999;

/// Looks at every sample of the pixels that differ: what each was on the device, and why it differs.
fn classify(context: &Context, gpu: &SceneGpu, pixels: &[usize], samples: u32) -> Tally {
    let mut tally = Tally::new();
    if pixels.is_empty() {
        return tally;
    }
    let renderer = GpuRenderer::new(gpu).unwrap();
    let mut view = renderer.view(context.size).unwrap();
    for index in 0..samples {
        renderer
            .accumulate_one(&mut view, &context.camera, &context.settings, index, 1)
            .unwrap();
        let radiance = film(&view, 1).unwrap().mean;
        let objects = view.gbuffer.object().read_back(0).unwrap();
        for &pixel in pixels {
            let object: [u32; 4] = bytemuck::pod_read_unaligned(&objects[pixel * 16..pixel * 16 + 16]);
            let seen = Seen {
                triangle: object[0],
                radiance: Vec3::from(radiance[pixel]),
            };
            if let Some(class) = context.class(pixel, index, seen) {
                *tally.entry(class).or_default() += 1;
                if class == Class::Unexplained {
                    println!("    pixel {pixel}, sample {index}: {seen:?}");
                }
            }
        }
    }
    tally
}

/// Holds a device's image against the CPU's.
fn same_picture(what: &str, context: &Context, gpu: &SceneGpu, reference: &Film, samples: u32) {
    let got = gpu_film(gpu, &context.camera, context.size, &context.settings, samples);
    let pixels: Vec<usize> = (0..got.mean.len())
        .filter(|&i| !context.same(got.mean[i].into(), reference.mean[i].into()))
        .collect();
    let share = 1.0 - pixels.len() as f64 / got.mean.len() as f64;
    let metrics = compare(&image(&got), &image(reference), Kind::Linear, None).unwrap();
    let (ratio, trimmed) = (metrics.mean_ratio.unwrap(), metrics.rel_mse_trimmed.unwrap());
    let tally = classify(context, gpu, &pixels, samples);
    println!(
        "{what}: {:.3}% of pixels the same, mean ratio {ratio:.6}, rel_mse_trimmed {trimmed:.1e}; samples that differ in \
         the {} others: {tally:?}",
        100.0 * share,
        pixels.len()
    );
    assert_eq!(metrics.nan_count, 0, "{what}");
    assert!(share >= SAME, "{what}: only {share} of the pixels are the same");
    assert!((ratio - 1.0).abs() <= 0.002, "{what}: mean ratio {ratio}");
    assert!(trimmed <= 1e-4, "{what}: rel_mse_trimmed {trimmed}");
    assert!(!tally.contains_key(&Class::Unexplained), "{what}: {tally:?}");
}

fn backends_agree(maps: &[&str], samples: u32, size: (u32, u32)) {
    with_device(|device| {
        assert!(
            device.has_ray_query(),
            "no ray queries here: run tests/setup.sh, which installs a lavapipe that has them"
        );
        for name in maps {
            let scene = real(name);
            let cpu = CpuRenderer::new(&scene);
            let camera = spawn_camera(&scene, 0);
            let settings = Settings::default();
            let (reference, _) = cpu.accumulate(&camera, size, &settings, 0..samples, &quiet);
            let sum: f32 = reference.mean.as_flattened().iter().sum();
            let context = Context {
                cpu: &cpu,
                camera,
                size,
                settings,
                mean: sum / reference.mean.as_flattened().len() as f32,
            };
            assert!(context.mean > 0.0, "{name}: a black picture proves nothing");
            for backend in [Backend::Bvh, Backend::RayQuery] {
                let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
                same_picture(&format!("{name}, {backend}"), &context, &gpu, &reference, samples);
            }
        }
    });
}

#[test]
fn three_backends_make_the_same_picture() {
    backends_agree(&["showcase", "oa_dm1", "am_galmevish2"], 16, (96, 54));
}

/// The five maps and 64 samples; minutes of work.
#[test]
#[ignore = "takes minutes; for releases"]
fn three_backends_make_the_same_picture_of_five_maps() {
    let maps = ["oa_dm1", "am_galmevish2", "ctf_compromise", "oa_minia", "oacmpctf3"];
    backends_agree(&maps, 64, (160, 90));
}

#[test]
fn two_interleaved_views_equal_each_alone() {
    const SAMPLES: u32 = 8;
    let scene = real("oa_dm1");
    let views = [
        (spawn_camera(&scene, 0), (64, 36), 1),
        (spawn_camera(&scene, 3), (50, 40), 2),
    ];
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            let settings = |seed| Settings {
                seed,
                // A lens whose focus lies under the crosshair: state that a view must keep to itself.
                aperture: 2.0,
                ..Settings::default()
            };
            let alone = views.map(|(camera, size, seed)| gpu_film(&gpu, &camera, size, &settings(seed), SAMPLES));
            let mut states = views.map(|(_, size, _)| renderer.view(size).unwrap());
            for n in 0..SAMPLES {
                for (state, (camera, _, seed)) in states.iter_mut().zip(&views) {
                    renderer
                        .accumulate_one(state, camera, &settings(*seed), n, n + 1)
                        .unwrap();
                }
            }
            for (state, alone) in states.iter().zip(&alone) {
                assert!(same_bits(&film(state, SAMPLES).unwrap(), alone), "{backend}");
            }
        }
    });
}
