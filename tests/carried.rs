//! What moves with something else: lights and deformations of brush models; and models that are shown with less
//! detail.

mod common;
#[allow(dead_code, reason = "part of a shared module")]
mod gpu_fixture;

use common::analytic::boxed;
use common::small_views::{ALL_WAYS, SIZE, apart, cpu, mean, settings, view};
use common::{camera, gpu_film, quiet, scene};
use glam::Vec3;
use gpu_fixture::with_device;
use q3rays::assets::bsp::build::fixtures::Fixture;
use q3rays::assets::bsp::build::{Bounds, Entity, Mapping, Paint, Solid};
use q3rays::assets::bsp::lumps::{content_flags, surface_flags};
use q3rays::reference::CpuRenderer;
use q3rays::reference::light_cells;
use q3rays::render::backend::Backend;
use q3rays::render::frame::FrameInput;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{LightSampling, Settings};
use q3rays::scene::bvh::BvhQuality;
use q3rays::scene::clock::Clock;
use q3rays::scene::entity_geometry::EntityState;

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
