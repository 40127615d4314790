//! Two independent truths of a view, made finer until they tell errors well enough.
//!
//! Each truth is the mean of two parts, so that what its noise does to an error is known, too: the error is bilinear in the two
//! truths, and half the difference between what the parts of one give is a sample of the deviation that it causes.

use super::lights::REFERENCE;
use super::references::{Pixels, References, mean, reference_seed};
use super::stage::Stage;
use crate::output::checksum::fnv1a;
use crate::output::{OutputError, exr_file};
use crate::render::scene_gpu::RenderError;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use rayon::prelude::*;
use std::path::Path;

/// Changes whenever the same view would come out otherwise.
const VERSION: u32 = 1;

/// See the module.
pub struct Truth {
    /// `parts[truth][part]`.
    parts: [[Pixels; 2]; 2],
    /// Samples of each part.
    pub samples: u32,
    /// Both truths as they are now.
    pub references: References,
}

/// An error and how well it is known.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub rel_mse: f64,
    /// Standard error that the truths' noise causes.
    pub deviation: f64,
    pub rel_mse_trimmed: f64,
    pub rmse: f64,
}

fn halfway(a: &Pixels, b: &Pixels) -> Pixels {
    a.iter()
        .zip(b)
        .map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c])))
        .collect()
}

/// The samples `range` of a truth, averaged.
fn part(stage: &mut Stage, camera: &Camera, truth: usize, range: std::ops::Range<u32>) -> Result<Pixels, RenderError> {
    let settings = Settings {
        seed: reference_seed(stage.base.seed, truth),
        ..REFERENCE.settings(&stage.base)
    };
    stage.accumulated_from(camera, &settings, range)
}

impl Truth {
    fn of(parts: [[Pixels; 2]; 2], samples: u32) -> Self {
        let references = References::new([halfway(&parts[0][0], &parts[0][1]), halfway(&parts[1][0], &parts[1][1])]);
        Self {
            parts,
            samples,
            references,
        }
    }

    /// Truths of twice so many samples.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(stage: &mut Stage, camera: &Camera, samples: u32) -> Result<Self, RenderError> {
        let mut parts = [[Vec::new(), Vec::new()], [Vec::new(), Vec::new()]];
        for (truth, halves) in parts.iter_mut().enumerate() {
            for (k, half) in (0u32..).zip(halves) {
                *half = part(stage, camera, truth, samples * k..samples * (k + 1))?;
            }
        }
        Ok(Self::of(parts, samples))
    }

    /// Doubles the samples.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn refine(self, stage: &mut Stage, camera: &Camera) -> Result<Self, RenderError> {
        let all = self.samples * 2;
        let [first, second] = self.references.images;
        let more = |stage: &mut Stage, truth| part(stage, camera, truth, all..all * 2);
        let parts = [[first, more(stage, 0)?], [second, more(stage, 1)?]];
        Ok(Self::of(parts, all))
    }

    /// The error of an image.
    pub fn error(&self, image: &[[f32; 3]]) -> Estimate {
        let floor = 0.01 * self.references.mean * self.references.mean;
        let [r1, r2] = &self.references.images;
        let zero = || ([0.0f64; 4], 0.0f64);
        let (sums, square) = (0..image.len())
            .into_par_iter()
            .fold(zero, |(mut sums, mut square), i| {
                for c in 0..3 {
                    let r = 0.5 * (f64::from(r1[i][c]) + f64::from(r2[i][c]));
                    let off = |p: &Pixels| f64::from(image[i][c]) - f64::from(p[i][c]);
                    let [a, b] = self.parts.each_ref().map(|t| t.each_ref().map(off));
                    for k in 0..4 {
                        sums[k] += a[k / 2] * b[k % 2] / (r * r + floor);
                    }
                    square += off(r1) * off(r2);
                }
                (sums, square)
            })
            .reduce(zero, |(a, x), (b, y)| (std::array::from_fn(|k| a[k] + b[k]), x + y));
        let n = (image.len() * 3).max(1) as f64;
        let e = sums.map(|s| s / n);
        let by_first = 0.5 * (e[0] + e[1] - e[2] - e[3]);
        let by_second = 0.5 * (e[0] + e[2] - e[1] - e[3]);
        Estimate {
            rel_mse: e.iter().sum::<f64>() / 4.0,
            deviation: 0.5 * by_first.hypot(by_second),
            rel_mse_trimmed: self.references.error(image).1,
            rmse: (square / n).max(0.0).sqrt(),
        }
    }

    /// Mean of an image over that of the truths.
    pub fn mean_ratio(&self, image: &[[f32; 3]]) -> f64 {
        mean(image) / self.references.mean
    }

    /// Writes it, to go on from later.
    ///
    /// # Errors
    /// [`OutputError`] naming the file.
    pub fn write(&self, path: &Path, size: (u32, u32)) -> Result<(), OutputError> {
        let mut planes = vec![("samples".to_owned(), vec![self.samples as f32; self.parts[0][0].len()])];
        for (truth, halves) in self.parts.iter().enumerate() {
            for (k, pixels) in halves.iter().enumerate() {
                for (c, name) in ["R", "G", "B"].iter().enumerate() {
                    planes.push((format!("t{truth}p{k}{name}"), pixels.iter().map(|p| p[c]).collect()));
                }
            }
        }
        exr_file::write(path, size.0, size.1, planes, &[])
    }

    /// Reads what [`Self::write`] has written; `None` where that is of another size or damaged.
    pub fn read(path: &Path, size: (u32, u32)) -> Option<Self> {
        let (width, height, planes) = exr_file::read(path).ok()?;
        let plane = |name: String| planes.iter().find(|(n, _)| *n == name).map(|(_, values)| values);
        let pixels = |truth: usize, k: usize| {
            let [r, g, b] = ["R", "G", "B"].map(|c| plane(format!("t{truth}p{k}{c}")));
            let (r, g, b) = (r?, g?, b?);
            Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect::<Pixels>())
        };
        let samples = *plane("samples".to_owned())?.first()? as u32;
        let parts = [[pixels(0, 0)?, pixels(0, 1)?], [pixels(1, 0)?, pixels(1, 1)?]];
        let whole = parts
            .as_flattened()
            .iter()
            .all(|p| p.len() == (size.0 * size.1) as usize);
        (whole && (width, height) == size && samples > 0).then(|| Self::of(parts, samples))
    }
}

/// What a truth depends on: everything of the scene that is rendered, the view and the settings.
pub fn content_hash(scene: &Scene, camera: &Camera, size: (u32, u32), base: &Settings) -> u64 {
    let text = format!("{VERSION} {camera:?} {size:?} {base:?} {}", env!("CARGO_PKG_VERSION"));
    let mut parts: Vec<&[u8]> = vec![
        text.as_bytes(),
        bytemuck::cast_slice(&scene.geometry.positions),
        bytemuck::cast_slice(&scene.geometry.attributes),
        bytemuck::cast_slice(&scene.geometry.triangles),
        bytemuck::cast_slice(&scene.materials),
        bytemuck::cast_slice(&scene.lights.lights),
    ];
    parts.extend(scene.textures.iter().map(|t| t.levels[0].as_flattened()));
    fnv1a(&parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(amplitude: f32, seed: u32) -> Pixels {
        let at = |i: u32| crate::scene::sampling::unit(crate::scene::sampling::key(seed, i, 0)) - 0.5;
        (0..20_000).map(|i| [1.0 + amplitude * at(i); 3]).collect()
    }

    /// The error is found without a floor, and its deviation over many truths is what one of them says, or a little less: where the
    /// truths are noisier than the image, the product of their noises is counted for both.
    #[test]
    fn the_noise_of_truths_is_known() {
        let image = noise(1.0, 1);
        let (mut sum, mut squares, mut said) = (0.0, 0.0, 0.0);
        let n = 200u32;
        for k in 0..n {
            let s = |i: u32| noise(1.0, 100 + k * 4 + i);
            let e = Truth::of([[s(0), s(1)], [s(2), s(3)]], 1).error(&image);
            sum += e.rel_mse;
            squares += e.rel_mse * e.rel_mse;
            said += e.deviation * e.deviation;
        }
        let n = f64::from(n);
        let (mean, variance) = (sum / n, squares / n - (sum / n).powi(2));
        // Variance of a uniform number over the truth's square and its floor, a little less for the noise in that.
        assert!((mean * 12.0 - 1.0).abs() < 0.2, "{mean}");
        let ratio = (said / n / variance).sqrt();
        assert!((0.9..1.6).contains(&ratio), "{ratio}");
    }

    #[test]
    fn files_keep_truths() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("t.exr");
        let part = |s| noise(1.0, s)[..12].to_vec();
        let truth = Truth::of([[part(0), part(1)], [part(2), part(3)]], 7);
        truth.write(&path, (4, 3)).expect("written");
        let back = Truth::read(&path, (4, 3)).expect("read");
        assert_eq!((back.samples, back.parts), (7, truth.parts));
        assert!(Truth::read(&path, (3, 4)).is_none());
        std::fs::write(&path, b"x").expect("written");
        assert!(Truth::read(&path, (4, 3)).is_none());
    }
}
