//! Layers: exact order for any number of them, lit layers, shadows tinted and not, and geometry that moves by itself.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::{camera, gpu_film, project, quiet, scene};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::fixtures::Fixture;
use q3rays::assets::bsp::build::{Entity, MapBuilder, Mapping, Paint};
use q3rays::assets::bsp::lumps::surface_flags;
use q3rays::assets::image::decode_srgb;
use q3rays::gpu::Image;
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, Settings};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::clock::Clock;
use q3rays::scene::program::UNLIT;
use q3rays::scene::sampling::{key, unit};

fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        filter_textures: false,
        ..Settings::default()
    }
}

/// One of the ways that layers blend.
#[derive(Clone, Copy)]
enum Way {
    Add,
    Filter,
    Blend,
}

struct Layer {
    x: f32,
    way: Way,
    colour: Vec3,
    alpha: f32,
}

/// A stack of quads across the view along +x, in a box whose far wall glows.
fn stack(layers: &[Layer]) -> Fixture {
    let mut script = String::from(
        "textures/fixture/wall\n{\n\tsurfaceparm nolightmap\n\t{\n\t\tmap $whiteimage\n\t\trgbGen const ( 0.5 0.6 0.7 )\n\t}\n}\n",
    );
    for (i, l) in layers.iter().enumerate() {
        let blend = match l.way {
            Way::Add => "add",
            Way::Filter => "filter",
            Way::Blend => "blend",
        };
        let (c, a) = (l.colour, l.alpha);
        script += &format!(
            "textures/fixture/layer{i}\n{{\n\tsurfaceparm nolightmap\n\tsurfaceparm trans\n\tcull none\n\t{{\n\t\tmap \
             $whiteimage\n\t\tblendFunc {blend}\n\t\trgbGen const ( {} {} {} )\n\t\talphaGen const {a}\n\t}}\n}}\n",
            c.x, c.y, c.z
        );
    }
    boxed("stack", &script, |map, walls| {
        let paint = |map: &mut MapBuilder, name: &str| Paint {
            shader: map.shader(name, surface_flags::NOLIGHTMAP, 0),
            mapping: Mapping::Fit,
        };
        *walls = [Some(paint(map, "textures/fixture/wall")); 6];
        // In an order that is not the view's.
        let mut order: Vec<usize> = (0..layers.len()).collect();
        order.sort_by_key(|i| key(7, *i as u32, 0));
        for i in order {
            let paint = paint(map, &format!("textures/fixture/layer{i}"));
            let at = |y: f32, z: f32| Vec3::new(layers[i].x, y, z);
            let corners = [at(20.0, 20.0), at(20.0, 236.0), at(236.0, 236.0), at(236.0, 20.0)];
            map.quad(corners, paint);
        }
    })
}

/// What a ray along +x sees: the stack composed from back to front in linear light.
fn composed(layers: &[Layer]) -> Vec3 {
    let decode = |c: Vec3| c.map(decode_srgb);
    let mut seen = decode(Vec3::new(0.5, 0.6, 0.7)) * UNLIT;
    let mut sorted: Vec<&Layer> = layers.iter().collect();
    sorted.sort_by(|a, b| b.x.total_cmp(&a.x));
    for l in sorted {
        seen = match l.way {
            Way::Add => seen + decode(l.colour) * UNLIT,
            Way::Filter => seen * decode(l.colour),
            Way::Blend => seen * (1.0 - l.alpha) + decode(l.colour) * UNLIT * l.alpha,
        };
    }
    seen
}

fn random_stack(n: u32) -> Vec<Layer> {
    let number = |i: u32, d: u32| unit(key(n, i, d));
    (0..2 + n + n % 2)
        .map(|i| Layer {
            x: 40.0 + 200.0 * number(i, 0),
            way: [Way::Add, Way::Filter, Way::Blend][(number(i, 1) * 3.0) as usize],
            colour: Vec3::new(number(i, 2), number(i, 3), number(i, 4)),
            alpha: 0.1 + 0.8 * number(i, 5),
        })
        .collect()
}

#[test]
fn stacks_of_layers_agree_with_a_sorted_reference() {
    let size = (8, 8);
    let view = camera([10.0, 128.3, 127.8], 0.0, 0.0, 10.0);
    with_device(|device| {
        for n in 0..10 {
            let layers = random_stack(n);
            let scene = scene(&stack(&layers));
            let want = composed(&layers);
            let (cpu, _) = CpuRenderer::new(&scene).accumulate(&view, size, &settings(), 0..1, &quiet);
            let mut films = vec![("cpu", cpu)];
            for (name, backend) in [("bvh", Backend::Bvh), ("rayquery", Backend::RayQuery)] {
                let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
                films.push((name, gpu_film(&gpu, &view, size, &settings(), 1)));
            }
            for (name, film) in films {
                for p in &film.mean {
                    let off = (Vec3::from(*p) - want).abs().max_element();
                    assert!(
                        off <= 1e-4,
                        "stack {n} of {}, {name}: {p:?} is not {want}",
                        layers.len()
                    );
                }
                let parts = film.emission[0][0] + film.transparent[0][0] + film.direct[0][0];
                assert!((parts - film.mean[0][0]).abs() < 1e-5, "{name}");
            }
        }
    });
}

/// A box with a light under a ceiling and a layer between them, and the mean of the floor under it.
fn shaded_floor(blend: &str) -> f64 {
    let script = format!(
        "textures/fixture/layer\n{{\n\tsurfaceparm nolightmap\n\tsurfaceparm trans\n\tcull none\n\t{{\n\t\tmap \
         $whiteimage\n\t\t{blend}\n\t\trgbGen const ( 0.5 0.5 0.5 )\n\t}}\n}}\n"
    );
    let fixture = boxed("shade", &script, |map, _| {
        let paint = Paint {
            shader: map.shader("textures/fixture/layer", surface_flags::NOLIGHTMAP, 0),
            mapping: Mapping::Fit,
        };
        let at = |x: f32, y: f32| Vec3::new(x, y, 128.0);
        map.quad([at(1.0, 1.0), at(255.0, 1.0), at(255.0, 255.0), at(1.0, 255.0)], paint);
        map.entity(Entity::light(Vec3::new(128.0, 128.0, 200.0), 300.0, [1.0; 3]));
    });
    let scene = scene(&fixture);
    let view = camera([128.0, 128.0, 64.0], 90.0, 0.0, 40.0);
    let (film, _) = CpuRenderer::new(&scene).accumulate(&view, (8, 8), &settings(), 0..16, &quiet);
    film.direct.iter().map(|p| f64::from(p[1])).sum::<f64>() / film.direct.len() as f64
}

#[test]
fn shadow_rays_pass_what_adds_and_are_tinted_by_what_filters() {
    let free = shaded_floor("blendFunc GL_ZERO GL_ONE");
    let added = shaded_floor("blendFunc add");
    let filtered = shaded_floor("blendFunc filter");
    assert!(free > 0.0 && (added / free - 1.0).abs() < 1e-6);
    let want = f64::from(decode_srgb(0.5));
    assert!(
        (filtered / free - want).abs() < 1e-4,
        "{} is not {want}",
        filtered / free
    );
}

/// A box in which a wall bulges, a flag waves, a sprite turns, and a platform bobs.
fn machinery() -> Scene {
    let script = "textures/fixture/flag\n{\n\tcull none\n\tdeformVertexes wave 100 sin 0 8 0 0.5\n\tdeformVertexes move 0 12 \
                  6 sin 0 1 0 0.5\n\t{\n\t\tmap \
                  textures/fixture/grey128\n\t\trgbGen vertex\n\t}\n}\n\
                  textures/fixture/sprite\n{\n\tcull none\n\tdeformVertexes autosprite\n\t{\n\t\tmap \
                  textures/fixture/grey128\n\t\trgbGen vertex\n\t}\n}\n";
    let fixture = boxed("machinery", script, |map, _| {
        let mut paint = |name: &str| Paint {
            shader: map.shader(name, 0, 0),
            mapping: Mapping::Fit,
        };
        let (flag, sprite) = (paint("textures/fixture/flag"), paint("textures/fixture/sprite"));
        let at = |y: f32, z: f32| Vec3::new(200.0, y, z);
        map.quad(
            [at(20.0, 40.0), at(20.0, 120.0), at(110.0, 120.0), at(110.0, 40.0)],
            flag,
        );
        map.quad(
            [at(140.0, 40.0), at(140.0, 100.0), at(220.0, 100.0), at(220.0, 40.0)],
            sprite,
        );
        map.entity(Entity::light(Vec3::new(60.0, 128.0, 200.0), 300.0, [1.0; 3]));
    });
    scene(&fixture)
}

/// The same picture from all three at several moments; and points that move are where they were said to come from.
#[test]
fn geometry_that_moves_is_the_same_everywhere_and_knows_where_it_was() {
    let scene = machinery();
    assert_eq!(scene.geometry.dynamic.rest.len(), 8);
    let size = (48, 32);
    let view = camera([30.0, 120.3, 90.7], 0.0, 3.0, 80.0);
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            let cpu = CpuRenderer::new(&scene);
            for seconds in [0.0, 0.4, 1.3] {
                let at = Settings {
                    clock: Clock::from_seconds(seconds),
                    antialiasing: false,
                    ..settings()
                };
                let (want, _) = cpu.accumulate(&view, size, &at, 0..1, &quiet);
                let got = gpu_film(&gpu, &view, size, &at, 1);
                let same = |i: &usize| (0..3).all(|c| (want.mean[*i][c] - got.mean[*i][c]).abs() < 1e-4);
                let share = (0..want.mean.len()).filter(same).count() as f64 / want.mean.len() as f64;
                assert!(share > 0.995, "{backend} at {seconds} s: {share}");
            }
            moved_points(&gpu, &scene, size);
        }
    });
}

/// Two frames at two moments: where each point of the second frame was in the first, by the image `motion`, against the
/// vertices themselves.
fn moved_points(gpu: &SceneGpu, scene: &Scene, size: (u32, u32)) {
    let view_camera = camera([30.0, 120.3, 90.7], 0.0, 3.0, 80.0);
    let renderer = GpuRenderer::new(gpu).unwrap();
    let mut view = renderer.view(size).unwrap();
    let moments = [Clock::from_seconds(0.4), Clock::from_seconds(0.45)];
    for (index, clock) in (0..).zip(moments) {
        let input = FrameInput {
            camera: view_camera,
            settings: Settings {
                clock,
                antialiasing: false,
                ..settings()
            },
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated: 0,
            exposure_blend: 1.0,
            reuse: false,
            output: false,
        };
        renderer.frame(&mut view, &input).unwrap();
    }
    let words = |image: &Image| -> Vec<[u32; 4]> {
        let bytes = image.read_back(0).unwrap();
        bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect()
    };
    let (objects, motions) = (words(view.gbuffer.object()), words(view.gbuffer.motion()));
    let eye = Vec3::from(view_camera.eye);
    let at = |clock| {
        // The world's own surfaces deform here: nothing carries them.
        q3rays::scene::dynamic_geometry::all(scene, &[], clock, eye)
    };
    let [before, now] = moments.map(at);
    let first = scene.geometry.dynamic.vertices.start;
    let (mut seen, mut moved) = (0, 0);
    for (o, m) in objects.iter().zip(&motions) {
        let Some(t) = scene.geometry.triangles.get(o[0] as usize) else {
            continue;
        };
        if t.vertices[0] < first {
            continue;
        }
        let (b1, b2) = ((o[2] & 0xffff) as f32 / 65535.0, (o[2] >> 16) as f32 / 65535.0);
        let point = |vertices: &[q3rays::scene::dynamic_geometry::Moved]| {
            let [a, b, c] = t.vertices.map(|v| vertices[(v - first) as usize].position);
            a * (1.0 - b1 - b2) + b * b1 + c * b2
        };
        let (old, new) = (
            project(&view_camera, size, point(&before)),
            project(&view_camera, size, point(&now)),
        );
        for c in 0..2 {
            let motion = f32::from_bits(m[c]);
            assert!(
                (old[c] - new[c] - motion).abs() < 0.1,
                "{motion} is not {}",
                old[c] - new[c]
            );
            moved += usize::from(motion.abs() > 0.1);
        }
        seen += 1;
    }
    assert!(seen > 50 && moved > 10, "{seen} {moved}");
}

/// A box lit from a corner, with or without a mirror before its far wall.
fn mirrored(mirror: bool) -> Scene {
    let script = "textures/fixture/mirror\n{\n\tportal\n\tsurfaceparm nolightmap\n\t{\n\t\tmap $whiteimage\n\t\tblendFunc GL_ZERO \
                  GL_ONE\n\t\tdepthWrite\n\t}\n}\n";
    let fixture = boxed("mirrored", script, |map, _| {
        let paint = Paint {
            shader: map.shader("textures/fixture/mirror", surface_flags::NOLIGHTMAP, 0),
            mapping: Mapping::Fit,
        };
        if mirror {
            let at = |y: f32, z: f32| Vec3::new(240.0, y, z);
            map.quad([at(0.5, 0.5), at(0.5, 255.5), at(255.5, 255.5), at(255.5, 0.5)], paint);
        }
        map.entity(Entity::light(Vec3::new(40.0, 70.0, 210.0), 300.0, [1.0, 0.6, 0.3]));
    });
    scene(&fixture)
}

/// What a mirror shows is what an eye behind it sees, turned left to right; and its points move as their images do.
#[test]
fn a_mirror_shows_what_an_eye_behind_it_sees() {
    let (size, plane) = ((40, 30), 2.0 * 240.0);
    let still = Settings {
        random_lights: 0,
        soft_shadows: false,
        antialiasing: false,
        ..settings()
    };
    let before = camera([60.0, 120.3, 90.7], 0.0, 6.0, 60.0);
    let behind = camera([plane - 60.0, 120.3, 90.7], 0.0, 174.0, 60.0);
    let (with, without) = (mirrored(true), mirrored(false));
    assert_eq!((with.portals.len(), without.portals.len()), (1, 0));
    let (want, _) = CpuRenderer::new(&without).accumulate(&behind, size, &still, 0..1, &quiet);
    let agree = |name: &str, got: &[[f32; 3]]| {
        let differs = |i: &usize| {
            let (x, y) = (*i as u32 % size.0, *i as u32 / size.0);
            let other = want.mean[(y * size.0 + size.0 - 1 - x) as usize];
            (0..3).any(|c| (got[*i][c] - other[c]).abs() > 2e-3 * other[c] + 1e-5)
        };
        let off = (0..got.len()).filter(differs).count();
        assert!(off * 100 < got.len(), "{name}: {off} of {}", got.len());
    };
    let (cpu, _) = CpuRenderer::new(&with).accumulate(&before, size, &still, 0..1, &quiet);
    agree("cpu", &cpu.mean);
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &with, backend, BvhQuality::Balanced).unwrap();
            agree(&backend.to_string(), &gpu_film(&gpu, &before, size, &still, 1).mean);
        }
        let gpu = SceneGpu::new(device, &with, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut view = renderer.view(size).unwrap();
        let mut old = before;
        old.eye = [58.0, 123.3, 91.7];
        old.yaw += 2.0;
        for (index, c) in [(0, old), (1, before)] {
            let input = FrameInput {
                camera: c,
                settings: still,
                lights: &[],
                polygons: &[],
                entities: &[],
                sample_index: index,
                accumulated: 0,
                exposure_blend: 1.0,
                reuse: false,
                output: false,
            };
            renderer.frame(&mut view, &input).unwrap();
        }
        let floats = |image: &Image| -> Vec<[f32; 4]> {
            let bytes = image.read_back(0).unwrap();
            bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect()
        };
        for (p, m) in floats(view.gbuffer.position())
            .iter()
            .zip(floats(view.gbuffer.motion()))
        {
            let image = Vec3::new(plane - p[0], p[1], p[2]);
            let (now, then) = (project(&before, size, image), project(&old, size, image));
            for c in 0..2 {
                assert!((then[c] - now[c] - m[c]).abs() < 0.1, "{image}: {m:?}");
            }
        }
    });
}
