//! What `q3rays export` writes, read by another crate's reader; and light alone (`r_lightmap`), which such files are held against.

mod common;

use common::{camera, gpu_film, spawn_camera, still};
use glam::{Mat4, Vec3};
use q3rays::assets::vfs::Vfs;
use q3rays::content::embedded::EMBEDDED;
use q3rays::engine::{BackendChoice, Engine, Prepared};
use q3rays::export::{METRES_PER_UNIT, glb};
use q3rays::gpu::ValidationMode;
use q3rays::reference::CpuRenderer;
use q3rays::render::settings::{AmbientLight, Settings};
use q3rays::scene::Scene;
use q3rays::scene::camera::Shot;
use q3rays::scene::records::{LIGHT_SUN, LIGHT_TRIANGLE};
use q3rays::scene::sampling::Sequence;
use serde_json::Value;

fn showcase() -> Scene {
    Scene::load(&Vfs::mount(&[], EMBEDDED), "showcase").expect("the shipped map")
}

fn extras(text: &Option<Box<serde_json::value::RawValue>>) -> Option<Value> {
    let value: Value = serde_json::from_str(text.as_ref()?.get()).expect("JSON");
    Some(value["q3rays"].clone()).filter(|v| !v.is_null())
}

/// Area of a mesh's triangles, world units.
fn area(mesh: &gltf::Mesh<'_>, blob: &[u8]) -> f64 {
    mesh.primitives()
        .map(|p| {
            let reader = p.reader(|_| Some(blob));
            let at: Vec<Vec3> = reader.read_positions().expect("positions").map(Vec3::from).collect();
            let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
            let triangle = |t: &[u32]| {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| at[i as usize]);
                f64::from((b - a).cross(c - a).length()) * 0.5
            };
            indices.chunks_exact(3).map(triangle).sum::<f64>()
        })
        .sum()
}

/// All that lights is there with all its power, and stands where it stands.
#[test]
fn the_file_holds_the_lights_and_the_view() {
    let scene = showcase();
    let view = camera([100.0, -200.0, 64.0], 20.0, 130.0, 80.0);
    let bytes = glb(&scene, &Settings::default(), &view).expect("a file");
    let file = gltf::Gltf::from_slice(&bytes).expect("valid glTF");
    let blob = file.blob.clone().expect("binary");
    let (mut power, mut textured) = (Vec3::ZERO, 0);
    for node in file.nodes() {
        let (Some(mesh), Some(about)) = (node.mesh(), extras(node.extras())) else {
            continue;
        };
        let emission = &about["emission"];
        if emission.is_null() {
            continue;
        }
        let radiance: Vec<f32> = serde_json::from_value(emission["radiance"].clone()).expect("three numbers");
        let sides = if emission["two_sided"] == true { 2.0 } else { 1.0 };
        power += Vec3::from_slice(&radiance) * (area(&mesh, &blob) as f32 * sides);
        let material = mesh.primitives().next().expect("a primitive").material();
        let strength = material.emissive_strength().unwrap_or(1.0);
        let standard = Vec3::from(material.emissive_factor()) * strength;
        assert!((standard - Vec3::from_slice(&radiance)).abs().max_element() <= 1e-4 * strength);
        if emission["textured"] == true {
            textured += 1;
            assert!(material.emissive_texture().is_some());
        }
    }
    let wanted: Vec3 = scene
        .lights
        .lights
        .iter()
        .filter(|l| l.kind == LIGHT_TRIANGLE)
        .map(|l| {
            let sides = if l.flags & q3rays::scene::records::LIGHT_TWO_SIDED != 0 {
                2.0
            } else {
                1.0
            };
            Vec3::from(scene.materials[l.material as usize].emission) * (l.scale * l.size * sides)
        })
        .sum();
    assert!(
        (power - wanted).abs().max_element() < 1e-3 * wanted.max_element(),
        "{power} {wanted}"
    );
    assert!(textured > 0, "showcase has lamps with pictures");
    let suns = scene.lights.lights.iter().filter(|l| l.kind == LIGHT_SUN).count();
    let directional =
        |l: &gltf::khr_lights_punctual::Light<'_>| matches!(l.kind(), gltf::khr_lights_punctual::Kind::Directional);
    assert_eq!(file.lights().expect("lights").filter(directional).count(), suns);
    // Up and forward arrive as glTF has them: metres, y up, looking along −z.
    let root = file.default_scene().expect("a scene").nodes().next().expect("a root");
    let to_metres = Mat4::from_cols_array_2d(&root.transform().matrix());
    let up = to_metres.transform_vector3(Vec3::Z) / METRES_PER_UNIT;
    assert!((up - Vec3::Y).length() < 1e-5, "{up}");
    let eye = root.children().find(|n| n.camera().is_some()).expect("a camera");
    let pose = Mat4::from_cols_array_2d(&eye.transform().matrix());
    let axes = view.axes();
    assert!((pose.transform_vector3(Vec3::NEG_Z) - axes.forward).length() < 1e-5);
    assert!((pose.transform_vector3(Vec3::Y) - axes.up).length() < 1e-5);
    assert!((pose.transform_point3(Vec3::ZERO) - Vec3::from(view.eye)).length() < 1e-3);
}

/// Light alone, times the albedo, is the picture, where nothing see-through is before it; on the CPU and on the GPU.
#[test]
fn light_alone_is_what_the_picture_is_but_for_the_albedo() {
    let scene = showcase();
    let view = spawn_camera(&scene, 0);
    let size = (96, 54);
    let lit = Settings {
        antialiasing: false,
        ambient: AmbientLight::Off,
        ..still(0, Sequence::Sobol, 3)
    };
    let alone = Settings { white: true, ..lit };
    let cpu = CpuRenderer::new(&scene);
    let film = |settings: &Settings| {
        cpu.accumulate(Shot::from(&view), size, settings, 0..1, &common::quiet)
            .0
    };
    let (with, without) = (film(&alone), film(&lit));
    let albedo = cpu.aovs(&view, size, &lit).albedo;
    let equal = (0..albedo.len()).filter(|&i| {
        let expected = Vec3::from(with.direct[i]) * Vec3::from(albedo[i]);
        (expected - Vec3::from(without.direct[i])).abs().max_element() <= 1e-4 + 1e-3 * expected.max_element()
    });
    let share = equal.count() as f64 / albedo.len() as f64;
    assert!(share > 0.95, "{share}");
    let engine = Engine::choose(BackendChoice::Bvh, None, ValidationMode::Required)
        .expect("a device")
        .engine;
    let Ok(Prepared::Gpu(gpu)) = engine.prepare(&scene) else {
        panic!("the scene fits the device");
    };
    let on_gpu = gpu_film(&gpu, &view, size, &alone, 1);
    let mean = |film: &q3rays::render::film::Film| film.direct.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let ratio = mean(&on_gpu) / mean(&with);
    assert!((ratio - 1.0).abs() < 0.01 && mean(&with) > 0.0, "{ratio}");
}
