//! What a frame brings along: lights and polygons of its own; and the discs of suns.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::small_views::{ALL_WAYS, SIZE, apart, cpu, mean, settings, view};
use common::{camera, gpu_film, installed, quiet, scene};
use glam::{Vec2, Vec3};
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::{Entity, Mapping, Paint};
use q3rays::assets::bsp::lumps::surface_flags;
use q3rays::reference::CpuRenderer;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{Settings, ShownEmission};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::guests::flashlight;
use q3rays::scene::light_power::luminance;
use q3rays::scene::lights::point_light;
use q3rays::scene::material::Visibility;
use q3rays::scene::polygons::{Corner, Polygon};
use q3rays::scene::records::{LIGHT_SUN, Light};

/// A light that the frame brings along lights like one of the map.
#[test]
fn guests_light_like_lights_of_the_map() {
    let at = Vec3::new(90.0, 70.0, 190.0);
    let weak = |map: &mut q3rays::assets::bsp::build::MapBuilder| {
        map.entity(Entity::light(Vec3::new(200.0, 200.0, 40.0), 60.0, [1.0; 3]));
    };
    let with = scene(&boxed("with", "", |map, _| {
        weak(map);
        map.entity(Entity::light(at, 300.0, [1.0; 3]));
    }));
    let without = scene(&boxed("without", "", |map, _| weak(map)));
    let every = Settings {
        random_lights: 0,
        ..settings()
    };
    let truth = cpu(&with, &every, 64);
    let mut visited = CpuRenderer::new(&without);
    visited.tracer.guests = vec![point_light(at, 300.0, Vec3::ONE)];
    let guests = |settings: &Settings, n: u32| visited.accumulate(&view(), SIZE, settings, 0..n, &quiet).0;
    assert!(apart(&guests(&every, 64), &truth) < 0.02);
    for light_sampling in ALL_WAYS {
        let one = Settings {
            random_lights: 1,
            light_sampling,
            ..settings()
        };
        let ratio = mean(&guests(&one, 512)) / mean(&truth);
        assert!((ratio - 1.0).abs() < 0.02, "{light_sampling:?}: {ratio}");
    }
}

/// The flashlight, by CPU and GPU, with all lights and with one; and on the GPU a light of the frame's own, which goes again.
#[test]
fn flashlights_shine_where_one_looks() {
    let dark = scene(&boxed("dark", "", |_, _| {}));
    let on = Settings {
        random_lights: 0,
        flashlight: 300.0,
        ..settings()
    };
    let truth = cpu(&dark, &on, 64);
    let luminances: Vec<f32> = truth.mean.iter().map(|p| luminance(*p)).collect();
    let middle = luminances[(9 * 32 + 16) as usize];
    assert!(
        middle > 4.0 * luminances[0],
        "{middle} in the middle, {} in a corner",
        luminances[0]
    );
    assert_eq!(mean(&cpu(&dark, &settings(), 4)), 0.0);
    let beam = flashlight(&view(), 300.0);
    assert!(Vec3::from(beam.p0).distance(view().eye.into()) < 16.0, "in the hand");
    with_device(|device| {
        let gpu = SceneGpu::new(device, &dark, Backend::Bvh, BvhQuality::Balanced).unwrap();
        for random_lights in [0, 1] {
            let film = gpu_film(&gpu, &view(), SIZE, &Settings { random_lights, ..on }, 256);
            let ratio = mean(&film) / mean(&truth);
            assert!((ratio - 1.0).abs() < 0.01, "{random_lights}: {ratio}");
        }
        assert_eq!(mean(&gpu_film(&gpu, &view(), SIZE, &settings(), 4)), 0.0);
        // A light of the frame's own comes into a running view at its full brightness at once, and goes again: with reservoirs that
        // remember it, too.
        let renderer = GpuRenderer::new(&gpu).unwrap();
        let mut seen = renderer.view(SIZE).unwrap();
        let flash = [point_light(Vec3::new(120.0, 128.0, 128.0), 300.0, Vec3::ONE)];
        let mut visited = CpuRenderer::new(&dark);
        visited.tracer.guests = flash.to_vec();
        let wanted = visited
            .accumulate(&view(), SIZE, &Settings { flashlight: 0.0, ..on }, 0..64, &quiet)
            .0;
        let shown =
            |seen: &mut q3rays::render::view_state::ViewState, index: u32, lights: &[Light], settings: Settings| {
                let input = FrameInput {
                    camera: view(),
                    settings,
                    lights,
                    polygons: &[],
                    entities: &[],
                    sample_index: index,
                    accumulated: 0,
                    exposure_blend: 1.0,
                    reuse: true,
                    output: false,
                };
                renderer.frame(seen, &input).unwrap();
                let bytes = seen.gbuffer.direct().read_back(0).unwrap();
                let texels: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
                texels.iter().map(|t| luminance([t[0], t[1], t[2]])).sum::<f32>() / texels.len() as f32
            };
        let reusing = Settings {
            denoiser: false,
            taa: false,
            ..settings()
        };
        for index in 0..24 {
            assert_eq!(shown(&mut seen, index, &[], reusing), 0.0);
        }
        let first = shown(&mut seen, 24, &flash, reusing);
        let later: f32 = (25..33).map(|i| shown(&mut seen, i, &flash, reusing)).sum::<f32>() / 8.0;
        assert!((first / later - 1.0).abs() < 0.1, "{first} at once, {later} later");
        assert!(mean(&wanted) > 0.0 && later > 0.0);
        assert_eq!(shown(&mut seen, 33, &[], reusing), 0.0);
    });
}

/// The light of a sun's disc is what the sun gives to a surface that faces it.
#[test]
fn suns_are_as_bright_as_their_light() {
    let files = installed().focused_on("showcase");
    let scene = Scene::load(&files, "showcase").unwrap();
    let sun = scene.lights.lights.iter().find(|l| l.kind == LIGHT_SUN).unwrap();
    let [azimuth, elevation, radius] = sun.p1;
    let is_sky = |triangle: u32| {
        let material = scene.geometry.triangles[triangle as usize].material;
        scene.material_sources[material as usize].visibility == Visibility::Sky
    };
    // Below a surface of the sky, on the line to the sun.
    let eye = (0..scene.geometry.triangles.len() as u32)
        .filter(|t| is_sky(*t))
        .map(|t| {
            let corners = scene.geometry.corners(t);
            (corners[0] + corners[1] + corners[2]) / 3.0 - Vec3::from(sun.p0) * 64.0
        })
        .find(|eye| scene.bsp.cluster_at(*eye).is_some())
        .expect("a place under the sky");
    let fov = (4.0 * radius).to_degrees();
    let look = camera(eye.into(), -elevation.to_degrees(), azimuth.to_degrees(), fov);
    let size = (64, 64);
    let shown = |draw_sun: bool| Settings {
        draw_sun,
        shown_emission: ShownEmission::Radiance,
        antialiasing: true,
        ..settings()
    };
    let sum = |film: &Film| film.mean.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
    let cpu = |draw_sun: bool| {
        let film = CpuRenderer::new(&scene)
            .accumulate(&look, size, &shown(draw_sun), 0..16, &quiet)
            .0;
        sum(&film)
    };
    let pixel = (2.0 * f64::from(fov).to_radians() / 2.0).tan() / 64.0;
    let seen = (cpu(true) - cpu(false)) * pixel * pixel / std::f64::consts::PI;
    let given = f64::from(luminance(sun.radiance));
    assert!((seen / given - 1.0).abs() < 0.02, "{seen} seen, {given} given");
    with_device(|device| {
        let gpu = SceneGpu::new(device, &scene, Backend::Bvh, BvhQuality::Balanced).unwrap();
        let on = sum(&gpu_film(&gpu, &look, size, &shown(true), 16));
        assert!(
            (on / cpu(true) - 1.0).abs() < 0.02,
            "{on} on the GPU, {} on the CPU",
            cpu(true)
        );
    });
}

/// A mark on a wall that the frame brings along looks like the same quad built into the map, comes and goes, and there may be many.
#[test]
fn polygons_look_like_surfaces_of_the_map() {
    let script = "textures/fixture/mark\n{\n\tsurfaceparm trans\n\tcull none\n\t{\n\t\tmap $whiteimage\n\t\tblendFunc \
                  filter\n\t\trgbGen vertex\n\t}\n}\n";
    let (low, high) = (Vec3::new(255.9, 90.0, 90.0), Vec3::new(255.9, 160.0, 150.0));
    let corners = [
        low,
        Vec3::new(low.x, low.y, high.z),
        high,
        Vec3::new(low.x, high.y, low.z),
    ];
    let lit = |map: &mut q3rays::assets::bsp::build::MapBuilder| {
        map.entity(Entity::light(Vec3::new(60.0, 128.0, 200.0), 300.0, [1.0; 3]));
        // Something that deforms, whose vertices must not be taken for the polygons'.
        let flag = Paint {
            shader: map.shader("textures/fixture/flag", 0, 0),
            mapping: Mapping::Fit,
        };
        let at = |y: f32, z: f32| Vec3::new(230.0, y, z);
        map.quad(
            [at(200.0, 20.0), at(200.0, 60.0), at(240.0, 60.0), at(240.0, 20.0)],
            flag,
        );
    };
    let grey = script.replace("rgbGen vertex", "rgbGen const ( 0.5 0.5 0.5 )")
        + "textures/fixture/flag\n{\n\tcull none\n\tdeformVertexes move 0 0 9 sin 0 1 0 1\n\t{\n\t\tmap textures/fixture/grey128\n\t}\n\t{\n\t\tmap \
           $lightmap\n\t\tblendFunc filter\n\t}\n}\n";
    let built = scene(&boxed("built", &grey, |map, _| {
        let paint = Paint {
            shader: map.shader("textures/fixture/mark", surface_flags::NOLIGHTMAP, 0),
            mapping: Mapping::Fit,
        };
        map.quad(corners, paint);
        lit(map);
    }));
    let bare = boxed("bare", &grey, |map, _| lit(map));
    let options = q3rays::scene::load::LoadOptions {
        polygons: 256,
        materials: vec!["textures/fixture/mark".to_owned()],
        ..Default::default()
    };
    let files = common::Files(bare.files());
    let mut scene = Scene::load_with(&files, "bare", &options).unwrap();
    let material = scene.material("textures/fixture/mark").unwrap();
    let polygon = |corners: &[Vec3]| Polygon {
        material,
        corners: corners
            .iter()
            .map(|p| Corner {
                position: *p,
                uv: Vec2::ZERO,
                color: [255; 4],
            })
            .collect(),
    };
    let mark = polygon(&corners);
    let (every, none) = (
        Settings {
            random_lights: 0,
            ..settings()
        },
        cpu(&scene, &settings(), 1),
    );
    let bare_film = cpu(&scene, &every, 16);
    let truth = cpu(&built, &every, 16);
    assert!(apart(&truth, &bare_film) > 0.02 && none.mean.len() == truth.mean.len());
    // Many small ones elsewhere: the tree has more than one node.
    let mut all: Vec<Polygon> = (0..100)
        .map(|i| {
            let at = Vec3::new(128.0, 2.0 * i as f32, 2.0);
            polygon(&[at, at + Vec3::Y, at + Vec3::Z])
        })
        .collect();
    let crumbs = all.clone();
    all.push(mark.clone());
    scene.set_polygons(std::slice::from_ref(&mark)).unwrap();
    assert!(apart(&cpu(&scene, &every, 16), &truth) < 0.01);
    let too_many: Vec<Polygon> = (0..300).map(|_| mark.clone()).collect();
    let refused = scene.set_polygons(&too_many).unwrap_err().to_string();
    assert!(
        refused.contains("bare") && refused.contains("600") && refused.contains("256"),
        "{refused}"
    );
    scene.set_polygons(&all).unwrap();
    let with_crumbs = cpu(&scene, &every, 16);
    scene.set_polygons(&[]).unwrap();
    assert_eq!(apart(&cpu(&scene, &every, 16), &bare_film), 0.0);
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &scene, backend, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            let film = |polygons: &[Polygon]| {
                let mut seen = renderer.view(SIZE).unwrap();
                for index in 0..16 {
                    let input = FrameInput {
                        camera: view(),
                        settings: every,
                        lights: &[],
                        polygons,
                        entities: &[],
                        sample_index: index,
                        accumulated: index + 1,
                        exposure_blend: 1.0,
                        reuse: false,
                        output: false,
                    };
                    renderer.frame(&mut seen, &input).unwrap();
                }
                q3rays::render::gpu_renderer::film(&seen, 16).unwrap()
            };
            for (polygons, wanted) in [
                (&[][..], &bare_film),
                (std::slice::from_ref(&mark), &truth),
                (&all, &with_crumbs),
                (&crumbs, &with_crumbs),
                (&[], &bare_film),
            ] {
                let share = apart(&film(polygons), wanted);
                // The mark is missing from the last but one.
                let same = polygons.len() != crumbs.len();
                assert_eq!(share < 0.02, same, "{backend:?}, {} polygons: {share}", polygons.len());
            }
            let mut seen = renderer.view(SIZE).unwrap();
            let input = FrameInput {
                camera: view(),
                settings: every,
                lights: &[],
                polygons: &too_many,
                entities: &[],
                sample_index: 0,
                accumulated: 1,
                exposure_blend: 1.0,
                reuse: false,
                output: false,
            };
            assert!(renderer.frame(&mut seen, &input).is_err());
        }
    });
}
