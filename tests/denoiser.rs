//! The denoiser and temporal anti-aliasing: less error, the same energy, no memory of what no longer holds.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::sunlit;
use common::{camera, gpu_film, project, real, scene, spawn_camera};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::console::table::VIEWS;
use q3rays::gpu::Image;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::{GpuRenderer, floats, radiance};
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, LightSampling, Settings};
use q3rays::render::view_state::ViewState;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::records::Light;
use q3rays::scene::sampling::{key, unit};

const SIZE: (u32, u32) = (160, 90);

fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        // An odd number of levels: the result is in `filter_b`.
        atrous_levels: 5,
        ..Settings::default()
    }
}

fn input(camera: &Camera, settings: &Settings, index: u32) -> FrameInput<'static> {
    FrameInput {
        camera: *camera,
        settings: *settings,
        lights: &[],
        polygons: &[],
        entities: &[],
        sample_index: index,
        accumulated: 0,
        exposure_blend: 1.0,
        reuse: true,
        output: true,
    }
}

fn run(
    renderer: &GpuRenderer,
    view: &mut ViewState,
    camera: &Camera,
    settings: &Settings,
    frames: std::ops::Range<u32>,
) {
    for index in frames {
        renderer.frame(view, &input(camera, settings, index)).unwrap();
    }
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|c| f64::from(*c)).sum::<f64>() / (3 * pixels.len()) as f64
}

/// Relative squared error without the worst 0.1% of pixels.
fn error(image: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let floor = 0.01 * mean(truth).powi(2);
    let mut errors: Vec<f64> = image
        .iter()
        .zip(truth)
        .map(|(a, b)| {
            (0..3)
                .map(|c| {
                    let (a, b) = (f64::from(a[c]), f64::from(b[c]));
                    (a - b).powi(2) / (b * b + floor) / 3.0
                })
                .sum()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.truncate(errors.len() - errors.len() / 1000);
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Irradiance of an image in the packing of `shaders/include/packed.glsl`.
fn unpack(image: &Image) -> Vec<[f32; 3]> {
    let words = image.read_back(0).unwrap();
    words
        .chunks_exact(8)
        .map(|t| {
            let word = |i: usize| u16::from_le_bytes([t[2 * i], t[2 * i + 1]]);
            let scale = 2f32.powi(i32::from(word(3) & 0xff) - 100 - 16);
            [0, 1, 2].map(|i| f32::from(word(i)) * scale)
        })
        .collect()
}

#[test]
fn denoised_frames_have_less_error_and_the_same_mean() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 1);
        let mut reference = None;
        // Ray queries of a CPU take long: a few frames show that they are denoised alike.
        for (backend, most) in [(Backend::Bvh, 48), (Backend::RayQuery, 8)] {
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            // One place per pixel: small lamps would make the mean a matter of where their edges are.
            let one = Settings {
                antialiasing: false,
                ..settings()
            };
            let many = Settings {
                random_lights: 4,
                candidates: 4,
                seed: 99,
                ..one
            };
            let truth = reference.get_or_insert_with(|| gpu_film(&gpu, &camera, SIZE, &many, 256).mean);
            let truth: &[[f32; 3]] = truth;
            let raw = error(&gpu_film(&gpu, &camera, SIZE, &one, 1).mean, truth);
            let mut view = renderer.view(SIZE).unwrap();
            for (frames, least) in [(0..8, 10.0), (8..48, 20.0)] {
                let last = frames.end;
                if last > most {
                    break;
                }
                run(&renderer, &mut view, &camera, &one, frames);
                let image = radiance(&view).unwrap();
                let (e, ratio) = (error(&image, truth), mean(&image) / mean(truth));
                println!("{backend}, {last} frames: {:.1} times less, mean {ratio:.4}", raw / e);
                assert!(raw > least * e, "{backend}, {last} frames: {e} of {raw}");
                assert!((ratio - 1.0).abs() < 0.02, "{backend}, {last} frames: mean {ratio}");
            }
            if most < 48 {
                continue;
            }
            // The same view, now moving into place: less than a raw frame by far, too. Anti-aliasing would blur the textures of
            // so small an image by more than the noise that is left (docs/denoiser.md).
            let one = Settings { taa: false, ..one };
            let mut view = renderer.view(SIZE).unwrap();
            let right = camera.axes().right;
            for index in 0..24 {
                let left = (23 - index) as f32;
                let mut c = camera;
                c.eye = std::array::from_fn(|i| c.eye[i] - right[i] * left);
                c.yaw -= 0.5 * left;
                renderer.frame(&mut view, &input(&c, &one, 100 + index)).unwrap();
            }
            let moved = error(&radiance(&view).unwrap(), truth);
            println!("{backend}, moving: {:.1} times less", raw / moved);
            assert!(raw > 10.0 * moved, "{backend}, moving: {moved} of {raw}");
        }
    });
}

/// What one pixel gives its neighbour gets: levels leave the sum as it is.
#[test]
fn the_filter_keeps_energy() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let irradiance = |levels: u32| {
            let one = Settings {
                atrous_levels: levels,
                ..settings()
            };
            let mut view = renderer.view(SIZE).unwrap();
            run(&renderer, &mut view, &camera, &one, 0..1);
            let g = &view.gbuffer;
            unpack(if levels % 2 == 1 { g.filter_b() } else { g.filter_a() })
        };
        let before = irradiance(0);
        for levels in 1..=5 {
            let after = irradiance(levels);
            let ratio = mean(&after) / mean(&before);
            println!("{levels} levels: {ratio:.6}");
            assert!((ratio - 1.0).abs() < 2e-4, "{levels} levels: {ratio}");
            assert!(after != before, "{levels} levels change nothing");
        }
    });
}

/// A sun without extent over a plane gives every pixel the same irradiance, which nothing may change.
#[test]
fn a_constant_image_stays_constant() {
    with_device(|device| {
        let scene = scene(&sunlit((200.0, 30.0, 80.0, 0.0)));
        let down = camera([128.3, 127.6, 100.2], 88.0, 0.4, 60.0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let one = Settings {
            soft_shadows: false,
            random_lights: 0,
            ..settings()
        };
        let mut view = renderer.view(SIZE).unwrap();
        run(&renderer, &mut view, &down, &one, 0..24);
        let direct: Vec<f32> = view
            .gbuffer
            .direct()
            .read_back(0)
            .unwrap()
            .chunks_exact(16)
            .map(|t| f32::from_le_bytes([t[0], t[1], t[2], t[3]]))
            .collect();
        let lit = direct[direct.len() / 2];
        assert!(
            lit > 0.0 && direct.iter().all(|d| (d / lit - 1.0).abs() < 1e-5),
            "the fixture is not constant"
        );
        for (i, p) in unpack(view.gbuffer.filter_b()).iter().enumerate() {
            assert!((p[0] / lit - 1.0).abs() < 1e-4, "pixel {i}: {} of {lit}", p[0]);
        }
    });
}

/// After any setting has changed a view shows what a new one shows, bit for bit.
#[test]
fn nothing_of_old_settings_remains() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let base = Settings {
            exposure: 1.0,
            // Light samples are kept through changes that leave them as good as before.
            light_reuse: false,
            ..settings()
        };
        let changes = [
            Settings {
                soft_shadows: false,
                ..base
            },
            Settings {
                denoiser: false,
                ..base
            },
            Settings { taa: false, ..base },
            Settings {
                atrous_levels: 2,
                ..base
            },
            Settings {
                light_sampling: LightSampling::Uniform,
                ..base
            },
            Settings {
                illumination: false,
                ..base
            },
            Settings { seed: 7, ..base },
            // A view of a level of the filter ends there.
            Settings {
                view: VIEWS.iter().position(|v| *v == "atrous0").unwrap() as u32,
                ..base
            },
        ];
        let size = (64, 36);
        let mut fresh = renderer.view(size).unwrap();
        run(&renderer, &mut fresh, &camera, &base, 20..23);
        let wanted = radiance(&fresh).unwrap();
        for (i, other) in changes.iter().enumerate() {
            let mut view = renderer.view(size).unwrap();
            run(&renderer, &mut view, &camera, &base, 0..3);
            run(&renderer, &mut view, &camera, other, 3..6);
            run(&renderer, &mut view, &camera, &base, 20..23);
            assert!(radiance(&view).unwrap() == wanted, "change {i}");
        }
        // Averaged frames in between leave nothing either.
        let mut view = renderer.view(size).unwrap();
        run(&renderer, &mut view, &camera, &base, 0..3);
        for index in 0..2 {
            renderer
                .accumulate_one(&mut view, &camera, &base, index, index + 1)
                .unwrap();
        }
        run(&renderer, &mut view, &camera, &base, 20..23);
        assert!(radiance(&view).unwrap() == wanted, "averaged frames");
        // The curve of the display is no reason to begin anew.
        let mut view = renderer.view(size).unwrap();
        run(&renderer, &mut view, &camera, &base, 0..3);
        run(&renderer, &mut view, &camera, &base, 20..23);
        assert!(radiance(&view).unwrap() != wanted, "nothing was kept");
    });
}

/// Frames until the image's mean is within 10% of the new truth when all lights go down to a fifth.
fn frames_to_follow(renderer: &GpuRenderer, scene: &q3rays::scene::Scene, camera: &Camera, settings: &Settings) -> u32 {
    let lights = &scene.lights.lights;
    let dimmed: Vec<Light> = lights
        .iter()
        .map(|l| Light {
            radiance: l.radiance.map(|c| c * 0.2),
            scale: l.scale * 0.2,
            ..*l
        })
        .collect();
    let irradiance = |view: &ViewState| mean(&unpack(view.gbuffer.filter_b()));
    let mut view = renderer.view(SIZE).unwrap();
    renderer.scene.update_lights(0, lights).unwrap();
    run(renderer, &mut view, camera, settings, 0..24);
    let before = irradiance(&view);
    renderer.scene.update_lights(0, &dimmed).unwrap();
    for index in 24..88 {
        run(renderer, &mut view, camera, settings, index..index + 1);
        if (irradiance(&view) / (0.2 * before) - 1.0).abs() < 0.1 {
            return index - 23;
        }
    }
    u32::MAX
}

#[test]
fn lights_that_go_down_are_seen_at_once_with_gradients() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        for (sampling, reuse) in [(LightSampling::Reservoir, true), (LightSampling::Cells, false)] {
            let with = Settings {
                light_sampling: sampling,
                reuse_denoised: reuse,
                ..settings()
            };
            let without = Settings {
                gradients: false,
                ..with
            };
            let a = frames_to_follow(&renderer, &scene, &camera, &with);
            let b = frames_to_follow(&renderer, &scene, &camera, &without);
            println!("{sampling:?}: {a} frames with gradients, {b} without");
            assert!(a <= 4, "{sampling:?}: {a} frames");
            assert!(b > 4 * a, "{sampling:?}: {b} frames without gradients, {a} with them");
        }
    });
}

/// Motion vectors against the projection of what a pixel shows.
#[test]
fn motion_vectors_are_where_the_points_were() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut old = camera;
        old.eye = [camera.eye[0] + 3.0, camera.eye[1] - 5.0, camera.eye[2] + 2.0];
        old.yaw += 2.0;
        old.pitch -= 1.0;
        let mut view = renderer.view(SIZE).unwrap();
        run(&renderer, &mut view, &old, &settings(), 0..1);
        run(&renderer, &mut view, &camera, &settings(), 1..2);
        let positions = floats(view.gbuffer.position()).unwrap();
        let motions = floats(view.gbuffer.motion()).unwrap();
        let mut seen = 0;
        for (p, m) in positions.iter().zip(&motions) {
            let point = Vec3::new(p[0], p[1], p[2]);
            if p[3] <= 0.0 || (point - Vec3::from(old.eye)).dot(old.axes().forward) < 1.0 {
                continue;
            }
            let (now, before) = (project(&camera, SIZE, point), project(&old, SIZE, point));
            for c in 0..2 {
                assert!((before[c] - now[c] - m[c]).abs() < 0.1, "{point}: {m:?}");
            }
            seen += 1;
        }
        assert!(seen > positions.len() / 2);
    });
}

/// Where nothing moves, anti-aliasing comes to the mean over the pixel.
#[test]
fn still_frames_come_to_the_accumulated_image() {
    with_device(|device| {
        let scene = real("oa_minia");
        let camera = spawn_camera(&scene, 0);
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        // Unlit: nothing but edges and textures is left to chance.
        let unlit = Settings {
            illumination: false,
            ..settings()
        };
        let truth = gpu_film(&gpu, &camera, SIZE, &unlit, 512).mean;
        let mut view = renderer.view(SIZE).unwrap();
        run(&renderer, &mut view, &camera, &unlit, 0..1);
        let first = error(&radiance(&view).unwrap(), &truth);
        run(&renderer, &mut view, &camera, &unlit, 1..128);
        let last = error(&radiance(&view).unwrap(), &truth);
        println!("one frame {first:.2e}, 128 frames {last:.2e}");
        assert!(last < 2e-4 && last * 100.0 < first, "{last} after {first}");
    });
}

/// Random views and settings over 10,000 frames: no value of any history is ever other than finite.
#[test]
fn histories_stay_finite() {
    wander(10_000);
}

fn wander(frames: u32) {
    with_device(|device| {
        let scene = real("oa_minia");
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut view = renderer.view((48, 27)).unwrap();
        let mut camera = spawn_camera(&scene, 0);
        let mut s = settings();
        for index in 0..frames {
            let random = |dimension: u32| unit(key(5, index, dimension));
            camera.eye = std::array::from_fn(|i| camera.eye[i] + (random(i as u32) - 0.5) * 12.0);
            camera.yaw += (random(3) - 0.5) * 20.0;
            if random(4) < 0.02 {
                // Anywhere, also in the solid.
                let spawn = (random(5) * scene.spawns.len() as f32) as usize;
                camera = spawn_camera(&scene, spawn.min(scene.spawns.len() - 1));
                camera.pitch = (random(6) - 0.5) * 180.0;
                camera.eye[2] += (random(7) - 0.5) * 200.0;
            }
            if random(8) < 0.05 {
                match (random(9) * 8.0) as u32 {
                    6 => s.reuse_denoised = !s.reuse_denoised,
                    0 => s.denoiser = !s.denoiser,
                    1 => s.taa = !s.taa,
                    2 => s.atrous_levels = (random(10) * 6.0) as u32,
                    3 => s.fireflies = if s.fireflies > 0.0 { 0.0 } else { 3.0 },
                    4 => s.aperture = if s.aperture > 0.0 { 0.0 } else { 4.0 },
                    5 => {
                        s.light_sampling = if s.light_sampling == LightSampling::Reservoir {
                            LightSampling::Uniform
                        } else {
                            LightSampling::Reservoir
                        }
                    }
                    _ => s.taa_gamma = 0.25 + random(11) * 4.0,
                }
            }
            renderer.frame(&mut view, &input(&camera, &s, index)).unwrap();
            if index % 16 == 15 {
                let g = &view.gbuffer;
                for image in [g.taa().now(g.parity), g.composite(), g.moments().now(g.parity)] {
                    let pixels = floats(image).unwrap();
                    assert!(pixels.iter().flatten().all(|v| v.is_finite()), "frame {index}: {s:?}");
                }
            }
        }
    });
}
