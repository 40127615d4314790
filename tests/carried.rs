//! What moves with something else: lights and deformations of brush models, lights that a frame brings along; and models that
//! are shown with less detail.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::{camera, gpu_film, installed, quiet, scene};
use glam::{Vec2, Vec3};
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::fixtures::Fixture;
use q3rays::assets::bsp::build::{Bounds, Entity, Mapping, Paint, Solid};
use q3rays::assets::bsp::lumps::{content_flags, surface_flags};
use q3rays::reference::CpuRenderer;
use q3rays::reference::light_cells;
use q3rays::render::backend::Backend;
use q3rays::render::film::Film;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{AmbientLight, LightSampling, Settings, ShownEmission};
use q3rays::scene::Scene;
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::camera::Camera;
use q3rays::scene::clock::Clock;
use q3rays::scene::entity_geometry::EntityState;
use q3rays::scene::guests::flashlight;
use q3rays::scene::light_power::luminance;
use q3rays::scene::lights::point_light;
use q3rays::scene::material::Visibility;
use q3rays::scene::polygons::{Corner, Polygon};
use q3rays::scene::records::{LIGHT_SUN, Light};

const SIZE: (u32, u32) = (32, 18);
const ALL_WAYS: [LightSampling; 5] = [
    LightSampling::Uniform,
    LightSampling::Power,
    LightSampling::Bvh,
    LightSampling::Cells,
    LightSampling::Reservoir,
];

fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        ..Settings::default()
    }
}

fn view() -> Camera {
    camera([20.0, 128.0, 128.0], 0.0, 0.0, 100.0)
}

fn cpu(scene: &Scene, settings: &Settings, n: u32) -> Film {
    CpuRenderer::new(scene)
        .accumulate(&view(), SIZE, settings, 0..n, &quiet)
        .0
}

fn mean(film: &Film) -> f32 {
    film.mean.iter().map(|p| luminance(*p)).sum::<f32>() / film.mean.len() as f32
}

/// Share of pixels in which two films differ by more than 2%.
fn apart(a: &Film, b: &Film) -> f32 {
    let differs = |(a, b): (&[f32; 3], &[f32; 3])| (luminance(*a) - luminance(*b)).abs() > 0.02 * luminance(*b) + 1e-4;
    let count = a.mean.iter().zip(&b.mean).filter(|p| differs(*p)).count();
    count as f32 / a.mean.len() as f32
}

/// A lamp in a box that an entity carries, and a weak one that stands.
fn lamp(class: &str, keys: &[(&str, &str)]) -> Fixture {
    let script = "textures/fixture/lamp\n{\n\tq3map_surfacelight 3000\n\tq3map_lightRGB 1 0.9 0.6\n\tq3map_backsplash 0 0\n\t{\n\t\tmap \
                  $whiteimage\n\t}\n}\n";
    boxed("lamp", script, |map, _| {
        let paint = Paint {
            shader: map.shader("textures/fixture/lamp", surface_flags::NODLIGHT, content_flags::SOLID),
            mapping: Mapping::Fit,
        };
        let mut faces = [None; 6];
        faces[0] = Some(paint);
        let lamp = Solid {
            bounds: Bounds::new([-6, -24, -12], [6, 24, 12]),
            faces,
            contents: paint.shader,
            carves: false,
        };
        let entity = keys.iter().fold(Entity::new(class), |e, (k, v)| e.with(k, v));
        map.brush_model(vec![lamp], entity);
        map.entity(Entity::light(Vec3::new(200.0, 40.0, 40.0), 40.0, [1.0; 3]));
    })
}

#[test]
fn lights_move_with_what_carries_them() {
    let bob = scene(&lamp(
        "func_bobbing",
        &[("origin", "180 128 128"), ("height", "70"), ("speed", "4")],
    ));
    let up = scene(&lamp("func_static", &[("origin", "180 128 198")]));
    let carried = bob.lights.lights.iter().filter(|l| l.instance != u32::MAX).count();
    assert_eq!(carried, 2, "a face of the lamp");
    assert!(up.lights.lights.iter().all(|l| l.instance == u32::MAX));
    let at = Settings {
        random_lights: 0,
        clock: Clock::from_seconds(1.0),
        ..settings()
    };
    let truth = cpu(&up, &at, 64);
    assert!(mean(&truth) > 0.02);
    let away = cpu(
        &bob,
        &Settings {
            clock: Clock::from_seconds(3.0),
            ..at
        },
        64,
    );
    let share = apart(&away, &truth);
    assert!(share > 0.25, "the lamp below lights other places: {share}");
    assert!(apart(&cpu(&bob, &at, 64), &truth) < 0.02);
    // Every way of choosing lights still finds them: the tree and the cells know where they may go.
    let mut bob = bob;
    light_cells::fill(&mut bob);
    for light_sampling in ALL_WAYS {
        let one = Settings {
            random_lights: 1,
            light_sampling,
            ..at
        };
        let ratio = mean(&cpu(&bob, &one, 512)) / mean(&truth);
        assert!((ratio - 1.0).abs() < 0.03, "{light_sampling:?}: {ratio}");
    }
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &bob, backend, BvhQuality::Balanced).unwrap();
            let film = gpu_film(&gpu, &view(), SIZE, &at, 64);
            assert!(apart(&film, &truth) < 0.02, "{backend:?}: {}", apart(&film, &truth));
        }
    });
}

/// A lamp on a door lights from where the door is.
#[test]
fn lights_move_with_doors() {
    let keys = [("origin", "180 128 128"), ("angle", "-1"), ("lip", "-36")];
    let door = scene(&lamp("func_door", &keys));
    let up = scene(&lamp("func_static", &[("origin", "180 128 158")]));
    let number = door.entities.iter().position(|e| e.class() == "func_door").unwrap() as u32;
    let at = Settings {
        random_lights: 0,
        ..settings()
    };
    let open = [EntityState {
        entity: number,
        offset: Vec3::Z * 30.0,
        hidden: false,
    }];
    let truth = cpu(&up, &at, 64);
    let rest = cpu(&door, &at, 64);
    assert!(apart(&rest, &truth) > 0.1);
    let mut opened = CpuRenderer::new(&door);
    opened.tracer.states = open.to_vec();
    let film = opened.accumulate(&view(), SIZE, &at, 0..64, &quiet).0;
    assert!(apart(&film, &truth) < 0.02, "{}", apart(&film, &truth));
    let one = Settings {
        random_lights: 1,
        light_sampling: LightSampling::Bvh,
        ..at
    };
    let film = opened.accumulate(&view(), SIZE, &one, 0..512, &quiet).0;
    assert!((mean(&film) / mean(&truth) - 1.0).abs() < 0.03);
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &door, backend, BvhQuality::Balanced).unwrap();
            let renderer = GpuRenderer::new(&gpu).unwrap();
            // It opens and closes again.
            for (entities, wanted) in [(&[][..], &rest), (&open, &truth), (&[], &rest)] {
                let mut seen = renderer.view(SIZE).unwrap();
                for index in 0..64 {
                    let input = FrameInput {
                        camera: view(),
                        settings: at,
                        lights: &[],
                        polygons: &[],
                        entities,
                        sample_index: index,
                        accumulated: index + 1,
                        exposure_blend: 1.0,
                        reuse: false,
                        output: false,
                    };
                    renderer.frame(&mut seen, &input).unwrap();
                }
                let film = q3rays::render::gpu_renderer::film(&seen, 64).unwrap();
                assert!(apart(&film, wanted) < 0.02, "{backend:?}: {}", apart(&film, wanted));
            }
        }
    });
}

#[test]
fn lamps_that_turn_light_where_they_face() {
    // After a quarter of a turn the lit face (which looks along −x) looks along −y.
    let turning = scene(&lamp("func_rotating", &[("origin", "180 128 128"), ("speed", "90")]));
    let at = Settings {
        random_lights: 0,
        clock: Clock::from_seconds(1.0),
        ..settings()
    };
    let start = cpu(
        &turning,
        &Settings {
            clock: Clock::default(),
            ..at
        },
        64,
    );
    let turned = cpu(&turning, &at, 64);
    assert!(apart(&start, &turned) > 0.3);
    for light_sampling in [LightSampling::Bvh, LightSampling::Reservoir] {
        let one = Settings {
            random_lights: 1,
            light_sampling,
            ..at
        };
        let ratio = mean(&cpu(&turning, &one, 512)) / mean(&turned);
        assert!((ratio - 1.0).abs() < 0.03, "{light_sampling:?}: {ratio}");
    }
}

/// A brush model whose surface moves by its script stands where its entity has it.
#[test]
fn brush_models_deform() {
    let script = "textures/fixture/flag\n{\n\tcull none\n\tdeformVertexes move 0 0 40 sawtooth 0 1 0 1\n\t{\n\t\tmap \
                  textures/fixture/grey128\n\t}\n\t{\n\t\tmap $lightmap\n\t\tblendFunc filter\n\t}\n}\n";
    let flag = |offset: i32| {
        boxed("flag", script, |map, _| {
            let paint = Paint {
                shader: map.shader("textures/fixture/flag", 0, content_flags::SOLID),
                mapping: Mapping::Fit,
            };
            let solid = Solid {
                bounds: Bounds::new([-4, -30, offset - 20], [4, 30, offset + 20]),
                faces: [Some(paint); 6],
                contents: paint.shader,
                carves: false,
            };
            let entity = Entity::new("func_static").with("origin", &format!("160 128 {}", 128 - offset));
            map.brush_model(vec![solid], entity);
            map.entity(Entity::light(Vec3::new(60.0, 128.0, 200.0), 300.0, [1.0; 3]));
        })
    };
    let (here, there) = (scene(&flag(0)), scene(&flag(64)));
    let part = &here.geometry.dynamic.parts[0];
    assert_eq!((here.geometry.dynamic.parts.len(), part.carrier), (1, 1));
    let at = |seconds: f64| Settings {
        random_lights: 0,
        clock: Clock::from_seconds(seconds),
        ..settings()
    };
    let (start, later) = (cpu(&here, &at(0.0), 16), cpu(&here, &at(0.5), 16));
    assert!(apart(&start, &later) > 0.01, "it has risen by 20 units");
    assert!(apart(&cpu(&there, &at(0.5), 16), &later) < 0.01);
    with_device(|device| {
        for backend in [Backend::Bvh, Backend::RayQuery] {
            let gpu = SceneGpu::new(device, &here, backend, BvhQuality::Balanced).unwrap();
            let film = gpu_film(&gpu, &view(), SIZE, &at(0.5), 16);
            assert!(apart(&film, &later) < 0.02, "{backend:?}: {}", apart(&film, &later));
        }
    });
}

#[test]
fn flags_wave() {
    let scene = common::real("oa_ctf4ish");
    let models = scene.bsp.models.len() as u32;
    let flags: Vec<_> = scene
        .geometry
        .dynamic
        .parts
        .iter()
        .filter(|p| p.carrier >= models)
        .collect();
    assert!(!flags.is_empty(), "the script of the flags deforms them");
    let tracer = CpuRenderer::new(&scene).tracer;
    let at = |seconds: f64| {
        let now = Settings {
            clock: Clock::from_seconds(seconds),
            ..settings()
        };
        tracer.at(&scene, &now, &view())
    };
    let (before, after) = (at(0.0), at(0.1));
    for flag in flags {
        let mesh = &scene.geometry.meshes[flag.mesh as usize];
        let triangles = mesh.first_triangle..mesh.first_triangle + mesh.triangle_count;
        let moved = triangles.map(|t| before.corners(&scene, t)[0].distance(after.corners(&scene, t)[0]));
        let most = moved.fold(0.0, f32::max);
        assert!(most > 0.05 && most < 40.0, "{most} units");
        let placed = scene.placements.iter().filter(|p| p.mesh == flag.mesh).count();
        let carriers = scene.placements.iter().filter(|p| p.mesh == flag.carrier).count();
        assert!(placed == carriers && placed > 0);
    }
}

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

#[test]
fn far_models_have_less_detail() {
    let scene = common::real("oa_dm1");
    let meshes = &scene.geometry.meshes;
    let item = scene.placements.iter().find(|p| !p.less_detailed.is_empty()).unwrap();
    let place = item.pose(Clock::default()).translation;
    let triangles = |distance: f32, lod_bias: i32| {
        let eye = [place.x - distance, place.y, place.z];
        let moment = Settings { lod_bias, ..settings() }.moment(&camera(eye, 0.0, 0.0, 90.0));
        meshes[item.record(meshes, &moment, &moment).mesh as usize].triangle_count
    };
    assert!(triangles(2000.0, 0) < triangles(20.0, 0));
    assert_eq!(triangles(2000.0, -2), triangles(20.0, 0));
    assert_eq!(triangles(20.0, 2), triangles(2000.0, 0));
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
                let mut view = renderer.view(SIZE).unwrap();
                for index in 0..16 {
                    let input = FrameInput {
                        camera: crate::view(),
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
                    renderer.frame(&mut view, &input).unwrap();
                }
                q3rays::render::gpu_renderer::film(&view, 16).unwrap()
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
            let mut view = renderer.view(SIZE).unwrap();
            let input = FrameInput {
                camera: crate::view(),
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
            assert!(renderer.frame(&mut view, &input).is_err());
        }
    });
}
