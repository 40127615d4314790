//! Small pictures of small boxes, and how far they are apart.

use super::{camera, quiet};
use q3rays::reference::CpuRenderer;
use q3rays::render::film::Film;
use q3rays::render::settings::{AmbientLight, LightSampling, Settings};
use q3rays::scene::Scene;
use q3rays::scene::camera::Camera;
use q3rays::scene::light_power::luminance;

pub const SIZE: (u32, u32) = (32, 18);
pub const ALL_WAYS: [LightSampling; 5] = [
    LightSampling::Uniform,
    LightSampling::Power,
    LightSampling::Bvh,
    LightSampling::Cells,
    LightSampling::Reservoir,
];

pub fn settings() -> Settings {
    Settings {
        ambient: AmbientLight::Off,
        ..Settings::default()
    }
}

pub fn view() -> Camera {
    camera([20.0, 128.0, 128.0], 0.0, 0.0, 100.0)
}

pub fn cpu(scene: &Scene, settings: &Settings, n: u32) -> Film {
    CpuRenderer::new(scene)
        .accumulate(&view(), SIZE, settings, 0..n, &quiet)
        .0
}

pub fn mean(film: &Film) -> f32 {
    film.mean.iter().map(|p| luminance(*p)).sum::<f32>() / film.mean.len() as f32
}

/// Share of pixels in which two films differ by more than 2%.
pub fn apart(a: &Film, b: &Film) -> f32 {
    let differs = |(a, b): (&[f32; 3], &[f32; 3])| (luminance(*a) - luminance(*b)).abs() > 0.02 * luminance(*b) + 1e-4;
    let count = a.mean.iter().zip(&b.mean).filter(|p| differs(*p)).count();
    count as f32 / a.mean.len() as f32
}
