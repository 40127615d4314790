//! HDR-FLIP: the largest LDR-FLIP error over a range of exposures.
//!
//! Andersson, Nilsson, Shirley, Akenine-Möller: Visualizing Errors in Rendered High Dynamic Range Images, Eurographics
//! Short Papers 2021. Tone mapper and automatic exposures as `flip-evaluator`'s defaults.

use super::color::{ACES, aces, luminance};
use super::flip_ldr::LdrFlip;
use super::types::ImageRgb;

/// The tone-mapped value that the reference's brightest and its median luminance have at the two end exposures.
const TARGET: f64 = 0.85;

/// HDR-FLIP error per pixel, 0..1, of linear images of equal size, finite everywhere; negative values act as 0.
pub(super) fn error_map(a: &ImageRgb, b: &ImageRgb) -> Vec<f32> {
    let mut errors = vec![0.0; b.pixels.len()];
    let mut flip = LdrFlip::new(b.width, b.height);
    for exposure in exposures(b) {
        let scale = exposure.exp2();
        flip.raise(&mut errors, a, b, |[r, g, b]| {
            [aces(r * scale), aces(g * scale), aces(b * scale)]
        });
    }
    errors
}

/// Exposures in stops, from "the brightest pixel is not burnt out" to "the median pixel is bright", at most one stop
/// apart and at least two. In f32 like the published tool, so that the number of steps is the same.
fn exposures(reference: &ImageRgb) -> Vec<f32> {
    let mut luminances: Vec<f32> = reference.pixels.iter().map(|p| luminance(*p) as f32).collect();
    if luminances.is_empty() {
        return Vec::new();
    }
    let largest = luminances.iter().fold(0.0_f32, |largest, y| largest.max(*y));
    let middle = luminances.len() / 2;
    let median = *luminances.select_nth_unstable_by(middle, f32::total_cmp).1;
    let target = inverse_aces(TARGET) as f32;
    let [start, stop] = [largest, median].map(|y| (target / y.max(f32::EPSILON)).log2());
    let count = ((stop - start).ceil() as usize).max(2);
    let step = (stop - start) / (count - 1) as f32;
    (0..count).map(|i| start + i as f32 * step).collect()
}

/// The radiance that the ACES fit maps to `t`, below 1: the positive root of its quadratic equation.
fn inverse_aces(t: f64) -> f64 {
    let [n, d] = ACES;
    let [a, b, c] = [0, 1, 2].map(|i| n[i] - t * d[i]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_of_the_tone_map() {
        assert!((f64::from(aces(inverse_aces(TARGET) as f32)) - TARGET).abs() < 1e-6);
    }

    #[test]
    fn exposures_span_brightest_to_median() {
        let mut image = ImageRgb {
            width: 5,
            height: 1,
            pixels: vec![[1.0; 3]; 5],
        };
        image.pixels[0] = [16.5; 3];
        let stops = exposures(&image);
        assert_eq!(stops.len(), 5);
        assert!((stops[4] - stops[0] - 16.5_f32.log2()).abs() < 1e-5);
        assert!((stops[4] - 1.083_297).abs() < 1e-5);
        image.pixels.fill([0.0; 3]);
        assert_eq!(exposures(&image).len(), 2);
    }

    #[test]
    fn a_difference_in_the_highlights_shows() {
        let b = ImageRgb {
            width: 30,
            height: 30,
            pixels: vec![[100.0; 3]; 900],
        };
        let a = ImageRgb {
            width: 30,
            height: 30,
            pixels: vec![[50.0; 3]; 900],
        };
        assert!(error_map(&a, &b).iter().all(|error| *error > 0.1 && *error <= 1.0));
    }
}
