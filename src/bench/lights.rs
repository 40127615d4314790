//! Error against time of the ways to choose a light.
//!
//! A frame stands for itself: its error is that of the image that one frame of a mode shows, after enough frames for reuse
//! to settle, against two independent references R1 and R2 as mean((I−R1)(I−R2)/(R²+0.01·m²)), R their mean and m its mean,
//! so that the references' own noise is no floor. Anti-aliasing is off on both sides: only light is left to chance. Time is
//! the GPU's for the passes that light the surfaces.

use super::references::{Pixels, References, mean, reference_seed};
use crate::gpu::{GpuError, SubmitSync};
use crate::output::stats::FrameStats;
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::{film, radiance};
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::{AmbientLight, LightSampling, Settings};
use crate::scene::camera::Camera;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A mode of sampling with its knobs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Config {
    pub mode: Mode,
    /// `rt_numRandomDL`.
    pub lights: u32,
    /// `rt_lightCandidates`.
    pub candidates: u32,
    /// `rt_reuseNeighbours`.
    pub neighbours: u32,
}

/// The ways to choose; resampling without and with reuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    Uniform,
    Power,
    Bvh,
    Cells,
    Resampled,
    Reservoir,
}

impl Mode {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Uniform,
        Self::Power,
        Self::Bvh,
        Self::Cells,
        Self::Resampled,
        Self::Reservoir,
    ];

    /// As tables call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Power => "power",
            Self::Bvh => "bvh",
            Self::Cells => "cells",
            Self::Resampled => "resampled",
            Self::Reservoir => "reservoir",
        }
    }

    /// Knobs to try, cheap ones first within each list; a list ends where a frame takes too long.
    fn ladders(self) -> Vec<Vec<Config>> {
        let config = |lights, candidates, neighbours| Config {
            mode: self,
            lights,
            candidates,
            neighbours,
        };
        match self {
            Self::Resampled => [2, 8].map(|c| [1, 2, 4, 8].map(|n| config(n, c, 0)).into()).into(),
            Self::Reservoir => [0, 1, 2]
                .map(|k| [1, 2, 4, 8, 16].map(|c| config(1, c, k)).into())
                .into(),
            _ => vec![[1, 2, 4, 8, 16, 32, 64].map(|n| config(n, 1, 0)).into()],
        }
    }
}

impl Config {
    /// The settings that it means.
    pub fn settings(&self, base: &Settings) -> Settings {
        Settings {
            light_sampling: match self.mode {
                Mode::Uniform => LightSampling::Uniform,
                Mode::Power => LightSampling::Power,
                Mode::Bvh => LightSampling::Bvh,
                Mode::Cells => LightSampling::Cells,
                Mode::Resampled | Mode::Reservoir => LightSampling::Reservoir,
            },
            light_reuse: self.mode == Mode::Reservoir,
            random_lights: self.lights,
            candidates: self.candidates,
            reuse_neighbours: self.neighbours,
            ..*base
        }
    }
}

/// What one configuration gave.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    pub config: Config,
    /// Median and 95th percentile over frames of the time of the passes that light, milliseconds.
    pub light_ms: f64,
    pub light_ms_p95: f64,
    /// Median over frames of the whole frame.
    pub frame_ms: f64,
    /// Relative squared error of a frame, mean over some.
    pub rel_mse: f64,
    /// Without the worst 0.1% of pixels.
    pub rel_mse_trimmed: f64,
}

/// Mean of a mode's frames over that of the references.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bias {
    pub mode: Mode,
    pub mean_ratio: f64,
    /// Standard error of the ratio.
    pub standard_error: f64,
}

/// The measurements of a map.
#[derive(Clone, Debug, Serialize)]
pub struct MapReport {
    pub map: String,
    pub lights: usize,
    pub references: u32,
    /// Relative squared error of one reference, estimated by the other.
    pub reference_error: f64,
    pub measured: Vec<Measured>,
    pub bias: Vec<Bias>,
}

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub size: (u32, u32),
    /// Samples of each reference.
    pub references: u32,
    /// Longest time of a frame that is looked at, milliseconds.
    pub longest: f64,
}

/// Frames for reuse to settle, and time for the device to reach its speed, before times are taken.
const SETTLE: u32 = 24;
const RAMP: Duration = Duration::from_millis(100);
/// Frames whose times are taken.
const TIMED: u32 = 20;
/// Frames whose error is measured, and how far apart they are.
const LOOKED_AT: u32 = 2;
const APART: u32 = 8;
/// Runs with other random numbers for the mean of a mode, and their length in frames.
const RUNS: u32 = 16;
const RUN_FRAMES: u32 = 6;
/// What references take of each sample. Candidates are cheaper than rays, and on maps of many small lamps worth more.
pub(super) const REFERENCE: Config = Config {
    mode: Mode::Resampled,
    lights: 4,
    candidates: 8,
    neighbours: 0,
};
const PASSES: [&str; 3] = ["direct", "resample", "reuse"];

/// The measurement of one map and camera.
pub struct LightsBench {
    realtime: Realtime,
    camera: Camera,
    base: Settings,
    options: Options,
}

impl LightsBench {
    /// Prepares the frames of a scene.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: Arc<SceneGpu>, camera: Camera, base: &Settings, options: Options) -> Result<Self, RenderError> {
        Ok(Self {
            realtime: Realtime::new(scene, options.size, None)?,
            camera,
            base: Settings {
                antialiasing: false,
                aperture: 0.0,
                ambient: AmbientLight::Off,
                denoiser: false,
                taa: false,
                ..*base
            },
            options,
        })
    }

    fn frame(
        &mut self,
        settings: &Settings,
        index: u32,
        accumulated: u32,
        reuse: bool,
    ) -> Result<Option<FrameStats>, RenderError> {
        let input = FrameInput {
            camera: self.camera,
            settings: *settings,
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated,
            exposure_blend: 1.0,
            reuse,
            output: false,
        };
        self.realtime
            .frame(&input, |shown| shown.frame.submit(SubmitSync::default()))
    }

    fn image(&mut self) -> Result<Pixels, RenderError> {
        self.realtime.finish()?;
        radiance(&self.realtime.view)
    }

    fn references(&mut self) -> Result<References, RenderError> {
        let mut images = [Vec::new(), Vec::new()];
        for (i, image) in images.iter_mut().enumerate() {
            let settings = Settings {
                seed: reference_seed(self.base.seed, i),
                ..REFERENCE.settings(&self.base)
            };
            for n in 0..self.options.references {
                self.frame(&settings, n, n + 1, false)?;
            }
            self.realtime.finish()?;
            *image = film(&self.realtime.view, self.options.references)?.mean;
        }
        Ok(References::new(images))
    }

    fn measure(&mut self, config: &Config, references: &References) -> Result<Measured, RenderError> {
        let settings = config.settings(&self.base);
        // A frame without reuse ends the history of the configuration before.
        self.frame(&self.base.clone(), 0, 1, false)?;
        let start = Instant::now();
        let mut index = 0;
        while index < SETTLE || start.elapsed() < RAMP {
            self.frame(&settings, index, 1, true)?;
            index += 1;
        }
        let mut stats = Vec::new();
        for _ in 0..TIMED {
            stats.extend(self.frame(&settings, index, 1, true)?);
            index += 1;
        }
        let mut looked = Vec::new();
        for _ in 0..LOOKED_AT {
            for _ in 0..APART {
                self.frame(&settings, index, 1, true)?;
                index += 1;
            }
            looked.push(references.error(&self.image()?));
        }
        let time = |s: &FrameStats| -> f64 { PASSES.iter().filter_map(|p| s.passes.get(*p)?.as_f64()).sum() };
        let mut light: Vec<f64> = stats.iter().map(time).collect();
        let mut frame: Vec<f64> = stats.iter().filter_map(|s| s.gpu_ms).collect();
        if light.is_empty() || frame.is_empty() {
            return Err(GpuError::InvalidInput("the device tells no times".into()).into());
        }
        light.sort_unstable_by(f64::total_cmp);
        frame.sort_unstable_by(f64::total_cmp);
        let n = f64::from(LOOKED_AT);
        Ok(Measured {
            config: *config,
            light_ms: light[light.len() / 2],
            light_ms_p95: light[light.len() * 95 / 100],
            frame_ms: frame[frame.len() / 2],
            rel_mse: looked.iter().map(|(e, _)| e / n).sum(),
            rel_mse_trimmed: looked.iter().map(|(_, t)| t / n).sum(),
        })
    }

    fn bias(&mut self, mode: Mode, references: &References) -> Result<Bias, RenderError> {
        let config = Config {
            mode,
            // Rare bright pixels carry much of the mean of the modes that choose badly: with more samples fewer runs
            // tell it.
            lights: match mode {
                Mode::Uniform | Mode::Power => 16,
                Mode::Bvh | Mode::Cells => 4,
                Mode::Resampled | Mode::Reservoir => 1,
            },
            candidates: 4,
            neighbours: 1,
        };
        let mut means = Vec::new();
        for run in 0..RUNS {
            let settings = Settings {
                seed: self.base.seed.wrapping_add(1000 + run),
                ..config.settings(&self.base)
            };
            for index in 0..RUN_FRAMES {
                self.frame(&settings, index, 1, true)?;
            }
            means.push(mean(&self.image()?) / references.mean);
        }
        let n = f64::from(RUNS);
        let average = means.iter().sum::<f64>() / n;
        let variance = means.iter().map(|m| (m - average).powi(2)).sum::<f64>() / (n - 1.0);
        let [a, b] = references.images.each_ref().map(|i| mean(i));
        let of_references = ((a - b) / references.mean).powi(2) * 0.25;
        Ok(Bias {
            mode,
            mean_ratio: average,
            standard_error: (variance / n + of_references).sqrt(),
        })
    }

    /// Measures everything. `progress` is called with a line about each step.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn run(mut self, map: &str, lights: usize, progress: &dyn Fn(&str)) -> Result<MapReport, RenderError> {
        progress("references");
        let references = self.references()?;
        let (mut measured, mut bias) = (Vec::new(), Vec::new());
        for mode in Mode::ALL {
            progress(mode.name());
            for ladder in mode.ladders() {
                for config in ladder {
                    let m = self.measure(&config, &references)?;
                    let last = m.light_ms > self.options.longest;
                    measured.push(m);
                    if last {
                        break;
                    }
                }
            }
            bias.push(self.bias(mode, &references)?);
        }
        Ok(MapReport {
            map: map.to_owned(),
            lights,
            references: self.options.references,
            reference_error: references.own_error(),
            measured,
            bias,
        })
    }
}
