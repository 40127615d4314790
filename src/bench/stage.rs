//! What benchmarks of the picture have in common: frames of a scene as they are shown, and references of them.

use super::lights::REFERENCE;
use super::references::{Pixels, References, mean, reference_seed};
use crate::gpu::SubmitSync;
use crate::metrics::{ImageRgb, Kind, Metrics, MetricsError, compare};
use crate::output::stats::FrameStats;
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::{film, radiance};
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::{AmbientLight, Settings};
use crate::render::tonemap::{automatic_exposure, display};
use crate::scene::camera::Camera;
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long frames are shown before some are timed. An H100 that waited for the CPU took four to eight times as long over
/// its next frames, for some tenths of a second.
const WARM_UP: Duration = Duration::from_millis(500);

/// Figures of an image against references; see [`crate::metrics::Metrics`]. The errors' denominator is that of
/// [`References::error`].
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Figures {
    pub rel_mse: f64,
    pub rel_mse_trimmed: f64,
    pub ssim: f64,
    pub flip: f64,
    pub mean_ratio: f64,
}

impl Figures {
    /// Means over some runs.
    pub fn mean(runs: &[Self]) -> Self {
        let of = |f: fn(&Self) -> f64| runs.iter().map(f).sum::<f64>() / runs.len().max(1) as f64;
        Self {
            rel_mse: of(|r| r.rel_mse),
            rel_mse_trimmed: of(|r| r.rel_mse_trimmed),
            ssim: of(|r| r.ssim),
            flip: of(|r| r.flip),
            mean_ratio: of(|r| r.mean_ratio),
        }
    }
}

/// A scene, a size, and settings that all frames share: pinhole, no ambient light.
pub struct Stage {
    pub realtime: Realtime,
    pub base: Settings,
    pub size: (u32, u32),
    /// Samples of each reference.
    pub references: u32,
}

impl Stage {
    /// Prepares the frames of a scene.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: Arc<SceneGpu>, base: &Settings, size: (u32, u32), references: u32) -> Result<Self, RenderError> {
        Ok(Self {
            realtime: Realtime::new(scene, size, None)?,
            base: Settings {
                aperture: 0.0,
                ambient: AmbientLight::Off,
                ..*base
            },
            size,
            references,
        })
    }

    /// Renders a frame; returns the statistics of an earlier one.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn frame(
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

    /// Renders for a while, so that a GPU which had nothing to do raises its clock before frames are timed.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn warm_up(&mut self, camera: &Camera, settings: &Settings) -> Result<(), RenderError> {
        let begun = Instant::now();
        while begun.elapsed() < WARM_UP {
            self.frame(camera, settings, 0, 0)?;
        }
        self.realtime.finish().map(drop)
    }

    /// Mean of so many samples.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn accumulated(&mut self, camera: &Camera, settings: &Settings, samples: u32) -> Result<Pixels, RenderError> {
        self.accumulated_from(camera, settings, 0..samples)
    }

    /// Mean of the samples with these numbers.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn accumulated_from(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        samples: Range<u32>,
    ) -> Result<Pixels, RenderError> {
        let count = samples.end - samples.start;
        for (n, index) in samples.enumerate() {
            self.frame(camera, settings, index, n as u32 + 1)?;
        }
        self.realtime.finish()?;
        Ok(film(&self.realtime.view, count)?.mean)
    }

    /// Display pixels of an image at the exposure that suits the truth.
    pub fn displayed(&self, image: &[[f32; 3]], truth: &[[f32; 3]]) -> Vec<[u8; 3]> {
        let exposure = match self.base.exposure {
            e if e > 0.0 => e,
            _ => automatic_exposure(truth, self.size.0, self.size.1),
        };
        image.iter().map(|p| display(*p, exposure, self.base.tonemap)).collect()
    }

    /// Two references of a view.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn references(&mut self, camera: &Camera) -> Result<References, RenderError> {
        let mut images = [Vec::new(), Vec::new()];
        for (i, image) in images.iter_mut().enumerate() {
            let settings = Settings {
                seed: reference_seed(self.base.seed, i),
                ..REFERENCE.settings(&self.base)
            };
            *image = self.accumulated(camera, &settings, self.references)?;
        }
        Ok(References::new(images))
    }

    /// The image that the last frame shows.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn shown(&mut self) -> Result<Pixels, RenderError> {
        self.realtime.finish()?;
        radiance(&self.realtime.view)
    }

    /// An image of the stage's size.
    pub fn image(&self, pixels: Pixels) -> ImageRgb {
        ImageRgb {
            width: self.size.0 as usize,
            height: self.size.1 as usize,
            pixels,
        }
    }

    /// All figures of an image against the mean of two references, counting the pixels of a mask.
    ///
    /// # Errors
    /// [`MetricsError`] where the sizes differ.
    pub fn compare(
        &self,
        image: &[[f32; 3]],
        references: &References,
        mask: Option<&[bool]>,
    ) -> Result<Metrics, MetricsError> {
        let truth = self.image(references.joined());
        compare(&self.image(image.to_vec()), &truth, Kind::Linear, mask)
    }

    /// All figures of an image against another.
    ///
    /// # Errors
    /// [`MetricsError`] where the sizes differ.
    pub fn compare_images(&self, image: &[[f32; 3]], truth: &[[f32; 3]]) -> Result<Metrics, MetricsError> {
        compare(
            &self.image(image.to_vec()),
            &self.image(truth.to_vec()),
            Kind::Linear,
            None,
        )
    }

    /// SSIM of an image; not a number where it has none.
    pub fn likeness(&self, image: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
        self.compare_images(image, truth)
            .ok()
            .and_then(|m| m.ssim)
            .unwrap_or(f64::NAN)
    }

    /// Figures of an image.
    pub fn figures(&self, image: &[[f32; 3]], references: &References) -> Figures {
        let (rel_mse, rel_mse_trimmed) = references.error(image);
        let metrics = self.compare(image, references, None).ok();
        let figure = |f: Option<f64>| f.unwrap_or(f64::NAN);
        Figures {
            rel_mse,
            rel_mse_trimmed,
            ssim: figure(metrics.as_ref().and_then(|m| m.ssim)),
            flip: figure(metrics.as_ref().and_then(|m| m.flip)),
            mean_ratio: mean(image) / references.mean,
        }
    }
}
