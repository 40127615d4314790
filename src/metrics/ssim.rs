//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004) of tone-mapped luminances.
//!
//! Window and averaging are scikit-image's with `gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
//! data_range=1`: an 11×11 Gaussian, the mean over pixels whose window lies inside the image.

use super::color::{luminance, srgb_encode};
use super::filter::Kernel;
use super::types::ImageRgb;
use rayon::prelude::*;

const SIGMA: f64 = 1.5;
/// 3.5 sigma, rounded.
const RADIUS: usize = 5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean SSIM over the `counted` pixels at least five pixels from every border; `None` where there is none.
pub(super) fn ssim(a: &ImageRgb, b: &ImageRgb, counted: &[bool]) -> Option<f64> {
    let (width, height) = (b.width, b.height);
    if width <= 2 * RADIUS || height <= 2 * RADIUS {
        return None;
    }
    let inner = width - 2 * RADIUS;
    let scale = exposure(b);
    let (a, b) = (tone_mapped(a, scale), tone_mapped(b, scale));
    let kernel = Kernel::<f64>::gaussian(SIGMA, RADIUS, 1.0);

    // Each row of `along` holds five filtered rows: a, b, a², b², ab.
    let mut along = vec![0.0; height * 5 * inner];
    along.par_chunks_mut(5 * inner).enumerate().for_each_init(
        || vec![0.0; width],
        |product, (y, block)| {
            let (a, b) = (&a[y * width..][..width], &b[y * width..][..width]);
            for (moment, out) in block.chunks_exact_mut(inner).enumerate() {
                for (p, (a, b)) in product.iter_mut().zip(a.iter().zip(b)) {
                    *p = match moment {
                        0 => *a,
                        1 => *b,
                        2 => a * a,
                        3 => b * b,
                        _ => a * b,
                    };
                }
                kernel.apply(|offset| &product[RADIUS.strict_add_signed(offset)..], out);
            }
        },
    );

    let rows = (RADIUS..height - RADIUS).into_par_iter().map_init(
        || vec![0.0; 5 * inner],
        |moments, y| {
            for (moment, out) in moments.chunks_exact_mut(inner).enumerate() {
                kernel.apply(
                    |offset| &along[(y.strict_add_signed(offset) * 5 + moment) * inner..][..inner],
                    out,
                );
            }
            let (mut sum, mut count) = (0.0, 0_usize);
            for x in (0..inner).filter(|x| counted[y * width + RADIUS + x]) {
                sum += similarity([0, 1, 2, 3, 4].map(|moment| moments[moment * inner + x]));
                count += 1;
            }
            (sum, count)
        },
    );
    // Summed in row order, so that the figure does not depend on the threads.
    let rows: Vec<(f64, usize)> = rows.collect();
    let (sum, count) = rows
        .iter()
        .fold((0.0, 0), |total, row| (total.0 + row.0, total.1 + row.1));
    (count > 0).then(|| sum / count as f64)
}

fn similarity([a, b, aa, bb, ab]: [f64; 5]) -> f64 {
    let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
    (2.0 * a * b + C1) * (2.0 * covariance + C2) / ((a * a + b * b + C1) * (variance_a + variance_b + C2))
}

/// The factor that brings the image's log-average luminance to 0.18. Pixels without positive luminance have no
/// logarithm and are left out; an image without any other keeps its scale.
fn exposure(image: &ImageRgb) -> f64 {
    let logs = || {
        image
            .pixels
            .iter()
            .map(|p| luminance(*p))
            .filter(|y| *y > 0.0)
            .map(f64::ln)
    };
    let count = logs().count();
    if count == 0 {
        1.0
    } else {
        0.18 / (logs().sum::<f64>() / count as f64).exp()
    }
}

/// Scaled luminance through x/(1+x) and the sRGB curve: 0..1.
fn tone_mapped(image: &ImageRgb, scale: f64) -> Vec<f64> {
    let tone_map = |x: f64| srgb_encode(x / (1.0 + x));
    image
        .pixels
        .par_iter()
        .map(|p| tone_map((luminance(*p) * scale).max(0.0)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checks(low: f32, high: f32) -> ImageRgb {
        let value = |i: usize| {
            if (i % 24 / 3 + i / 24 / 3).is_multiple_of(2) {
                low
            } else {
                high
            }
        };
        ImageRgb {
            width: 24,
            height: 24,
            pixels: (0..576).map(|i| [value(i); 3]).collect(),
        }
    }

    #[test]
    fn one_exposure_for_both() {
        let b = checks(0.2, 0.8);
        assert!((ssim(&checks(0.2, 0.8), &b, &[true; 576]).unwrap() - 1.0).abs() < 1e-12);
        let brighter = ssim(&checks(0.4, 1.6), &b, &[true; 576]).unwrap();
        assert!(brighter < 0.99 && brighter > 0.5);
        assert!(ssim(&checks(0.8, 0.2), &b, &[true; 576]).unwrap() < 0.0);
        // Scaling both images changes nothing.
        let scaled = ssim(&checks(400.0, 1600.0), &checks(200.0, 800.0), &[true; 576]).unwrap();
        assert!((scaled - brighter).abs() < 1e-6);
    }

    #[test]
    fn only_pixels_inside_count() {
        let b = checks(0.2, 0.8);
        let border: Vec<bool> = (0..576).map(|i| i % 24 < 5 || i / 24 < 5).collect();
        assert_eq!(ssim(&b, &b, &border), None);
    }

    #[test]
    fn black_has_no_log_average() {
        let mut b = checks(0.18, 0.18);
        b.pixels[0] = [0.0; 3];
        assert!((exposure(&b) - 1.0).abs() < 1e-6);
        assert_eq!(exposure(&checks(0.0, 0.0)), 1.0);
    }
}
