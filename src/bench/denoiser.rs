//! What the denoiser makes of one light sample per pixel: error against two references after some frames of a view that stands
//! still and of one that moves, beside the raw frame, and the time of its passes.

use super::lights::{Config, Mode};
use super::references::{Pixels, References, mean};
use crate::gpu::SubmitSync;
use crate::metrics::{ImageRgb, Kind, compare};
use crate::output::stats::FrameStats;
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::{film, radiance};
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::{AmbientLight, Settings};
use crate::scene::camera::Camera;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Frames after which a still view is looked at, and the moving one.
pub const STILL: [u32; 2] = [8, 64];
pub const MOVING: u32 = 64;
/// How a moving view moves in a frame: units to the right, degrees to the left.
const SIDEWAYS: f32 = 1.0;
const TURN: f32 = 0.5;
/// Samples of the raw image that the longer of the still views is held against.
pub const RAW: u32 = 128;
/// Runs with other random numbers that figures of single frames are means over.
const RUNS: u32 = 4;
/// Frames whose times are taken.
const TIMED: u32 = 40;
/// What references take of each sample.
const REFERENCE: Config = Config {
    mode: Mode::Resampled,
    lights: 4,
    candidates: 4,
    neighbours: 0,
};

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub size: (u32, u32),
    /// Samples of each reference.
    pub references: u32,
}

/// Figures of an image against the references; see [`crate::metrics::Metrics`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    pub rel_mse: f64,
    pub rel_mse_trimmed: f64,
    pub ssim: f64,
    pub flip: f64,
    pub mean_ratio: f64,
}

/// The measurements of a view.
#[derive(Clone, Debug, Serialize)]
pub struct ViewReport {
    pub map: String,
    pub spawn: usize,
    /// Relative squared error of one reference.
    pub reference_error: f64,
    /// One frame as it comes, and the mean of [`RAW`].
    pub raw: Figures,
    pub raw_many: Figures,
    /// The still view after each of [`STILL`] frames.
    pub still: [Figures; 2],
    /// The moving view, which ends where the still one stands.
    pub moved: Figures,
    /// Median milliseconds per pass, where the device tells times.
    pub passes: BTreeMap<String, f64>,
}

/// The measurement of one scene.
pub struct DenoiserBench {
    realtime: Realtime,
    base: Settings,
    options: Options,
}

impl DenoiserBench {
    /// Prepares the frames of a scene.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: Arc<SceneGpu>, base: &Settings, options: Options) -> Result<Self, RenderError> {
        Ok(Self {
            realtime: Realtime::new(scene, options.size, None)?,
            base: Settings {
                aperture: 0.0,
                ambient: AmbientLight::Off,
                ..*base
            },
            options,
        })
    }

    fn frame(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        index: u32,
        accumulated: u32,
    ) -> Result<Option<FrameStats>, RenderError> {
        let input = FrameInput {
            camera: *camera,
            settings: *settings,
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated,
            exposure_blend: 1.0,
            reuse: accumulated == 0,
            output: accumulated == 0,
        };
        self.realtime
            .frame(&input, |shown| shown.frame.submit(SubmitSync::default()))
    }

    fn accumulated(&mut self, camera: &Camera, settings: &Settings, samples: u32) -> Result<Pixels, RenderError> {
        for n in 0..samples {
            self.frame(camera, settings, n, n + 1)?;
        }
        self.realtime.finish()?;
        Ok(film(&self.realtime.view, samples)?.mean)
    }

    fn references(&mut self, camera: &Camera) -> Result<References, RenderError> {
        let mut images = [Vec::new(), Vec::new()];
        for (i, image) in images.iter_mut().enumerate() {
            let settings = Settings {
                seed: self.base.seed.wrapping_add(0x51ed_0001 + i as u32),
                ..REFERENCE.settings(&self.base)
            };
            *image = self.accumulated(camera, &settings, self.options.references)?;
        }
        Ok(References::new(images))
    }

    fn figures(&self, image: &[[f32; 3]], references: &References) -> Figures {
        let (width, height) = (self.options.size.0 as usize, self.options.size.1 as usize);
        let rgb = |pixels: Pixels| ImageRgb { width, height, pixels };
        let (rel_mse, rel_mse_trimmed) = references.error(image);
        let metrics = compare(&rgb(image.to_vec()), &rgb(references.joined()), Kind::Linear, None).ok();
        let figure = |f: Option<f64>| f.unwrap_or(f64::NAN);
        Figures {
            rel_mse,
            rel_mse_trimmed,
            ssim: figure(metrics.as_ref().and_then(|m| m.ssim)),
            flip: figure(metrics.as_ref().and_then(|m| m.flip)),
            mean_ratio: mean(image) / references.mean,
        }
    }

    /// Mean of the figures of raw images of so many samples.
    fn raw(&mut self, camera: &Camera, samples: u32, runs: u32, truth: &References) -> Result<Figures, RenderError> {
        let mut sum = Figures {
            rel_mse: 0.0,
            rel_mse_trimmed: 0.0,
            ssim: 0.0,
            flip: 0.0,
            mean_ratio: 0.0,
        };
        for run in 0..runs {
            let settings = Settings {
                seed: self.base.seed.wrapping_add(run),
                ..self.base
            };
            let image = self.accumulated(camera, &settings, samples)?;
            let f = self.figures(&image, truth);
            let n = f64::from(runs);
            sum.rel_mse += f.rel_mse / n;
            sum.rel_mse_trimmed += f.rel_mse_trimmed / n;
            sum.ssim += f.ssim / n;
            sum.flip += f.flip / n;
            sum.mean_ratio += f.mean_ratio / n;
        }
        Ok(sum)
    }

    /// The image after so many frames along a path; histories begin with it.
    fn shown(&mut self, frames: u32, path: &dyn Fn(u32) -> Camera) -> Result<Pixels, RenderError> {
        let settings = self.base;
        // An averaged frame ends all histories.
        self.frame(&path(0), &settings, 0, 1)?;
        for index in 0..frames {
            self.frame(&path(index), &settings, index, 0)?;
        }
        self.realtime.finish()?;
        radiance(&self.realtime.view)
    }

    fn times(&mut self, camera: &Camera) -> Result<BTreeMap<String, f64>, RenderError> {
        let settings = self.base;
        let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut ended = Vec::new();
        for index in 0..TIMED {
            ended.extend(self.frame(camera, &settings, index, 0)?);
        }
        ended.extend(self.realtime.finish()?);
        for frame in &ended[ended.len() / 4..] {
            for (name, ms) in &frame.passes {
                times.entry(name.clone()).or_default().extend(ms.as_f64());
            }
            times.entry("frame".into()).or_default().extend(frame.gpu_ms);
        }
        let median = |mut v: Vec<f64>| {
            v.sort_unstable_by(f64::total_cmp);
            v.get(v.len() / 2).copied()
        };
        Ok(times
            .into_iter()
            .filter_map(|(name, v)| Some((name, median(v)?)))
            .collect())
    }

    /// Measures a view.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn run(&mut self, map: &str, spawn: usize, camera: &Camera) -> Result<ViewReport, RenderError> {
        let truth = self.references(camera)?;
        let raw = self.raw(camera, 1, RUNS, &truth)?;
        let raw_many = self.raw(camera, RAW, 1, &truth)?;
        let mut still = [raw; 2];
        for (figures, frames) in still.iter_mut().zip(STILL) {
            let image = self.shown(frames, &|_| *camera)?;
            *figures = self.figures(&image, &truth);
        }
        // The moving view ends where the still one stands, so that the truth is the same.
        let right = camera.axes().right;
        let path = |index: u32| {
            let left = (MOVING - 1 - index) as f32;
            let mut c = *camera;
            c.eye = std::array::from_fn(|i| c.eye[i] - right[i] * SIDEWAYS * left);
            c.yaw -= TURN * left;
            c
        };
        let image = self.shown(MOVING, &path)?;
        let moved = self.figures(&image, &truth);
        Ok(ViewReport {
            map: map.to_owned(),
            spawn,
            reference_error: truth.own_error(),
            raw,
            raw_many,
            still,
            moved,
            passes: self.times(camera)?,
        })
    }
}
