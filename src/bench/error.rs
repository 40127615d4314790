//! Run time against error: every choice of settings of [`super::sweep`] on a view, how errors fall with samples, and the error of
//! frames along a way.

use super::lights::Mode;
use super::references::Pixels;
use super::stage::Stage;
use super::statistics::{Line, Repeated, median, power_law};
use super::sweep::{Config, sweep};
use super::truth::Truth;
use crate::metrics::{Kind, heatmap};
use crate::output::stats::FrameStats;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::Settings;
use crate::scene::camera::Camera;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub size: (u32, u32),
    /// Most samples of each truth.
    pub most: u32,
    /// Images of each choice, each with other random numbers and a history of its own.
    pub images: u32,
    /// Longest frame that is of interest, milliseconds.
    pub longest: f64,
    /// Places along the way whose frames are looked at.
    pub stops: usize,
}

/// Samples of a part of a truth at first.
const FIRST_SAMPLES: u32 = 32;
/// Wanted standard error of a figure, as a share of it.
pub const WANTED: f64 = 0.1;
/// Frames of history before an image.
const SETTLE: u32 = 32;
/// Frames whose time is taken.
const TIMED: u32 = 16;
/// Samples up to which the fall of errors is followed.
const LONGEST_MEAN: u32 = 64;
/// Samples of each part of the truths along the way.
const STOP_SAMPLES: u32 = 64;
/// Choices whose pictures the report shows.
const SHOWN: [&str; 4] = ["uniform 1", "resampled 1", "resampled 1, denoiser, TAA", "all lights"];

/// One choice's time and errors.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub name: String,
    pub config: Config,
    /// Of a frame, or of all the samples that it averages, milliseconds.
    pub ms: f64,
    pub rel_mse: f64,
    /// Standard error of that.
    pub rel_mse_error: f64,
    pub rel_mse_trimmed: f64,
    pub rmse: f64,
    pub ssim: Option<f64>,
    pub flip: Option<f64>,
    pub mean_ratio: f64,
    pub images: usize,
    /// No other choice is both faster and nearer to the truth.
    pub front: bool,
}

/// How the error of a mean falls with its samples.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fall {
    pub name: String,
    /// Samples and rel_mse.
    pub points: Vec<(f64, f64)>,
    /// Power of the number of samples, and its standard error.
    pub slope: Option<(f64, f64)>,
}

/// Errors of frames along a way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Along {
    pub name: String,
    /// Frame, rel_mse, FLIP.
    pub frames: Vec<(u32, f64, f64)>,
}

/// A picture of a choice, as files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Picture {
    pub name: String,
    pub shown: String,
    pub heatmap: String,
}

/// The measurements of a view.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ViewErrors {
    /// What the figures depend on: those of another run with the same are taken over.
    pub key: String,
    pub map: String,
    pub spawn: usize,
    pub lights: usize,
    pub size: [u32; 2],
    /// Samples of each truth that there are, and could have been.
    pub samples: u32,
    pub most_samples: u32,
    /// Largest standard error of a figure over it, and of how many figures it is above the wanted one.
    pub worst: f64,
    pub unsure: usize,
    /// `rel_mse` of the mean of both truths, against which SSIM and FLIP are taken.
    pub noise: f64,
    pub rows: Vec<Row>,
    /// Choices that took too long, with the milliseconds of a frame.
    pub left_out: Vec<(String, f64)>,
    pub falls: Vec<Fall>,
    pub along: Vec<Along>,
    pub pictures: Vec<Picture>,
}

/// What one choice showed.
struct Shown {
    config: Config,
    ms: f64,
    images: Vec<Pixels>,
}

/// Who keeps what is found, and tells the user.
pub trait Keeper {
    /// A truth is as fine as this now.
    fn truth(&self, truth: &Truth);
    /// Keeps a picture under a name; its file, where that could be written.
    fn picture(&self, stem: &str, pixels: &[[u8; 3]]) -> Option<String>;
    /// What is being done, and the share of all that is done.
    fn news(&self, what: &str, share: f32);
}

/// Images of a way of choosing lights, by their samples.
type Means = (String, Vec<(u32, Pixels)>);

/// Everything that a view's measurement needs.
pub struct ErrorBench {
    scene: Arc<SceneGpu>,
    stage: Stage,
    options: Options,
}

/// Enlarges an image by bilinear filtering.
fn enlarged(pixels: &Pixels, from: (u32, u32), to: (u32, u32)) -> Pixels {
    if from == to {
        return pixels.clone();
    }
    let texel = |x: i64, y: i64| {
        let (w, h) = (i64::from(from.0), i64::from(from.1));
        pixels[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize]
    };
    (0..to.0 * to.1)
        .map(|i| {
            let u = ((i % to.0) as f32 + 0.5) / to.0 as f32 * from.0 as f32 - 0.5;
            let v = ((i / to.0) as f32 + 0.5) / to.1 as f32 * from.1 as f32 - 0.5;
            let (x, y, s, t) = (u.floor() as i64, v.floor() as i64, u - u.floor(), v - v.floor());
            let corners = [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)];
            let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
            std::array::from_fn(|c| corners.iter().zip(weights).map(|(p, w)| p[c] * w).sum())
        })
        .collect()
}

impl ErrorBench {
    /// Prepares a scene.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: &Arc<SceneGpu>, base: &Settings, options: Options) -> Result<Self, RenderError> {
        Ok(Self {
            stage: Stage::new(scene.clone(), base, options.size, FIRST_SAMPLES)?,
            scene: scene.clone(),
            options,
        })
    }

    /// The settings that truths and images share.
    pub fn base(&self) -> &Settings {
        &self.stage.base
    }

    /// A stage for images of another size than the truths'.
    fn smaller(&self, size: (u32, u32)) -> Result<Option<Stage>, RenderError> {
        let other = size != self.options.size;
        other
            .then(|| Stage::new(self.scene.clone(), &self.stage.base, size, FIRST_SAMPLES))
            .transpose()
    }

    /// Images of a choice; `Err` with the time where a frame takes too long.
    fn show(&mut self, camera: &Camera, config: &Config) -> Result<Result<Shown, f64>, RenderError> {
        let size = config.traced(self.options.size);
        let mut small = self.smaller(size)?;
        let stage = small.as_mut().unwrap_or(&mut self.stage);
        let settings = config.settings(&stage.base);
        // Ends histories, and shows how long a frame takes.
        let mut stats = Vec::new();
        for index in 0..2 {
            stats.extend(stage.frame(camera, &settings, index, 1)?);
        }
        stats.extend(stage.realtime.finish()?);
        let once = stats.iter().map(FrameStats::ms).fold(f64::INFINITY, f64::min);
        if once * f64::from(config.samples) > self.options.longest {
            return Ok(Err(once * f64::from(config.samples)));
        }
        let mut images = Vec::new();
        for run in 0..self.options.images {
            let settings = Settings {
                seed: stage.base.seed.wrapping_add(run),
                ..settings
            };
            let image = if config.has_history() {
                stage.frame(camera, &settings, 0, 1)?;
                for index in 0..SETTLE {
                    stage.frame(camera, &settings, index, 0)?;
                }
                stage.shown()?
            } else {
                stage.accumulated_from(camera, &settings, 0..config.samples)?
            };
            images.push(enlarged(&image, size, self.options.size));
        }
        Ok(Ok(Shown {
            config: *config,
            ms: once * f64::from(config.samples),
            images,
        }))
    }

    /// The times of choices, one right after the other.
    fn time(&mut self, camera: &Camera, shown: &mut [Shown]) -> Result<(), RenderError> {
        let base = self.stage.base;
        self.stage.warm_up(camera, &base)?;
        for one in shown {
            let mut small = self.smaller(one.config.traced(self.options.size))?;
            let stage = small.as_mut().unwrap_or(&mut self.stage);
            let settings = one.config.settings(&base);
            let accumulated = u32::from(!one.config.has_history());
            let mut ended = Vec::new();
            for index in 0..TIMED {
                ended.extend(stage.frame(camera, &settings, index, accumulated)?);
            }
            ended.extend(stage.realtime.finish()?);
            let times: Vec<f64> = ended.iter().skip(TIMED as usize / 4).map(FrameStats::ms).collect();
            one.ms = median(&times).map_or(one.ms, |ms| ms * f64::from(one.config.samples));
        }
        Ok(())
    }

    fn falls(&mut self, camera: &Camera) -> Result<Vec<Means>, RenderError> {
        let mut out = Vec::new();
        for mode in [Mode::Uniform, Mode::Bvh, Mode::Cells, Mode::Resampled] {
            let config = sweep().into_iter().find(|c| c.mode == mode && c.lights == 1);
            let Some(config) = config else { continue };
            let settings = config.settings(&self.stage.base);
            let mut images = Vec::new();
            let mut n = 1;
            while n <= LONGEST_MEAN {
                images.push((n, self.stage.accumulated_from(camera, &settings, 0..n)?));
                n *= 2;
            }
            out.push((mode.name().to_owned(), images));
        }
        Ok(out)
    }

    /// Frames along a way, as they are shown.
    fn along(&mut self, way: &[Camera]) -> Result<Vec<Along>, RenderError> {
        let stops: Vec<usize> = (1..=self.options.stops)
            .map(|k| k * way.len() / (self.options.stops + 1))
            .collect();
        let kinds = [
            ("raw", false, false),
            ("denoiser", true, false),
            ("denoiser, TAA", true, true),
        ];
        let mut seen = Vec::new();
        for (name, denoiser, taa) in kinds {
            let settings = Settings {
                denoiser,
                taa,
                ..self.stage.base
            };
            let mut images = Vec::new();
            if let Some(first) = way.first() {
                self.stage.frame(first, &settings, 0, 1)?;
            }
            for (index, camera) in way.iter().enumerate() {
                self.stage.frame(camera, &settings, index as u32, 0)?;
                if stops.contains(&index) {
                    images.push(self.stage.shown()?);
                }
            }
            seen.push((name, images));
        }
        let mut out: Vec<Along> = seen
            .iter()
            .map(|(name, _)| Along {
                name: (*name).to_owned(),
                frames: Vec::new(),
            })
            .collect();
        for (k, stop) in stops.iter().enumerate() {
            let truth = Truth::new(&mut self.stage, &way[*stop], STOP_SAMPLES)?;
            for ((_, images), along) in seen.iter().zip(&mut out) {
                let metrics = self.stage.compare(&images[k], &truth.references, None).ok();
                let flip = metrics.and_then(|m| m.flip).unwrap_or(f64::NAN);
                along.frames.push((*stop as u32, truth.error(&images[k]).rel_mse, flip));
            }
        }
        Ok(out)
    }

    /// Measures a view, and the frames of `way`. `kept`: a truth from an earlier run.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn run(
        &mut self,
        mut report: ViewErrors,
        camera: &Camera,
        way: &[Camera],
        kept: Option<Truth>,
        keeper: &dyn Keeper,
    ) -> Result<ViewErrors, RenderError> {
        let configs = sweep();
        let mut shown = Vec::new();
        for (i, config) in configs.iter().enumerate() {
            keeper.news(&config.name(), 0.5 * i as f32 / configs.len() as f32);
            match self.show(camera, config)? {
                Ok(one) => shown.push(one),
                Err(ms) => report.left_out.push((config.name(), ms)),
            }
        }
        self.time(camera, &mut shown)?;
        let falls = self.falls(camera)?;
        keeper.news("truths", 0.5);
        let mut truth = match kept {
            Some(truth) => truth,
            None => Truth::new(&mut self.stage, camera, FIRST_SAMPLES)?,
        };
        loop {
            keeper.truth(&truth);
            report.rows = shown.iter().map(|s| self.row(s, &truth)).collect();
            let shares: Vec<f64> = report.rows.iter().map(|r| r.rel_mse_error / r.rel_mse.abs()).collect();
            report.worst = shares.iter().copied().fold(0.0, f64::max);
            report.unsure = shares.iter().filter(|s| **s > WANTED).count();
            // SSIM and FLIP cannot be had without a floor of noise: it has to lie well below what is measured.
            report.noise = 0.5 * truth.references.own_error();
            let least = report
                .rows
                .iter()
                .map(|r| r.rel_mse.abs())
                .fold(f64::INFINITY, f64::min);
            let quiet = report.noise <= WANTED * least;
            if (report.unsure == 0 && quiet) || truth.samples * 4 > self.options.most {
                break;
            }
            keeper.news(&format!("truths of {} samples", truth.samples * 4), 0.7);
            truth = truth.refine(&mut self.stage, camera)?;
        }
        report.samples = truth.samples * 2;
        report.most_samples = self.options.most;
        mark_front(&mut report.rows);
        report.falls = falls.iter().map(|(name, images)| fall(name, images, &truth)).collect();
        keeper.news("along the way", 0.85);
        report.along = if self.options.stops > 0 {
            self.along(way)?
        } else {
            Vec::new()
        };
        for one in shown.iter().filter(|s| SHOWN.contains(&s.config.name().as_str())) {
            report.pictures.extend(self.pictures(one, &truth, &report, keeper));
        }
        let joined = truth.references.joined();
        let file = keeper.picture(
            &format!("{}-{}-truth", report.map, report.spawn),
            &self.stage.displayed(&joined, &joined),
        );
        report.pictures.extend(file.map(|shown| Picture {
            name: "truth".to_owned(),
            shown,
            heatmap: String::new(),
        }));
        Ok(report)
    }

    fn row(&self, shown: &Shown, truth: &Truth) -> Row {
        let estimates: Vec<_> = shown.images.iter().map(|i| truth.error(i)).collect();
        let of = |f: fn(&super::truth::Estimate) -> f64| Repeated::of(&estimates.iter().map(f).collect::<Vec<_>>());
        let errors = of(|e| e.rel_mse);
        let metrics: Vec<_> = shown
            .images
            .iter()
            .filter_map(|i| self.stage.compare(i, &truth.references, None).ok())
            .collect();
        let mean = |values: Vec<f64>| {
            let n = values.len();
            (n > 0).then(|| values.iter().sum::<f64>() / n as f64)
        };
        let ratios: Vec<f64> = shown.images.iter().map(|i| truth.mean_ratio(i)).collect();
        Row {
            name: shown.config.name(),
            config: shown.config,
            ms: shown.ms,
            rel_mse: errors.mean,
            rel_mse_error: errors.error().hypot(of(|e| e.deviation).mean),
            rel_mse_trimmed: of(|e| e.rel_mse_trimmed).mean,
            rmse: of(|e| e.rmse).mean,
            ssim: mean(metrics.iter().filter_map(|m| m.ssim).collect()),
            flip: mean(metrics.iter().filter_map(|m| m.flip).collect()),
            mean_ratio: Repeated::of(&ratios).mean,
            images: shown.images.len(),
            front: false,
        }
    }

    fn pictures(&self, shown: &Shown, truth: &Truth, report: &ViewErrors, keeper: &dyn Keeper) -> Option<Picture> {
        let image = shown.images.first()?;
        let joined = truth.references.joined();
        let name = shown.config.name();
        let stem = format!(
            "{}-{}-{}",
            report.map,
            report.spawn,
            name.replace(", ", "_").replace(' ', "")
        );
        let of = |pixels: &Pixels| self.stage.image(pixels.clone());
        let map = heatmap(&of(image), &of(&joined), Kind::Linear).ok()?;
        Some(Picture {
            name,
            shown: keeper.picture(&stem, &self.stage.displayed(image, &joined))?,
            heatmap: keeper.picture(&format!("{stem}-flip"), &map)?,
        })
    }
}

fn fall(name: &str, images: &[(u32, Pixels)], truth: &Truth) -> Fall {
    let points: Vec<(f64, f64)> = images
        .iter()
        .map(|(n, i)| (f64::from(*n), truth.error(i).rel_mse))
        .collect();
    Fall {
        name: name.to_owned(),
        slope: power_law(&points).map(|Line { slope, error, .. }| (slope, error)),
        points,
    }
}

/// Marks the rows that no other row beats in both time and error.
pub fn mark_front(rows: &mut [Row]) {
    let figures: Vec<(f64, f64)> = rows.iter().map(|r| (r.ms, r.rel_mse)).collect();
    for (row, own) in rows.iter_mut().zip(&figures) {
        let beaten = figures
            .iter()
            .any(|f| f.0 <= own.0 && f.1 <= own.1 && (f.0 < own.0 || f.1 < own.1));
        row.front = !beaten && own.1.is_finite();
    }
}
