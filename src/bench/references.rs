//! Two independent references of an image, so that their own noise is no floor of the errors measured against them: the error
//! of an image I is the mean of (I−R1)(I−R2)/(R²+0.01·m²), R their mean and m its mean.

use rayon::prelude::*;

/// Linear RGB, row by row.
pub type Pixels = Vec<[f32; 3]>;

/// Two independent references of an image.
pub struct References {
    pub images: [Pixels; 2],
    /// Mean over pixels and channels of both.
    pub mean: f64,
}

/// Seed of a reference or truth, apart from those of the images that it judges.
pub fn reference_seed(base: u32, number: usize) -> u32 {
    base.wrapping_add(0x51ed_0001 + number as u32)
}

/// Mean over pixels and channels.
pub fn mean(pixels: &[[f32; 3]]) -> f64 {
    let sum: f64 = pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    sum / (pixels.len() * 3).max(1) as f64
}

impl References {
    /// Of two images.
    pub fn new(images: [Pixels; 2]) -> Self {
        let mean = 0.5 * (mean(&images[0]) + mean(&images[1]));
        Self { images, mean }
    }

    /// Mean of the two, the best estimate of the truth.
    pub fn joined(&self) -> Pixels {
        let [a, b] = &self.images;
        let pairs = a.iter().zip(b);
        pairs
            .map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c])))
            .collect()
    }

    /// Mean and trimmed mean over pixels of the product of the errors against both.
    pub fn error(&self, image: &[[f32; 3]]) -> (f64, f64) {
        let floor = 0.01 * self.mean * self.mean;
        let [r1, r2] = &self.images;
        let mut errors: Vec<f64> = (0..image.len())
            .into_par_iter()
            .map(|i| {
                (0..3)
                    .map(|c| {
                        let [v, a, b] = [image[i][c], r1[i][c], r2[i][c]].map(f64::from);
                        let r = 0.5 * (a + b);
                        (v - a) * (v - b) / (r * r + floor)
                    })
                    .sum::<f64>()
                    / 3.0
            })
            .collect();
        let n = errors.len().max(1);
        let whole = errors.iter().sum::<f64>() / n as f64;
        let kept = n - n / 1000;
        if kept < n {
            errors.select_nth_unstable_by(kept, f64::total_cmp);
        }
        (whole, errors[..kept].iter().sum::<f64>() / kept as f64)
    }

    /// Relative squared error of one reference.
    pub fn own_error(&self) -> f64 {
        let floor = 0.01 * self.mean * self.mean;
        let [r1, r2] = &self.images;
        let sum: f64 = r1
            .iter()
            .flatten()
            .zip(r2.iter().flatten())
            .map(|(a, b)| {
                let (a, b) = (f64::from(*a), f64::from(*b));
                let r = 0.5 * (a + b);
                (a - b) * (a - b) / (r * r + floor) * 0.5
            })
            .sum();
        sum / (r1.len() * 3) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_the_references_is_no_floor() {
        let noise = |i: usize, s: u32| crate::scene::sampling::unit(crate::scene::sampling::key(s, i as u32, 0)) - 0.5;
        let n = 100_000;
        let image = |amplitude: f32, s: u32| -> Pixels { (0..n).map(|i| [1.0 + amplitude * noise(i, s); 3]).collect() };
        let references = References {
            images: [image(0.2, 1), image(0.2, 2)],
            mean: 1.0,
        };
        // Variance of a uniform number is 1/12.
        let (exact, _) = references.error(&image(0.0, 3));
        assert!(exact.abs() < 1e-4, "{exact}");
        let (noisy, trimmed) = references.error(&image(1.0, 3));
        assert!((noisy - 1.0 / 12.0).abs() < 4e-3 && trimmed < noisy, "{noisy}");
        assert!((references.own_error() - 0.04 / 12.0).abs() < 3e-4);
    }
}
