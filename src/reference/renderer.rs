//! Images by the CPU tracer.

use super::branches::{Path, lobe_of};
use super::direct::{RayCounts, SampleAddress, direct_light, lobe_light};
use super::layers::{Branches, Seen, see};
use super::primary::{CameraRay, View};
use super::surface::SurfaceHit;
use super::trace::Tracer;
use crate::render::film::{Aovs, Film};
use crate::render::settings::{AmbientLight, Secondary, Settings};
use crate::scene::Scene;
use crate::scene::camera::{Camera, Shot};
use crate::scene::records::NONE;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Traces images of one scene.
pub struct CpuRenderer<'a> {
    pub scene: &'a Scene,
    pub tracer: Tracer,
}

/// Radiance of one sample, by where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleRadiance {
    pub direct: Vec3,
    pub emission: Vec3,
    pub transparent: Vec3,
}

const FAR: f64 = f32::MAX as f64;
/// Distance to focus on where nothing is under the crosshair, units.
const DEFAULT_FOCUS: f32 = 512.0;

/// Irradiance/π that stands for light without a known source.
fn ambient_light(scene: &Scene, settings: &Settings, at: &SurfaceHit) -> Vec3 {
    match settings.ambient {
        AmbientLight::Off => Vec3::ZERO,
        AmbientLight::Constant => scene.ambient.constant,
        AmbientLight::Grid => scene.ambient.volume.at(at.position, at.shading_normal),
    }
}

/// Running sums of a pixel in double precision.
#[derive(Clone, Copy, Default)]
struct Sums {
    direct: [f64; 3],
    emission: [f64; 3],
    transparent: [f64; 3],
    mean: [f64; 3],
    m2: [f64; 3],
}

impl Sums {
    fn add(&mut self, sample: SampleRadiance, n: f64) {
        let total = sample.direct + sample.emission + sample.transparent;
        for c in 0..3 {
            self.direct[c] += f64::from(sample.direct[c]);
            self.emission[c] += f64::from(sample.emission[c]);
            self.transparent[c] += f64::from(sample.transparent[c]);
            let x = f64::from(total[c]);
            let delta = x - self.mean[c];
            self.mean[c] += delta / n;
            self.m2[c] += delta * (x - self.mean[c]);
        }
    }
}

impl<'a> CpuRenderer<'a> {
    /// Builds the trees.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            tracer: Tracer::new(scene),
        }
    }

    /// Prepares a view: finds what is under the crosshair where the focus asks for it.
    pub fn view(&self, camera: &Camera, size: (u32, u32), settings: &Settings) -> View {
        if settings.aperture <= 0.0 || settings.focus_distance > 0.0 {
            return View::new(camera, size, settings.focus_distance);
        }
        let ray = View::new(camera, size, 1.0).through(size.0 as f32 * 0.5, size.1 as f32 * 0.5);
        let hit = self.tracer.closest(self.scene, ray.origin, ray.direction, FAR);
        View::new(camera, size, hit.map_or(DEFAULT_FOCUS, |h| h.t as f32))
    }

    /// Radiance of an eye ray, all that branches off it included.
    fn radiance(
        &self,
        tracer: &Tracer,
        settings: &Settings,
        ray: CameraRay,
        cone: f32,
        address: SampleAddress,
        counts: &mut RayCounts,
    ) -> SampleRadiance {
        counts.primary += 1;
        let scene = self.scene;
        let mut branches = Branches::default();
        let eye = Path::from_eye(ray, address);
        let seen = see(scene, tracer, settings, &eye, cone, &mut branches);
        let mut out = SampleRadiance {
            emission: seen.share * seen.emission,
            transparent: seen.layers,
            ..SampleRadiance::default()
        };
        if let Some((surface, _)) = seen.surface.filter(|(s, _)| s.albedo != Vec3::ZERO) {
            if settings.illumination {
                let lit = direct_light(scene, tracer, settings, &surface, address, counts);
                out.direct = seen.share * (surface.albedo * (lit + ambient_light(scene, settings, &surface)));
            } else {
                out.direct = seen.share * surface.albedo;
                out.emission = Vec3::ZERO;
            }
        }
        out.transparent += self.highlight(tracer, settings, &seen, address, counts);
        let settings = &settings.of_branches();
        while let Some(path) = branches.paths.pop() {
            let seen = see(scene, tracer, settings, &path, cone, &mut branches);
            out.transparent += seen.layers + seen.share * seen.emission;
            if let Some((surface, _)) = seen.surface.filter(|(s, _)| s.albedo != Vec3::ZERO) {
                let lit = direct_light(scene, tracer, settings, &surface, path.address, counts);
                out.transparent += seen.share * (surface.albedo * (lit + ambient_light(scene, settings, &surface)));
            }
            out.transparent += self.highlight(tracer, settings, &seen, path.address, counts);
        }
        out
    }

    /// What the lobe of a seen surface reflects of the lights, as far as light samples find them.
    fn highlight(
        &self,
        tracer: &Tracer,
        settings: &Settings,
        seen: &Seen,
        address: SampleAddress,
        counts: &mut RayCounts,
    ) -> Vec3 {
        let Some((surface, _)) = seen.surface.filter(|_| seen.glossy) else {
            return Vec3::ZERO;
        };
        let material = &self.scene.materials[surface.material as usize];
        let lobe = lobe_of(material, &surface, seen.direction);
        let light = lobe_light(self.scene, tracer, settings, &surface, &lobe, address, counts);
        seen.share * surface.specular * light
    }

    /// Mean of independent samples `range` of every pixel. `progress` is called with the share done, 0..1, from any
    /// thread.
    pub fn accumulate(
        &self,
        camera: impl Into<Shot>,
        size: (u32, u32),
        settings: &Settings,
        range: Range<u32>,
        progress: &(dyn Fn(f32) + Sync),
    ) -> (Film, RayCounts) {
        let shot = camera.into();
        if settings.shutter <= 0.0 || range.is_empty() {
            return self.still(&shot.open, size, settings, range, progress);
        }
        // All pixels take a sample at the same moment: one scene to set up for each.
        let (first, count) = (range.start, range.len() as f32);
        let mut film = Film::new(size.0, size.1);
        let mut counts = RayCounts::default();
        for index in range {
            let now = settings.at_sample(index);
            let camera = shot.at(settings.shutter_share(index));
            let (one, rays) = self.still(&camera, size, &now, index..index + 1, &|_| {});
            // Both are of the same size: it is this function that made them.
            if film.merge(&one).is_err() {
                film = one;
            }
            counts += rays;
            progress((index - first + 1) as f32 / count);
        }
        (film, counts)
    }

    /// The same with a camera and a scene that stand still.
    fn still(
        &self,
        camera: &Camera,
        size: (u32, u32),
        settings: &Settings,
        range: Range<u32>,
        progress: &(dyn Fn(f32) + Sync),
    ) -> (Film, RayCounts) {
        let (width, height) = size;
        let view = self.view(camera, size, settings);
        let tracer = self.tracer.at(self.scene, settings, camera);
        let cone = if settings.filter_textures {
            view.pixel_width
        } else {
            0.0
        };
        let done = std::sync::atomic::AtomicU32::new(0);
        let rows: Vec<(Vec<Sums>, RayCounts)> = (0..height)
            .into_par_iter()
            .map(|y| {
                let mut counts = RayCounts::default();
                let mut row = vec![Sums::default(); width as usize];
                for (x, sums) in row.iter_mut().enumerate() {
                    for index in range.clone() {
                        let x = x as u32;
                        let pixel = x + (y << 16);
                        let address = SampleAddress { pixel, index };
                        let ray = view.sample(settings, x, y, address);
                        let sample = self.radiance(&tracer, settings, ray, cone, address, &mut counts);
                        sums.add(sample, f64::from(index - range.start) + 1.0);
                    }
                }
                let rows_done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                progress(rows_done as f32 / height as f32);
                (row, counts)
            })
            .collect();
        let mut film = Film::new(width, height);
        let mut counts = RayCounts::default();
        let n = range.len() as f64;
        for (i, sums) in rows.iter().flat_map(|(row, _)| row).enumerate() {
            let mean = |sum: [f64; 3]| sum.map(|s| if n > 0.0 { (s / n) as f32 } else { 0.0 });
            film.mean[i] = sums.mean.map(|m| m as f32);
            film.direct[i] = mean(sums.direct);
            film.emission[i] = mean(sums.emission);
            film.transparent[i] = mean(sums.transparent);
            film.samples[i] = n as f32;
            if n > 1.0 {
                film.variance[i] = (sums.m2.iter().sum::<f64>() / 3.0 / (n * (n - 1.0))) as f32;
            }
        }
        for (_, c) in rows {
            counts += c;
        }
        (film, counts)
    }

    /// Geometry through pixel centres.
    pub fn aovs(&self, camera: &Camera, size: (u32, u32), settings: &Settings) -> Aovs {
        let view = View::new(camera, size, 1.0);
        let tracer = self.tracer.at(self.scene, settings, camera);
        let settings = &Settings {
            choose_layers: false,
            secondary: Secondary::Off,
            ..*settings
        };
        let cone = if settings.filter_textures {
            view.pixel_width
        } else {
            0.0
        };
        let pixels: Vec<_> = (0..size.0 * size.1)
            .into_par_iter()
            .map(|i| {
                let ray = view.through((i % size.0) as f32 + 0.5, (i / size.0) as f32 + 0.5);
                let address = SampleAddress { pixel: i, index: 0 };
                let path = Path::from_eye(ray, address);
                let seen = see(self.scene, &tracer, settings, &path, cone, &mut Branches::default());
                seen.surface.map(|(surface, hit)| (surface, hit.t as f32))
            })
            .collect();
        let mut aovs = Aovs {
            width: size.0,
            height: size.1,
            ..Aovs::default()
        };
        for pixel in pixels {
            let number = |n: u32| if n == NONE { -1.0 } else { n as f32 };
            let v = |f: fn(&SurfaceHit) -> Vec3| pixel.as_ref().map_or([0.0; 3], |(s, _)| f(s).into());
            aovs.albedo.push(v(|s| s.albedo));
            aovs.normal.push(v(|s| s.shading_normal));
            aovs.geo_normal.push(v(|s| s.geometric_normal));
            aovs.position.push(v(|s| s.position));
            aovs.depth.push(pixel.as_ref().map_or(0.0, |(_, t)| *t));
            // One still frame: nothing has moved.
            aovs.motion.push([0.0; 2]);
            aovs.cluster
                .push(pixel.as_ref().map_or(-1.0, |(s, _)| number(s.cluster)));
            aovs.material
                .push(pixel.as_ref().map_or(-1.0, |(s, _)| number(s.material)));
        }
        aovs
    }
}
