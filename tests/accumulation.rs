//! Samples add up: parts that are merged equal the one run, on every backend and through files, and a sum of many frames
//! keeps its precision.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::{quiet, real, spawn_camera};
use gpu_fixture::with_device;
use q3rays::output::exr_file::{read_film, write_film};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::{GpuRenderer, film};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::Settings;
use q3rays::scene::bvh::BvhQuality;
use std::ops::Range;
use std::path::Path;
use std::process::Command;

const SIZE: (u32, u32) = (48, 27);
const PARTS: [Range<u32>; 4] = [0..16, 16..32, 32..48, 48..64];
/// Relative error that single precision may leave.
const ROUNDING: f64 = 1e-6;

/// Largest relative difference of a plane; values below the mean's rounding count as it.
fn difference(what: &str, a: &[f32], b: &[f32]) {
    let scale = b.iter().map(|x| f64::from(x.abs())).sum::<f64>() / b.len() as f64;
    let worst = a
        .iter()
        .zip(b)
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(b.abs()).max(1e-3 * scale))
        .fold(0.0, f64::max);
    println!("{what}: {worst:.1e}");
    assert!(scale > 0.0, "{what}: nothing but zeros proves nothing");
    assert!(worst <= ROUNDING, "{what}: {worst:e}");
}

fn equal_to_rounding(what: &str, merged: &Film, whole: &Film) {
    assert_eq!(merged.samples, whole.samples, "{what}");
    assert!(whole.samples.iter().all(|n| *n == 64.0), "{what}");
    for (plane, a, b) in [
        ("mean", &merged.mean, &whole.mean),
        ("direct", &merged.direct, &whole.direct),
        ("emission", &merged.emission, &whole.emission),
    ] {
        difference(&format!("{what}, {plane}"), a.as_flattened(), b.as_flattened());
    }
    difference(&format!("{what}, variance"), &merged.variance, &whole.variance);
}

fn merge(parts: impl Iterator<Item = Film>) -> Film {
    parts
        .reduce(|mut a, b| {
            a.merge(&b).unwrap();
            a
        })
        .unwrap()
}

#[test]
fn four_parts_equal_the_whole() {
    let scene = real("showcase");
    let camera = spawn_camera(&scene, 0);
    let settings = Settings::default();
    let cpu = CpuRenderer::new(&scene);
    let part = |range: Range<u32>| cpu.accumulate(&camera, SIZE, &settings, range, &quiet).0;
    equal_to_rounding("cpu", &merge(PARTS.into_iter().map(part)), &part(0..64));
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let part = |range: Range<u32>| renderer.accumulate(&camera, SIZE, &settings, range, &quiet).unwrap().0;
        equal_to_rounding("bvh", &merge(PARTS.into_iter().map(part)), &part(0..64));
    });
}

fn program(arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_q3rays"))
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
}

#[test]
fn four_files_merged_equal_the_file_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let render = |first: u32, count: u32, out: &str| {
        let (first, count) = (first.to_string(), count.to_string());
        #[rustfmt::skip]
        program(&[
            "render", "showcase", "--backend", "cpu", "--size", "48x27", "--seed", "3",
            "--first-sample", &first, "--spp", &count, "--out", out,
        ]);
    };
    let parts = [0, 16, 32, 48].map(|first| {
        let out = path(&format!("part{first}.exr"));
        render(first, 16, &out);
        out
    });
    render(0, 64, &path("whole.exr"));
    let merged = path("merged.exr");
    let mut arguments = vec!["merge", &merged];
    arguments.extend(parts.iter().map(String::as_str));
    program(&arguments);
    let [merged, whole] = [merged, path("whole.exr")].map(|p| read_film(Path::new(&p)).unwrap());
    equal_to_rounding("files", &merged, &whole);
    // Parts are different samples: joining the same part four times would be no such thing.
    let [first, second] = [0, 1].map(|i: usize| read_film(Path::new(&parts[i])).unwrap());
    assert_ne!(first.mean, second.mean);
}

#[test]
fn a_film_survives_its_file() {
    let scene = real("showcase");
    let cpu = CpuRenderer::new(&scene);
    let (film, _) = cpu.accumulate(&spawn_camera(&scene, 1), (31, 17), &Settings::default(), 3..8, &quiet);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.exr");
    write_film(&path, &film, &[]).unwrap();
    assert_eq!(read_film(&path).unwrap(), film);
}

/// The sum of shaders/composite.comp in the same precision.
fn add_compensated(sum: &mut f32, lost: &mut f32, value: f32) {
    let y = value - *lost;
    let t = *sum + y;
    *lost = (t - *sum) - y;
    *sum = t;
}

/// Values like a pixel's: mostly dim, now and then a bright one.
fn radiance(i: u32) -> f32 {
    let unit = q3rays::scene::sampling::unit(q3rays::scene::sampling::pcg(i));
    if unit > 0.99 { 40.0 * unit } else { 0.3 * unit }
}

#[test]
fn a_million_frames_keep_their_mean() {
    const FRAMES: u32 = 1_000_000;
    let (mut sum, mut lost, mut plain, mut exact) = (0f32, 0f32, 0f32, 0f64);
    for i in 0..FRAMES {
        let value = radiance(i);
        add_compensated(&mut sum, &mut lost, value);
        plain += value;
        exact += f64::from(value);
    }
    let error = |s: f64| (s - exact).abs() / exact / f64::from(f32::EPSILON);
    let told = f64::from(sum) - f64::from(lost);
    println!(
        "compensated {:.3} ulp, plain {:.0} ulp",
        error(told),
        error(f64::from(plain))
    );
    assert!(error(told) <= 1.0);
    // A plain sum is what compensation is for; were it as good, this test could not fail.
    assert!(error(f64::from(plain)) > 10.0);
}

/// The shader itself: what a driver's compiler made of the compensation, frame by frame.
#[test]
fn the_gpu_accumulates_without_drift() {
    const FRAMES: u32 = 400;
    let scene = real("showcase");
    let camera = spawn_camera(&scene, 0);
    let settings = Settings::default();
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut view = renderer.view((8, 8)).unwrap();
        let mut exact = vec![[0f64; 3]; 64];
        let mut plain = vec![[0f32; 3]; 64];
        for n in 0..FRAMES {
            renderer
                .accumulate_one(&mut view, &camera, &settings, n, n + 1)
                .unwrap();
            let bytes = view.gbuffer.composite().read_back(0).unwrap();
            for (i, texel) in bytes.chunks_exact(16).enumerate() {
                let value: [f32; 4] = bytemuck::pod_read_unaligned(texel);
                for c in 0..3 {
                    exact[i][c] += f64::from(value[c]);
                    plain[i][c] += value[c];
                }
            }
        }
        let film = film(&view, FRAMES).unwrap();
        let worst = |mean: &dyn Fn(usize, usize) -> f64| {
            let errors = (0..64 * 3)
                .map(|j| (j / 3, j % 3))
                .filter(|&(i, c)| exact[i][c] > 0.0)
                .map(|(i, c)| {
                    let exact = exact[i][c] / f64::from(FRAMES);
                    (mean(i, c) - exact).abs() / exact / f64::from(f32::EPSILON)
                });
            errors.fold(0.0, f64::max)
        };
        let kept = worst(&|i, c| f64::from(film.mean[i][c]));
        let naive = worst(&|i, c| f64::from(plain[i][c]) / f64::from(FRAMES));
        let (direct, emission) = (&film.direct, &film.emission);
        let shares = worst(&|i, c| f64::from(direct[i][c]) + f64::from(emission[i][c]));
        println!("{FRAMES} frames: {kept:.2} ulp, shares {shares:.2} ulp, a plain sum {naive:.1} ulp");
        assert!(kept <= 1.0, "{kept} ulp");
        assert!(naive > 2.0, "{naive} ulp");
        assert!(shares <= 2.0, "the shares by source drift from their sum: {shares} ulp");
    });
}
