//! The secondary stage: glass, water and glossy surfaces, their energy, and that all backends agree on them.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use ash::vk;
use common::analytic::{SIZE, boxed};
use common::{camera, gpu_film, quiet, real, scene};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::{Entity, Mapping, Paint};
use q3rays::assets::bsp::lumps::surface_flags;
use q3rays::assets::image::decode_srgb;
use q3rays::gpu::{Buffer, MemoryKind};
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, Secondary, Settings, ShownEmission};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::program::UNLIT;

fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        ..Settings::default()
    }
}

/// Walls that shine evenly and reflect nothing.
const FURNACE: &str = "textures/fixture/wall\n{\n\tsurfaceparm nolightmap\n\t{\n\t\tmap $whiteimage\n\t\trgbGen const ( 0.5 0.5 \
                       0.5 )\n\t}\n}\n";

/// Radiance of those walls.
fn furnace() -> f32 {
    decode_srgb(0.5) * UNLIT
}

/// A furnace with a block of some material in it, its sides facing outwards.
fn block(material: &str) -> Scene {
    let script = format!("{FURNACE}textures/fixture/block\n{{\n{material}\n}}\n");
    let fixture = boxed("block", &script, |map, walls| {
        let mut paint = |name: &str| Paint {
            shader: map.shader(name, surface_flags::NOLIGHTMAP, 0),
            mapping: Mapping::Fit,
        };
        *walls = [Some(paint("textures/fixture/wall")); 6];
        let block = paint("textures/fixture/block");
        let (lo, hi) = (Vec3::splat(90.0), Vec3::new(170.0, 160.0, 150.0));
        let corner = |x: u8, y: u8, z: u8| {
            let pick = |bit: u8, lo: f32, hi: f32| if bit == 1 { hi } else { lo };
            Vec3::new(pick(x, lo.x, hi.x), pick(y, lo.y, hi.y), pick(z, lo.z, hi.z))
        };
        for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
            let at = |a: u8, b: u8| match axis {
                0 => corner(side, a, b),
                1 => corner(b, side, a),
                _ => corner(a, b, side),
            };
            let mut corners = [at(0, 0), at(0, 1), at(1, 1), at(1, 0)];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let outward = corners[0] - (lo + hi) * 0.5;
            if normal.dot(outward) < 0.0 {
                corners.reverse();
            }
            map.quad(corners, block);
        }
    });
    scene(&fixture)
}

fn views() -> [Camera; 3] {
    [
        camera([20.0, 128.3, 127.8], 0.0, 0.0, 70.0),
        camera([30.0, 40.0, 200.0], 30.0, 45.0, 60.0),
        // From inside the block.
        camera([130.0, 120.0, 120.0], 20.0, 200.0, 80.0),
    ]
}

fn mean(film: &Film) -> f64 {
    film.mean.iter().map(|p| f64::from(p[1])).sum::<f64>() / film.mean.len() as f64
}

const CLEAR: &str = "\tsurfaceparm nolightmap\n\tsurfaceparm trans\n\tcull none\n\t{\n\t\tmap $whiteimage\n\t\tblendFunc \
                     GL_ZERO GL_ONE\n\t}\n";

/// Energy: light that is everywhere the same stays so through glass, every pixel of it.
#[test]
fn a_block_of_glass_in_a_white_furnace_stays_white() {
    let glass = block(&format!("\trt_ior 1.5\n{CLEAR}"));
    let bare = block(CLEAR);
    let size = (24, 18);
    with_device(|device| {
        let gpu = SceneGpu::new(device, &glass, Backend::Bvh, BvhQuality::Balanced).unwrap();
        for view in views() {
            for (secondary, spp, most) in [(Secondary::Both, 2, 0.01), (Secondary::One, 64, 0.01)] {
                let at = Settings {
                    secondary,
                    ..settings()
                };
                let (cpu, _) = CpuRenderer::new(&glass).accumulate(&view, size, &at, 0..spp, &quiet);
                let gpu = gpu_film(&gpu, &view, size, &at, spp);
                for (name, film) in [("cpu", cpu), ("bvh", gpu)] {
                    for p in &film.mean {
                        let off = (p[1] / furnace() - 1.0).abs();
                        assert!(off < most, "{name} {secondary:?}: a pixel is off by {off}");
                    }
                }
            }
        }
        let (plain, _) = CpuRenderer::new(&bare).accumulate(&views()[0], size, &settings(), 0..1, &quiet);
        assert!((mean(&plain) / f64::from(furnace()) - 1.0).abs() < 1e-3);
    });
}

/// Energy of a lobe: it reflects its reflectance of light that is everywhere the same, less what its roughness swallows.
#[test]
fn a_glossy_block_reflects_its_share_of_a_furnace() {
    let stage = "\tsurfaceparm nolightmap\n\trt_roughness 0.2\n\t{\n\t\tmap textures/fixture/grey128.png\n\t\ttcGen \
                 environment\n\t}\n";
    let glossy = block(stage);
    let size = (16, 12);
    let view = camera([20.0, 125.0, 120.0], 0.0, 0.0, 10.0);
    let want = f64::from(decode_srgb(128.0 / 255.0) * furnace());
    with_device(|device| {
        let gpu = SceneGpu::new(device, &glossy, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let (cpu, _) = CpuRenderer::new(&glossy).accumulate(&view, size, &settings(), 0..32, &quiet);
        for (name, film) in [("cpu", cpu), ("bvh", gpu_film(&gpu, &view, size, &settings(), 32))] {
            let ratio = mean(&film) / want;
            assert!((0.99..=1.005).contains(&ratio), "{name}: {ratio}");
        }
    });
}

/// What a lobe reflects of a lamp does not depend on which of the two ways of sampling finds it.
#[test]
fn both_ways_of_sampling_a_lobe_agree() {
    let lamp = "textures/fixture/lamp\n{\n\tsurfaceparm nolightmap\n\tq3map_surfacelight 4000\n\tq3map_lightRGB 1 1 1\n\t{\n\t\tmap \
                $whiteimage\n\t\trgbGen identity\n\t}\n}\n";
    let floor = "textures/fixture/floor\n{\n\tsurfaceparm nolightmap\n\trt_roughness 0.4\n\t{\n\t\tmap \
                 textures/fixture/grey128.png\n\t\ttcGen environment\n\t}\n}\n";
    let make = |name: &str| {
        boxed(name, &format!("{lamp}{floor}"), |map, walls| {
            let mut paint = |name: &str| Paint {
                shader: map.shader(name, surface_flags::NOLIGHTMAP, 0),
                mapping: Mapping::Fit,
            };
            let (lamp, floor) = (paint("textures/fixture/lamp"), paint("textures/fixture/floor"));
            walls[4] = Some(floor);
            let at = |x: f32, y: f32| Vec3::new(x, y, 200.0);
            map.quad(
                [at(100.0, 100.0), at(160.0, 100.0), at(160.0, 150.0), at(100.0, 150.0)],
                lamp,
            );
        })
    };
    let scene = scene(&make("lobes"));
    assert!(scene.lights.lights.len() >= 2);
    let (size, n) = ((24, 18), 400);
    let view = camera([30.0, 128.0, 100.0], 35.0, 0.0, 60.0);
    for shown_emission in [ShownEmission::Game, ShownEmission::Radiance] {
        agree_on_lamps(&scene, &view, size, n, shown_emission);
    }
}

fn agree_on_lamps(scene: &Scene, view: &Camera, size: (u32, u32), n: u32, shown_emission: ShownEmission) {
    let soft = Settings {
        shown_emission,
        ..settings()
    };
    // Light samples at the lamps' middles count nothing in a lobe: its own directions find all of them.
    let alone = Settings {
        soft_shadows: false,
        ..soft
    };
    let cpu = CpuRenderer::new(scene);
    let seen = |s: &Settings| {
        let (film, _) = cpu.accumulate(view, size, s, 0..n, &quiet);
        let sum: f64 = film.transparent.iter().map(|p| f64::from(p[1])).sum();
        let error: f64 = film.variance.iter().map(|v| f64::from(*v)).sum::<f64>().sqrt();
        (sum, error)
    };
    let (both, error) = seen(&soft);
    let (lobe, lobe_error) = seen(&alone);
    assert!(both > 0.0);
    let sigma = (error * error + lobe_error * lobe_error).sqrt();
    assert!(
        (both - lobe).abs() < 5.0 * sigma + 1e-3 * both,
        "{both} {lobe} σ {sigma}"
    );
    assert!((both / lobe - 1.0).abs() < 0.03, "{both} {lobe}");
}

/// Both ways at every interface are what one at random comes to.
#[test]
fn one_way_at_random_is_right_in_the_mean() {
    let scene = real("am_thornish");
    let view = camera([832.0, -85.3, -593.5], 0.0, 180.0, 90.0);
    let (size, n) = ((48, 27), 256);
    let cpu = CpuRenderer::new(&scene);
    let seen = |secondary| {
        let at = Settings {
            secondary,
            ..settings()
        };
        cpu.accumulate(&view, size, &at, 0..n, &quiet).0
    };
    let (both, one, off) = (seen(Secondary::Both), seen(Secondary::One), seen(Secondary::Off));
    let sum = |f: &Film| f.mean.iter().map(|p| f64::from(p[1])).sum::<f64>();
    let sigma = [&both, &one]
        .iter()
        .flat_map(|f| &f.variance)
        .map(|v| f64::from(*v))
        .sum::<f64>()
        .sqrt();
    let gap = (sum(&both) - sum(&one)).abs();
    assert!(gap < 4.0 * sigma, "{gap} σ {sigma}");
    assert!(
        (sum(&both) - sum(&off)).abs() > 8.0 * sigma,
        "water shows nothing of its own here"
    );
}

/// The CPU and the GPU follow the same ways, on a map with water, glass and glossy walls; and where nothing branches off,
/// nothing is launched.
#[test]
fn backends_agree_on_what_branches_off() {
    let scene = real("am_thornish");
    let size = (64, 36);
    let at = Settings {
        antialiasing: false,
        ..settings()
    };
    let views = [
        camera([832.0, -85.3, -593.5], 0.0, 180.0, 90.0),
        camera([1115.9, 1029.3, -329.6], 0.0, 0.0, 90.0),
    ];
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            for view in &views {
                let (want, _) = CpuRenderer::new(&scene).accumulate(view, size, &at, 0..2, &quiet);
                let got = gpu_film(&gpu, view, size, &at, 2);
                let reflects = want.transparent.iter().filter(|p| p[1] > 0.0).count();
                assert!(reflects > 100, "{reflects}");
                let same = |i: &usize| {
                    (0..3).all(|c| (want.mean[*i][c] - got.mean[*i][c]).abs() < 1e-3 * want.mean[*i][c] + 1e-5)
                };
                let share = (0..want.mean.len()).filter(same).count() as f64 / want.mean.len() as f64;
                assert!(share > 0.99, "{backend}: {share}");
                let ratio = mean(&got) / mean(&want);
                assert!((ratio - 1.0).abs() < 5e-3, "{backend}: {ratio}");
            }
        }
        let dull = boxed("dull", "", |map, _| {
            map.entity(Entity::light(Vec3::splat(SIZE as f32 * 0.5), 300.0, [1.0; 3]));
        });
        let dull = common::scene(&dull);
        for (scene, launched) in [(&dull, None), (&block(&format!("\trt_ior 1.5\n{CLEAR}")), Some(0))] {
            let gpu = SceneGpu::new(device, scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            let mut view = renderer.view(size).unwrap();
            // Away from the block.
            let away = camera([80.0, 128.0, 128.0], 0.0, 180.0, 90.0);
            renderer.accumulate_one(&mut view, &away, &at, 0, 1).unwrap();
            let pixels = view.secondary_pixels.as_ref();
            let groups = pixels.map(|p| {
                let usage = vk::BufferUsageFlags::TRANSFER_DST;
                let words = Buffer::new(device, "words", 16, usage, MemoryKind::Readback).unwrap();
                device
                    .submit_once("read", |cmd| cmd.copy_buffer(&p.buffer, 0, &words, 0, 16))
                    .unwrap();
                words.read::<u32>().unwrap()[0]
            });
            assert_eq!(groups, launched);
        }
    });
}
