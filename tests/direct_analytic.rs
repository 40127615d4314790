//! Direct light against closed forms: per block of 16x16 pixels and in the mean, within three standard errors that 32
//! independent scramblings give. Seeds are fixed, so that a test that passes keeps passing.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::{
    ceiling_light, emitter_on_floor, emitter_radiance, floor_emitter, point_light, polygon, sunlit, under_dome,
};
use common::{blocks, camera, mean_and_error, quiet, scene, still};
use glam::{DVec3, Vec3};
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::fixtures::{LitBox, furnace, lit_box};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::sampling::Sequence;
use std::ops::Range;

const SEEDS: u32 = 32;
const SIZE: (u32, u32) = (48, 32);
const SAMPLES: u32 = 8;

const LIT_BOX: LitBox = LitBox {
    size: 256,
    albedo: 128,
    light: [[96, 80], [160, 176]],
    surfacelight: 1000,
};

/// The floor from above.
fn down() -> Camera {
    camera([128.3, 127.6, 200.2], 88.0, 0.4, 60.0)
}

/// Floor and three walls.
fn across() -> Camera {
    camera([20.3, 30.6, 150.2], 20.0, 40.0, 90.0)
}

/// Reflected radiance of each pixel's centre when irradiance/π is `light(position, normal)`.
fn truth(cpu: &CpuRenderer, camera: &Camera, light: impl Fn(DVec3, DVec3) -> f64) -> Vec<f64> {
    let aovs = cpu.aovs(camera, SIZE, &still(0, Sequence::Sobol, 0));
    (0..aovs.depth.len())
        .map(|i| {
            assert!(aovs.depth[i] > 0.0, "the view must see surfaces only");
            let (p, n) = (Vec3::from(aovs.position[i]), Vec3::from(aovs.geo_normal[i]));
            f64::from(aovs.albedo[i][0]) * light(p.as_dvec3(), n.as_dvec3())
        })
        .collect()
}

/// Deviation of each block and of the mean of the whole from the truth: the mean over `seeds` and its standard error.
fn deviations(truth: &[f64], seeds: Range<u32>, samples: u32, film: Accumulate) -> Vec<(f64, f64)> {
    let by_seed: Vec<Vec<f64>> = seeds
        .map(|seed| {
            let film = film(seed, samples);
            blocks(SIZE, |i| f64::from(film.direct[i][0]) - truth[i])
        })
        .collect();
    let one = |block: usize| mean_and_error(&by_seed.iter().map(|d| d[block]).collect::<Vec<_>>());
    (0..by_seed[0].len()).map(one).collect()
}

/// Image of a seed with a number of samples.
type Accumulate<'a> = &'a dyn Fn(u32, u32) -> Film;

/// Holds images of 32 seeds against the truth. Of the thousand figures that are compared in this file, a few lie beyond
/// three standard errors by chance alone. Those are measured again with 128 other seeds and four times the samples: a
/// bias would then stand out four times as far, chance does not strike twice.
fn agree(what: &str, truth: &[f64], film: Accumulate) {
    let expected = blocks(SIZE, |i| truth[i]);
    // Single precision on the way: positions are f32, so that the truth of a pixel is known to about 1e-6 of it.
    let beyond = |block: usize, (mean, error): (f64, f64)| mean.abs() > 3.0 * error + 4e-6 * expected[block];
    let first = deviations(truth, 0..SEEDS, SAMPLES, film);
    let suspects: Vec<usize> = (0..first.len()).filter(|&b| beyond(b, first[b])).collect();
    let worst = (first.iter().zip(&expected))
        .filter(|((_, error), expected)| *error > 1e-6 * **expected)
        .fold(0.0, |worst: f64, ((mean, error), _)| worst.max(mean.abs() / error));
    println!("{what}: at most {worst:.2} standard errors");
    if suspects.is_empty() {
        return;
    }
    let second = deviations(truth, SEEDS..5 * SEEDS, 4 * SAMPLES, film);
    for block in suspects {
        let ((m1, e1), (m2, e2)) = (first[block], second[block]);
        let expected = expected[block];
        println!("    block {block} of {expected:e}: off by {m1:e} ± {e1:e}, measured again {m2:e} ± {e2:e}");
        assert!(
            !beyond(block, second[block]),
            "{what}, block {block}: off by {m2:e} ± {e2:e} of {expected:e}"
        );
    }
}

/// All of it on the CPU tracer: every sequence, all lights and some at random.
fn agree_on_cpu(what: &str, scene: &Scene, camera: &Camera, light: impl Fn(DVec3, DVec3) -> f64) {
    let cpu = CpuRenderer::new(scene);
    let truth = truth(&cpu, camera, light);
    for sequence in [Sequence::Random, Sequence::Sobol] {
        for lights in [0, 2] {
            agree(
                &format!("{what}, {sequence:?}, {lights} lights"),
                &truth,
                &|seed, samples| {
                    let settings = still(lights, sequence, seed);
                    cpu.accumulate(camera, SIZE, &settings, 0..samples, &quiet).0
                },
            );
        }
    }
}

fn rectangle(at: DVec3, normal: DVec3) -> f64 {
    polygon(at, normal, &ceiling_light(&LIT_BOX)) * emitter_radiance(LIT_BOX.surfacelight)
}

#[test]
fn a_rectangle_over_a_plane_and_beside_walls() {
    let scene = scene(&lit_box(&LIT_BOX).unwrap());
    for (view, camera) in [("floor", down()), ("room", across())] {
        agree_on_cpu(&format!("rectangle, {view}"), &scene, &camera, |p, n| {
            // The ceiling itself sees its light edge on.
            if n.z < -0.5 { 0.0 } else { rectangle(p, n) }
        });
    }
}

#[test]
fn a_rectangle_over_a_plane_on_the_gpu() {
    let scene = scene(&lit_box(&LIT_BOX).unwrap());
    let truth = truth(&CpuRenderer::new(&scene), &down(), rectangle);
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        for lights in [0, 1] {
            agree(
                &format!("rectangle on the GPU, {lights} lights"),
                &truth,
                &|seed, samples| {
                    let settings = still(lights, Sequence::Sobol, seed);
                    renderer
                        .accumulate(&down(), SIZE, &settings, 0..samples, &quiet)
                        .unwrap()
                        .0
                },
            );
        }
    });
}

#[test]
fn an_emitter_closer_than_a_unit() {
    let scene = scene(&emitter_on_floor(1000));
    // About six units of floor across the image, up to the emitter's foot, a quarter unit under its edge.
    let near = camera([131.2, 128.4, 4.1], 88.0, 0.4, 60.0);
    agree_on_cpu("close emitter", &scene, &near, |p, n| {
        if n.z < 0.5 || p.x <= 128.0 {
            return 0.0;
        }
        polygon(p, n, &floor_emitter()) * emitter_radiance(1000)
    });
}

#[test]
fn a_sphere() {
    let (centre, light) = (DVec3::new(140.0, 120.0, 150.0), 300.0);
    let scene = scene(&point_light(centre.as_vec3(), light as f32));
    for (view, camera) in [("floor", down()), ("room", across())] {
        agree_on_cpu(&format!("sphere, {view}"), &scene, &camera, |p, n| {
            // The compiler's point light; a sphere wholly above the horizon lights as its centre would.
            let to = centre - p;
            7500.0 * light / 255.0 * to.normalize().dot(n).max(0.0) / to.length_squared()
        });
    }
}

#[test]
fn a_sun() {
    for deviance in [0.5f64, 10.0] {
        // High enough, and seen near the corner away from it, that no wall cuts its disc.
        let (azimuth, elevation) = (70f64, 75f64);
        let scene = scene(&sunlit((120.0, azimuth, elevation, deviance)));
        let r = deviance.to_radians();
        // The mean of the sine over a disc of elevations: 2·J1(r)/r in its series.
        let spread = 1.0 - r * r / 8.0 + r.powi(4) / 192.0;
        // The compiler makes a sun's colour a unit vector.
        let light = 120.0 / 255.0 / 3f64.sqrt() * elevation.to_radians().sin() * spread;
        let lit = camera([80.3, 40.6, 60.2], 88.0, 0.4, 60.0);
        agree_on_cpu(&format!("sun of {deviance} degrees"), &scene, &lit, |_, n| {
            assert!(n.z > 0.9);
            light
        });
    }
}

#[test]
fn a_sky_dome() {
    let scene = scene(&under_dome(200));
    let lit = camera([80.3, 40.6, 60.2], 88.0, 0.4, 60.0);
    // As many suns in every degree of elevation: the mean sine is 2/π.
    agree_on_cpu("sky dome", &scene, &lit, |_, n| {
        assert!(n.z > 0.9);
        200.0 / 255.0 * 2.0 / std::f64::consts::PI
    });
}

#[test]
fn the_white_furnace_of_direct_light() {
    let scene = scene(&furnace(256, 180, 500).unwrap());
    for (view, camera) in [("floor", down()), ("room", across())] {
        agree_on_cpu(&format!("furnace, {view}"), &scene, &camera, |_, _| {
            emitter_radiance(500)
        });
    }
}

/// `rt_softshadows 0` takes the centroid of every light, so that nothing is left to chance.
#[test]
fn hard_shadows_come_from_the_centroid() {
    let scene = scene(&lit_box(&LIT_BOX).unwrap());
    let cpu = CpuRenderer::new(&scene);
    let expected = truth(&cpu, &down(), |p, n| {
        scene
            .lights
            .lights
            .iter()
            .map(|l| {
                let [p0, e1, e2] = [l.p0, l.p1, l.p2].map(|v| Vec3::from(v).as_dvec3());
                let to = p0 + (e1 + e2) / 3.0 - p;
                let cross = e1.cross(e2);
                let d2 = to.length_squared();
                let cosines = (to.dot(n) * -to.dot(cross.normalize())).max(0.0) / d2;
                emitter_radiance(LIT_BOX.surfacelight) * cosines * cross.length() * 0.5 / (std::f64::consts::PI * d2)
            })
            .sum()
    });
    let mut settings = still(0, Sequence::Sobol, 5);
    settings.soft_shadows = false;
    let (film, _) = cpu.accumulate(&down(), SIZE, &settings, 0..4, &quiet);
    for (i, expected) in expected.iter().enumerate() {
        let got = f64::from(film.direct[i][0]);
        assert!(
            (got - expected).abs() <= 1e-5 * expected,
            "pixel {i}: {got} not {expected}"
        );
        assert_eq!(film.variance[i], 0.0);
    }
}
