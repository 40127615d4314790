//! Accumulated images: what `--spp` produces, what EXR files carry and `merge` joins.

use thiserror::Error;

/// Mean radiance of independent samples, with what is needed to go on accumulating. All planes are row by row from the
/// top; radiance is linear, scene-referred, in luxel units, before exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub width: u32,
    pub height: u32,
    /// Mean radiance.
    pub mean: Vec<[f32; 3]>,
    /// Samples behind each pixel.
    pub samples: Vec<f32>,
    /// Variance of the mean, averaged over the three channels; 0 for fewer than two samples.
    pub variance: Vec<f32>,
    /// Share of `mean` that is reflected direct light.
    pub direct: Vec<[f32; 3]>,
    /// Share of `mean` that the surface or sky seen emits.
    pub emission: Vec<[f32; 3]>,
    /// Share of `mean` that layers in front of it add.
    pub transparent: Vec<[f32; 3]>,
}

/// Why images cannot be joined.
#[derive(Debug, Error, PartialEq)]
pub enum FilmError {
    #[error("the images differ in size: {0}x{1} and {2}x{3} pixels")]
    Size(u32, u32, u32, u32),
}

impl Film {
    /// A film without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            mean: vec![[0.0; 3]; n],
            samples: vec![0.0; n],
            variance: vec![0.0; n],
            direct: vec![[0.0; 3]; n],
            emission: vec![[0.0; 3]; n],
            transparent: vec![[0.0; 3]; n],
        }
    }

    /// Joins another film's samples to this one's, as if all had been taken in one run (Chan, Golub, LeVeque 1983).
    ///
    /// # Errors
    /// [`FilmError::Size`] where the sizes differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmError> {
        if (self.width, self.height) != (other.width, other.height) {
            return Err(FilmError::Size(self.width, self.height, other.width, other.height));
        }
        for i in 0..self.mean.len() {
            let (na, nb) = (f64::from(self.samples[i]), f64::from(other.samples[i]));
            let n = na + nb;
            if nb == 0.0 {
                continue;
            }
            let join = |a: &mut [f32; 3], b: [f32; 3]| {
                for c in 0..3 {
                    a[c] = ((f64::from(a[c]) * na + f64::from(b[c]) * nb) / n) as f32;
                }
            };
            let between: f64 = (0..3)
                .map(|c| (f64::from(self.mean[i][c]) - f64::from(other.mean[i][c])).powi(2))
                .sum::<f64>()
                / 3.0;
            let m2 = |variance: f32, n: f64| f64::from(variance) * n * (n - 1.0);
            let total = m2(self.variance[i], na) + m2(other.variance[i], nb) + between * na * nb / n;
            join(&mut self.mean[i], other.mean[i]);
            join(&mut self.direct[i], other.direct[i]);
            join(&mut self.emission[i], other.emission[i]);
            join(&mut self.transparent[i], other.transparent[i]);
            self.variance[i] = if n > 1.0 { (total / (n * (n - 1.0))) as f32 } else { 0.0 };
            self.samples[i] = n as f32;
        }
        Ok(())
    }

    /// Pixels with a value that is not finite.
    pub fn non_finite(&self) -> usize {
        self.mean.iter().filter(|p| !p.iter().all(|c| c.is_finite())).count()
    }

    /// Pixels without any radiance.
    pub fn black(&self) -> usize {
        self.mean.iter().filter(|p| p.iter().all(|c| *c == 0.0)).count()
    }
}

/// Geometry of the first opaque hit through each pixel's centre; what rays miss is NaN-free: zeros, depth 0, numbers −1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    pub width: u32,
    pub height: u32,
    /// Linear reflectance.
    pub albedo: Vec<[f32; 3]>,
    /// Shading normal, world space.
    pub normal: Vec<[f32; 3]>,
    /// Geometric normal, world space.
    pub geo_normal: Vec<[f32; 3]>,
    /// World position, units.
    pub position: Vec<[f32; 3]>,
    /// Distance along the ray, units.
    pub depth: Vec<f32>,
    /// Previous − current image position in pixels, y down.
    pub motion: Vec<[f32; 2]>,
    /// PVS cluster of the receiver, −1 none.
    pub cluster: Vec<f32>,
    /// Material (the map's shader entry), −1 none.
    pub material: Vec<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merging_equals_one_run() {
        let values: Vec<f32> = (0..12).map(|i| ((i * 37) % 11) as f32).collect();
        let film = |v: &[f32]| {
            let n = v.len() as f32;
            let mean = v.iter().sum::<f32>() / n;
            let m2: f32 = v.iter().map(|x| (x - mean).powi(2)).sum();
            let mut f = Film::new(1, 1);
            f.mean[0] = [mean; 3];
            f.direct[0] = [mean * 0.5; 3];
            f.samples[0] = n;
            f.variance[0] = m2 / (n * (n - 1.0));
            f
        };
        let whole = film(&values);
        let mut joined = film(&values[..3]);
        assert_eq!(joined.merge(&film(&values[3..])), Ok(()));
        assert!((joined.mean[0][0] - whole.mean[0][0]).abs() < 1e-6);
        assert!((joined.direct[0][1] - whole.direct[0][1]).abs() < 1e-6);
        assert!((joined.variance[0] - whole.variance[0]).abs() < 1e-6);
        assert_eq!(joined.samples[0], 12.0);
        assert!(joined.merge(&Film::new(2, 1)).is_err());
    }
}
