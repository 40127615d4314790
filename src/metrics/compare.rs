//! One comparison: checks the input, decides which pixels count and gathers the figures.

use super::types::{ImageRgb, Kind, Metrics, MetricsError};
use super::{basic, flip_hdr, flip_ldr, ssim};
use std::borrow::Cow;

/// All figures of A (the image) against B (the reference), see [`Metrics`].
///
/// `mask` has one value per pixel, true = counted. SSIM and FLIP see the whole images, so that masked-off neighbours
/// act in their windows and in their exposure, and are averaged over counted pixels. Pixels not finite in either image
/// are black in both for them, and not counted.
pub fn compare(a: &ImageRgb, b: &ImageRgb, kind: Kind, mask: Option<&[bool]>) -> Result<Metrics, MetricsError> {
    let finite = check(a, b)?;
    if let Some(mask) = mask
        && mask.len() != finite.len()
    {
        return Err(MetricsError::MaskSize {
            mask: mask.len(),
            pixels: finite.len(),
        });
    }
    let selected = |i: usize| mask.is_none_or(|mask| mask[i]);
    let counted: Vec<bool> = finite
        .iter()
        .enumerate()
        .map(|(i, finite)| *finite && selected(i))
        .collect();
    let nan_count = finite
        .iter()
        .enumerate()
        .filter(|(i, finite)| !**finite && selected(*i))
        .count();

    let figures = basic::basic(&a.pixels, &b.pixels, kind, &counted);
    let (a, b) = (blackened(a, &finite), blackened(b, &finite));
    let (ssim, flip) = if counted.contains(&true) {
        (ssim::ssim(&a, &b, &counted), mean(&flip_map(&a, &b, kind), &counted))
    } else {
        (None, None)
    };
    let defined = |figure: f64| figure.is_finite().then_some(figure);
    Ok(Metrics {
        rel_mse: defined(figures.rel_mse),
        mean_ratio: defined(figures.mean_a / figures.mean_b),
        rmse: defined(figures.rmse),
        mean_a: defined(figures.mean_a),
        mean_b: defined(figures.mean_b),
        ssim: ssim.and_then(defined),
        flip: flip.and_then(defined),
        psnr: defined(figures.psnr),
        max_abs: defined(figures.max_abs),
        nan_count,
        rel_mse_trimmed: defined(figures.rel_mse_trimmed),
    })
}

/// Refuses images that do not fit each other; per pixel, whether it is finite in both.
pub(super) fn check(a: &ImageRgb, b: &ImageRgb) -> Result<Vec<bool>, MetricsError> {
    for image in [a, b] {
        if image.width.checked_mul(image.height) != Some(image.pixels.len()) {
            let pixels = image.pixels.len();
            return Err(MetricsError::PixelCount {
                width: image.width,
                height: image.height,
                pixels,
            });
        }
    }
    if (a.width, a.height) != (b.width, b.height) {
        return Err(MetricsError::SizesDiffer {
            a: (a.width, a.height),
            b: (b.width, b.height),
        });
    }
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|value| value.is_finite());
    Ok(a.pixels
        .iter()
        .zip(&b.pixels)
        .map(|(a, b)| finite(a) && finite(b))
        .collect())
}

/// The image with every pixel that is not `finite` black.
pub(super) fn blackened<'a>(image: &'a ImageRgb, finite: &[bool]) -> Cow<'a, ImageRgb> {
    let mut image = Cow::Borrowed(image);
    for (i, _) in finite.iter().enumerate().filter(|(_, finite)| !**finite) {
        image.to_mut().pixels[i] = [0.0; 3];
    }
    image
}

/// The FLIP error per pixel, 0..1, of images that are finite everywhere.
pub(super) fn flip_map(a: &ImageRgb, b: &ImageRgb, kind: Kind) -> Vec<f32> {
    match kind {
        Kind::Linear => flip_hdr::error_map(a, b),
        Kind::Display => flip_ldr::error_map(a, b),
    }
}

fn mean(map: &[f32], counted: &[bool]) -> Option<f64> {
    let values = || {
        map.iter()
            .zip(counted)
            .filter(|(_, counted)| **counted)
            .map(|(value, _)| f64::from(*value))
    };
    let count = values().count();
    (count > 0).then(|| values().sum::<f64>() / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: usize, height: usize) -> ImageRgb {
        let value = |i: usize| (i * 37 % 101) as f32 / 101.0;
        ImageRgb {
            width,
            height,
            pixels: (0..width * height)
                .map(|i| [value(i), value(i + 3), value(i + 5)])
                .collect(),
        }
    }

    #[test]
    fn an_image_equals_itself() {
        for kind in [Kind::Linear, Kind::Display] {
            let image = ramp(33, 17);
            let m = compare(&image, &image, kind, None).unwrap();
            assert_eq!(
                (m.rel_mse, m.rmse, m.max_abs, m.rel_mse_trimmed),
                (Some(0.0), Some(0.0), Some(0.0), Some(0.0))
            );
            assert_eq!(
                (m.mean_ratio, m.flip, m.psnr, m.nan_count),
                (Some(1.0), Some(0.0), None, 0)
            );
            assert!((m.ssim.unwrap() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn black_images_are_equal_and_their_ratios_undefined() {
        let black = ImageRgb {
            width: 12,
            height: 12,
            pixels: vec![[0.0; 3]; 144],
        };
        let m = compare(&black, &black, Kind::Linear, None).unwrap();
        assert_eq!((m.rmse, m.flip, m.ssim), (Some(0.0), Some(0.0), Some(1.0)));
        assert_eq!((m.rel_mse, m.mean_ratio, m.psnr), (None, None, None));
        assert!(serde_json::to_string(&m).unwrap().contains("\"mean_ratio\":null"));
    }

    #[test]
    fn pixels_not_finite_are_counted_and_left_out() {
        let b = ramp(20, 20);
        let mut a = b.clone();
        a.pixels[45][1] = f32::NAN;
        a.pixels[111][0] = f32::INFINITY;
        let m = compare(&a, &b, Kind::Linear, None).unwrap();
        assert_eq!((m.nan_count, m.rel_mse, m.flip), (2, Some(0.0), Some(0.0)));
        let reversed = compare(&b, &a, Kind::Linear, None).unwrap();
        assert_eq!((reversed.nan_count, reversed.mean_b), (2, m.mean_a));
        let mask: Vec<bool> = (0..400).map(|i| i != 45).collect();
        assert_eq!(compare(&a, &b, Kind::Linear, Some(&mask)).unwrap().nan_count, 1);
    }

    #[test]
    fn the_mask_hides_a_difference() {
        let b = ramp(64, 64);
        let mut a = b.clone();
        a.pixels[0] = [9.0; 3];
        // Beyond the widest window, 10 pixels, the maps do not see the corner.
        let mask: Vec<bool> = (0..64 * 64).map(|i| i % 64 > 12 && i / 64 > 12).collect();
        for kind in [Kind::Linear, Kind::Display] {
            let m = compare(&a, &b, kind, Some(&mask)).unwrap();
            assert_eq!((m.rmse, m.max_abs, m.flip), (Some(0.0), Some(0.0), Some(0.0)));
            assert!((m.ssim.unwrap() - 1.0).abs() < 1e-12);
            assert!(compare(&a, &b, kind, None).unwrap().flip > Some(0.0));
        }
        let none = compare(&a, &b, Kind::Linear, Some(&[false; 64 * 64])).unwrap();
        assert_eq!(
            (none.rel_mse, none.mean_a, none.ssim, none.flip, none.max_abs),
            (None, None, None, None, None)
        );
    }

    #[test]
    fn small_images_have_no_ssim() {
        let (a, b) = (ramp(10, 40), ramp(10, 40));
        let m = compare(&a, &b, Kind::Linear, None).unwrap();
        assert_eq!((m.ssim, m.flip), (None, Some(0.0)));
        let one = ramp(1, 1);
        assert_eq!(compare(&one, &one, Kind::Display, None).unwrap().flip, Some(0.0));
        let empty = ramp(0, 0);
        assert_eq!(compare(&empty, &empty, Kind::Linear, None).unwrap().flip, None);
    }

    #[test]
    fn misfits_are_refused() {
        let (a, b) = (ramp(4, 6), ramp(6, 4));
        let sizes = compare(&a, &b, Kind::Linear, None).unwrap_err();
        assert_eq!(sizes.to_string(), "the images differ in size: 4x6 against 6x4");
        let mask = compare(&a, &a, Kind::Linear, Some(&[true])).unwrap_err();
        assert_eq!(mask, MetricsError::MaskSize { mask: 1, pixels: 24 });
        let short = ImageRgb {
            width: 4,
            height: 6,
            pixels: vec![[0.0; 3]; 5],
        };
        assert_eq!(
            compare(&a, &short, Kind::Linear, None),
            Err(MetricsError::PixelCount {
                width: 4,
                height: 6,
                pixels: 5
            })
        );
    }
}
