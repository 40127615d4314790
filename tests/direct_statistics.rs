//! What direct light's estimators are as random variables: N random lights have the mean of all lights, the error falls
//! as it should, and the variance that the film tells is the true one.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::{ceiling_light, emitter_on_floor, emitter_radiance, polygon};
use common::{blocks, camera, mean_and_error, quiet, scene, still};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::fixtures::{Doorways, Fixture, LitBox, chain, doorway_light, free_emitter, lit_box};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::LightSampling;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::sampling::Sequence;
use std::ops::Range;

const SEEDS: u32 = 32;
const SIZE: (u32, u32) = (32, 32);

const LIT_BOX: LitBox = LitBox {
    size: 256,
    albedo: 128,
    light: [[64, 64], [192, 192]],
    surfacelight: 1000,
};

/// Fixtures and views of them, with what each is here for.
fn cases() -> Vec<(&'static str, Fixture, Camera)> {
    let two_sided = free_emitter(48.0, 1000, true).unwrap();
    let one_sided = free_emitter(48.0, 1000, false).unwrap();
    let doorway = doorway_light(1000).unwrap();
    let chain = chain(5, Doorways::Staggered, 1000).unwrap();
    let close = emitter_on_floor(1000);
    vec![
        (
            "lit box",
            lit_box(&LIT_BOX).unwrap(),
            camera([20.3, 30.6, 150.2], 20.0, 40.0, 90.0),
        ),
        (
            "two-sided emitter, front",
            two_sided.clone(),
            camera([20.3, 90.6, 40.2], 5.0, 30.0, 90.0),
        ),
        (
            "two-sided emitter, back",
            two_sided,
            camera([230.3, 90.6, 40.2], 5.0, 150.0, 90.0),
        ),
        (
            "one-sided emitter",
            one_sided,
            camera([230.3, 90.6, 40.2], 5.0, 150.0, 90.0),
        ),
        // The sill and jambs of the doorway are receivers at its portals.
        (
            "light in a doorway, far room",
            doorway.clone(),
            camera([200.3, 128.6, 60.2], 10.0, 2.0, 80.0),
        ),
        (
            "light in a doorway, its portals",
            doorway,
            camera([244.3, 120.6, 70.2], 50.0, 2.0, 100.0),
        ),
        ("chain of rooms", chain, camera([230.3, 70.6, 60.2], 8.0, 2.0, 90.0)),
        (
            "emitter closer than a unit",
            close,
            camera([131.2, 128.4, 4.1], 88.0, 0.4, 60.0),
        ),
    ]
}

/// Means of blocks (and of the whole) with their standard errors, over seeds.
fn measure(seeds: Range<u32>, samples: u32, film: Accumulate) -> Vec<(f64, f64)> {
    let by_seed: Vec<Vec<f64>> = seeds
        .map(|seed| {
            let film = film(seed, samples);
            blocks(SIZE, |i| f64::from(film.direct[i][1]))
        })
        .collect();
    let one = |block: usize| mean_and_error(&by_seed.iter().map(|s| s[block]).collect::<Vec<_>>());
    (0..by_seed[0].len()).map(one).collect()
}

/// Image of a seed with a number of samples.
type Accumulate<'a> = &'a dyn Fn(u32, u32) -> Film;

/// Whether an estimator has the mean of a reference in every block. Of the hundreds of figures that are compared in this
/// file, one or two lie beyond three standard errors by chance; those are measured again with 128 other seeds and four
/// times the samples, where a bias would stand out four times as far.
fn same_mean(what: &str, samples: u32, film: Accumulate, reference: &[(f64, f64)]) {
    let beyond = |(ma, ea): (f64, f64), (mb, eb): (f64, f64)| {
        let error = f64::hypot(ea, eb);
        (
            (ma - mb).abs() > 3.0 * error + 1e-6 * mb,
            (ma - mb).abs() / error.max(1e-9 * mb),
        )
    };
    let first = measure(0..SEEDS, samples, film);
    let worst = (first.iter().zip(reference)).fold(0.0, |worst: f64, (a, b)| worst.max(beyond(*a, *b).1));
    println!("{what}: at most {worst:.2} standard errors");
    if first.iter().zip(reference).any(|(a, b)| beyond(*a, *b).0) {
        let second = measure(SEEDS..5 * SEEDS, 4 * samples, film);
        for (block, (first, (second, reference))) in first.iter().zip(second.iter().zip(reference)).enumerate() {
            if beyond(*first, *reference).0 {
                println!("    block {block}: {first:?}, measured again {second:?}, all lights {reference:?}");
                assert!(!beyond(*second, *reference).0, "{what}, block {block}");
            }
        }
    }
}

#[test]
fn random_lights_have_the_mean_of_all() {
    for (what, fixture, camera) in cases() {
        let scene = scene(&fixture);
        let cpu = CpuRenderer::new(&scene);
        let film = |sampling: LightSampling, lights: u32, cull: u32, seed: u32, samples: u32| {
            let apart = 1_000_000 * sampling as u32 + 100_000 * (lights + 1) + 1000 * cull;
            let mut settings = still(lights, Sequence::Random, apart + seed);
            settings.cull_lights = cull;
            settings.light_sampling = sampling;
            cpu.accumulate(&camera, SIZE, &settings, 0..samples, &quiet).0
        };
        let all = measure(0..4 * SEEDS, 16, &|seed, samples| {
            film(LightSampling::Uniform, 0, 0, seed, samples)
        });
        assert!(
            all[all.len() - 1].0 > 0.0,
            "{what}: a view without light would prove nothing"
        );
        for (sampling, lights, cull) in [
            (LightSampling::Uniform, 1, 0),
            (LightSampling::Uniform, 4, 1),
            (LightSampling::Power, 2, 2),
            (LightSampling::Bvh, 1, 0),
            (LightSampling::Bvh, 2, 1),
            (LightSampling::Reservoir, 1, 1),
        ] {
            let name = format!("{what}, {lights} lights, {sampling:?}, rt_cullLights {cull}");
            let film: Accumulate = &|seed, samples| film(sampling, lights, cull, seed, samples);
            same_mean(&name, 32 / lights, film, &all);
        }
    }
}

#[test]
fn random_lights_have_the_mean_of_all_on_the_gpu() {
    with_device(|device| {
        let fixture = chain(5, Doorways::Staggered, 1000).unwrap();
        let (scene, camera) = (scene(&fixture), camera([230.3, 70.6, 60.2], 8.0, 2.0, 90.0));
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        // Making the pipelines takes longer than most of the images.
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let film = |sampling: LightSampling, lights: u32, seed: u32, samples: u32| {
            let mut settings = still(
                lights,
                Sequence::Random,
                10_000 * sampling as u32 + 1000 * lights + seed,
            );
            settings.light_sampling = sampling;
            let (film, _) = renderer
                .accumulate(&camera, SIZE, &settings, 0..samples, &quiet)
                .unwrap();
            film
        };
        let all = measure(0..SEEDS, 4, &|seed, samples| {
            film(LightSampling::Uniform, 0, seed, samples)
        });
        for sampling in [
            LightSampling::Uniform,
            LightSampling::Power,
            LightSampling::Bvh,
            LightSampling::Reservoir,
        ] {
            same_mean(
                &format!("chain on the GPU, 2 lights, {sampling:?}"),
                16,
                &|seed, samples| film(sampling, 2, seed, samples),
                &all,
            );
        }
    });
}

/// Least-squares slope of log y over log x.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let over: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    over / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

#[test]
fn the_error_falls_with_samples_as_it_should() {
    let scene = scene(&lit_box(&LIT_BOX).unwrap());
    let cpu = CpuRenderer::new(&scene);
    let camera = camera([128.3, 127.6, 200.2], 88.0, 0.4, 60.0);
    let aovs = cpu.aovs(&camera, SIZE, &still(0, Sequence::Sobol, 0));
    let truth: Vec<f64> = (0..aovs.depth.len())
        .map(|i| {
            let (p, n) = (Vec3::from(aovs.position[i]).as_dvec3(), Vec3::from(aovs.geo_normal[i]));
            let light = polygon(p, n.as_dvec3(), &ceiling_light(&LIT_BOX)) * emitter_radiance(LIT_BOX.surfacelight);
            f64::from(aovs.albedo[i][0]) * light
        })
        .collect();
    let slope_of = |sequence: Sequence, lights: u32| {
        let points: Vec<(f64, f64)> = [4u32, 16, 64, 256]
            .into_iter()
            .map(|samples| {
                let (mut error, mut told) = (0.0, 0.0);
                for seed in 0..4 {
                    let settings = still(lights, sequence, seed);
                    let (film, _) = cpu.accumulate(&camera, SIZE, &settings, 0..samples, &quiet);
                    for (i, truth) in truth.iter().enumerate() {
                        error += (f64::from(film.direct[i][0]) - truth).powi(2);
                        told += f64::from(film.variance[i]);
                    }
                }
                if sequence == Sequence::Random {
                    // The film's own variance of the mean is the truth's: 4096 squared errors know theirs to 2.2%,
                    // and samples within a pixel only tell more.
                    let ratio = told / error;
                    assert!(
                        (0.9..1.1).contains(&ratio),
                        "{samples} samples: variance told / true = {ratio}"
                    );
                }
                (f64::from(samples), error)
            })
            .collect();
        slope(&points)
    };
    for lights in [0, 1] {
        let random = slope_of(Sequence::Random, lights);
        let sobol = slope_of(Sequence::Sobol, lights);
        println!("{lights} lights: slope {random:.3} with random numbers, {sobol:.3} with the Sobol sequence");
        assert!(random <= -0.95, "{random}");
        assert!(sobol <= random, "{sobol} is shallower than {random}");
    }
}
