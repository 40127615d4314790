//! One light alone, and the terms of its light: their product is the light, and the lights' sum is the picture.

mod common;

use common::{gpu_film, quiet, spawn_camera, still};
use glam::Vec3;
use q3rays::assets::vfs::Vfs;
use q3rays::content::embedded::EMBEDDED;
use q3rays::engine::{BackendChoice, Engine, Prepared};
use q3rays::gpu::ValidationMode;
use q3rays::reference::CpuRenderer;
use q3rays::reference::direct::strongest_light;
use q3rays::render::film::Film;
use q3rays::render::settings::{AmbientLight, LightTerm, Settings};
use q3rays::scene::Scene;
use q3rays::scene::camera::Shot;
use q3rays::scene::sampling::Sequence;

const SIZE: (u32, u32) = (96, 54);

/// One sample of light alone.
fn base() -> Settings {
    Settings {
        white: true,
        ambient: AmbientLight::Off,
        ..still(0, Sequence::Sobol, 5)
    }
}

fn solo(light: u32, light_term: LightTerm) -> Settings {
    Settings {
        solo_light: Some(light),
        light_term,
        ..base()
    }
}

/// The light is the product of its terms in every pixel, and there is light.
fn product(film: &dyn Fn(&Settings) -> Film, light: u32) {
    let planes = [
        LightTerm::All,
        LightTerm::Visibility,
        LightTerm::Geometry,
        LightTerm::Emission,
    ];
    let [all, visibility, geometry, emission] = planes.map(|t| film(&solo(light, t)).direct);
    let (mut lit, mut hidden) = (0, 0);
    for i in 0..all.len() {
        let of = |plane: &Vec<[f32; 3]>| Vec3::from(plane[i]);
        let product = of(&visibility) * of(&geometry) * of(&emission);
        let off = (product - of(&all)).abs().max_element();
        assert!(
            off <= 1e-5 * (1.0 + product.max_element()),
            "pixel {i}: {product} is not {}",
            of(&all)
        );
        lit += usize::from(of(&all) != Vec3::ZERO);
        hidden += usize::from(of(&geometry) != Vec3::ZERO && of(&visibility) == Vec3::ZERO);
    }
    assert!(lit > 200 && hidden > 200, "{lit} pixels lit, {hidden} in shadow");
}

#[test]
fn light_is_the_product_of_its_terms_and_the_sum_of_its_lights() {
    let scene = Scene::load(&Vfs::mount(&[], EMBEDDED), "showcase").expect("the shipped map");
    let view = spawn_camera(&scene, 0);
    let renderer = CpuRenderer::new(&scene);
    let cpu = |settings: &Settings| renderer.accumulate(Shot::from(&view), SIZE, settings, 0..1, &quiet).0;
    let light = strongest_light(&scene, &view);
    product(&cpu, light);

    let whole = cpu(&base()).direct;
    let mut sum = vec![Vec3::ZERO; whole.len()];
    for light in 0..scene.lights.lights.len() as u32 {
        for (sum, one) in sum.iter_mut().zip(cpu(&solo(light, LightTerm::All)).direct) {
            *sum += Vec3::from(one);
        }
    }
    for (i, (sum, whole)) in sum.iter().zip(&whole).enumerate() {
        let off = (*sum - Vec3::from(*whole)).abs().max_element();
        assert!(
            off <= 1e-4 * (1.0 + sum.max_element()),
            "pixel {i}: {sum} is not {whole:?}"
        );
    }

    // A number that no light has lights nothing.
    let none = solo(scene.lights.lights.len() as u32, LightTerm::All);
    assert!(cpu(&none).direct.iter().all(|p| *p == [0.0; 3]));

    let engine = Engine::choose(BackendChoice::Bvh, None, ValidationMode::Required)
        .expect("a device")
        .engine;
    let Ok(Prepared::Gpu(device)) = engine.prepare(&scene) else {
        panic!("the scene fits the device");
    };
    let gpu = |settings: &Settings| gpu_film(&device, &view, SIZE, settings, 1);
    product(&gpu, light);
    assert!(gpu(&none).direct.iter().all(|p| *p == [0.0; 3]));
    let mean = |film: &Film| film.direct.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    for term in [
        LightTerm::All,
        LightTerm::Visibility,
        LightTerm::Geometry,
        LightTerm::Emission,
    ] {
        let settings = solo(light, term);
        let ratio = mean(&gpu(&settings)) / mean(&cpu(&settings));
        assert!((ratio - 1.0).abs() < 0.01, "{term:?}: {ratio}");
    }
}
