//! What several tests share: fixtures as scenes, installed maps, statistics over seeds, closed forms.

// Every test file is its own program and uses its own part of this module.
#![allow(dead_code)]

pub mod analytic;
pub mod desk;
pub mod leaks;
pub mod small_views;
pub mod ties;

use glam::Vec3;
use q3rays::assets::bsp::build::fixtures::Fixture;
use q3rays::assets::vfs::{FileSource, Install, Vfs, VfsError};
use q3rays::content::embedded::EMBEDDED;
use q3rays::reference::light_cells;
use q3rays::render::film::Film;
use q3rays::render::gpu_renderer::GpuRenderer;
use q3rays::render::scene_gpu::SceneGpu;
use q3rays::render::settings::{Secondary, Settings};
use q3rays::scene::Scene;
use q3rays::scene::camera::Camera;
use q3rays::scene::sampling::Sequence;

/// Files in memory.
pub struct Files(pub Vec<(String, Vec<u8>)>);

impl FileSource for Files {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, VfsError> {
        Ok(self.0.iter().find(|(p, _)| *p == path).map(|(_, bytes)| bytes.clone()))
    }

    fn list(&self, folder: &str, extension: &str) -> Vec<String> {
        let (prefix, suffix) = (format!("{folder}/"), format!(".{extension}"));
        let wanted = |p: &&String| p.starts_with(&prefix) && p.ends_with(&suffix);
        self.0.iter().map(|(p, _)| p).filter(wanted).cloned().collect()
    }
}

/// A fixture as a scene, through the bytes of its files.
pub fn scene(fixture: &Fixture) -> Scene {
    Scene::load(&Files(fixture.files()), &fixture.name).unwrap()
}

/// The installed game data; without them nothing can be said about real maps, so that is a failure.
pub fn installed() -> Vfs {
    let files = Vfs::mount(&Install::discover(None), EMBEDDED);
    assert!(
        files.maps().len() > 1,
        "no game data is installed here: run tests/setup.sh, which installs OpenArena's"
    );
    files
}

/// An installed (or the shipped) map as a scene.
pub fn real(name: &str) -> Scene {
    let mut scene = Scene::load(&installed().focused_on(name), name)
        .unwrap_or_else(|e| panic!("{e}: OpenArena's maps are needed, run tests/setup.sh"));
    light_cells::fill(&mut scene);
    scene
}

/// The view from a spawn point, moved and turned off whole numbers: along seams between coplanar faces and on
/// silhouettes that a ray meets exactly, which surface is hit is a matter of rounding.
pub fn spawn_camera(scene: &Scene, spawn: usize) -> Camera {
    assert!(
        !scene.spawns.is_empty(),
        "{} has no spawn point to look from",
        scene.name
    );
    let mut camera = q3rays::scene::spawns::view(&scene.spawns[spawn % scene.spawns.len()], 90.0);
    for (e, d) in camera.eye.iter_mut().zip([0.137, 0.291, 0.173]) {
        *e += d;
    }
    camera.yaw += 0.37;
    camera.pitch += 0.23;
    camera
}

/// A view with all angles given.
pub fn camera(eye: [f32; 3], pitch: f32, yaw: f32, fov: f32) -> Camera {
    Camera {
        pitch,
        ..Camera::new(Vec3::from(eye), yaw, fov)
    }
}

/// Settings for comparison with closed forms: every sample of a pixel sees the same point, albedo is unfiltered.
pub fn still(random_lights: u32, sequence: Sequence, seed: u32) -> Settings {
    Settings {
        random_lights,
        sequence,
        seed,
        antialiasing: false,
        filter_textures: false,
        // Ways that branch off have tests of their own (secondary.rs); here each ray has one end that can be explained.
        secondary: Secondary::Off,
        ..Settings::default()
    }
}

/// Where a world point is in the image, pixels from the top left.
pub fn project(camera: &Camera, size: (u32, u32), point: Vec3) -> [f32; 2] {
    let (axes, (w, h)) = (camera.axes(), camera.half_extent(size.0, size.1));
    let d = point - Vec3::from(camera.eye);
    let depth = d.dot(axes.forward);
    let (x, y) = (d.dot(axes.right) / depth / w, d.dot(axes.up) / depth / h);
    [(0.5 + 0.5 * x) * size.0 as f32, (0.5 - 0.5 * y) * size.1 as f32]
}

/// No progress wanted.
pub fn quiet(_: f32) {}

/// Accumulation on a Vulkan device that already holds the scene.
pub fn gpu_film(scene: &SceneGpu, camera: &Camera, size: (u32, u32), settings: &Settings, n: u32) -> Film {
    let (film, _) = GpuRenderer::new(scene)
        .unwrap()
        .accumulate(camera, size, settings, 0..n, &quiet)
        .unwrap();
    film
}

/// Mean and standard error of independent values.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let m2: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (m2 / (n * (n - 1.0))).sqrt())
}

/// Edge of the blocks in which images are held against their truth.
pub const BLOCK: u32 = 16;

/// Means of an image's blocks of 16x16 pixels in one channel, and last that of the whole image.
pub fn blocks(size: (u32, u32), value: impl Fn(usize) -> f64) -> Vec<f64> {
    let across = size.0 / BLOCK;
    let mut sums = vec![0.0; (across * (size.1 / BLOCK)) as usize];
    for i in 0..size.0 * size.1 {
        let block = i / size.0 / BLOCK * across + i % size.0 / BLOCK;
        sums[block as usize] += value(i as usize) / f64::from(BLOCK * BLOCK);
    }
    sums.push(sums.iter().sum::<f64>() / sums.len() as f64);
    sums
}

/// Whether two films are the same bits.
pub fn same_bits(a: &Film, b: &Film) -> bool {
    differing_pixels(a, b).is_empty()
}

/// Pixels in which any plane of two films differs in any bit.
pub fn differing_pixels(a: &Film, b: &Film) -> Vec<usize> {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let bits = |f: &Film, i: usize| {
        let three = |v: [f32; 3]| v.map(f32::to_bits);
        let planes = [three(f.mean[i]), three(f.direct[i]), three(f.emission[i])];
        (planes, f.variance[i].to_bits(), f.samples[i].to_bits())
    };
    (0..a.mean.len()).filter(|&i| bits(a, i) != bits(b, i)).collect()
}
