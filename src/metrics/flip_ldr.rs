//! LDR-FLIP: the difference an observer sees when flipping between two display images.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP: A Difference Evaluator for Alternating
//! Images, HPG 2020. Written from the paper; the viewing distance and constants are `flip-evaluator`'s defaults.
//!
//! Every filter of the paper is a product of a horizontal and a vertical kernel, or a sum of two such. One pass over
//! the rows filters along them, a second filters across and combines both images into the error.

use super::color::{hunt_lab_from_xyz, hyab, rgb_from_xyz, xyz_from_rgb};
use super::filter::Kernel;
use super::types::ImageRgb;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of visual angle: 0.7 m before a display 0.7 m and 3840 pixels wide, 67 in short.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;
/// Contrast sensitivity of each opponent channel, pairs (a, b) of the terms a·√(π/b)·exp(−π²d²/b), d in degrees.
const ACHROMATIC: [(f64, f64); 1] = [(1.0, 0.0047)];
const RED_GREEN: [(f64, f64); 1] = [(1.0, 0.0053)];
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
/// Width of the feature detectors in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponents of the colour and the feature difference, and the knee of the colour difference's range.
const COLOUR_EXPONENT: f32 = 0.7;
const KNEE_IN: f32 = 0.4;
const KNEE_OUT: f32 = 0.95;

/// LDR-FLIP error per pixel, 0..1, of linear images of equal size in display range (clamped to 0..1).
pub(super) fn error_map(a: &ImageRgb, b: &ImageRgb) -> Vec<f32> {
    let mut errors = vec![0.0; b.pixels.len()];
    LdrFlip::new(b.width, b.height).raise(&mut errors, a, b, clamped);
    errors
}

#[inline]
fn clamped([r, g, b]: [f32; 3]) -> [f32; 3] {
    [r.clamp(0.0, 1.0), g.clamp(0.0, 1.0), b.clamp(0.0, 1.0)]
}

/// Rows filtered along, per image row: Y, X−Y, the two terms of Y−Z, and Y under the three feature kernels.
const ALONG: usize = 7;
/// Rows filtered across, per image row: Y, X−Y, the two terms of Y−Z, edges in x and y, points in x and y.
const ACROSS: usize = 8;

/// The kernels for one image size, with room for the intermediate rows.
pub(super) struct LdrFlip {
    width: usize,
    /// Kernel along the row and source (0 = Y, 1 = X−Y, 2 = Y−Z) of each of the `ALONG` rows.
    along: [(Kernel<f32>, usize); ALONG],
    /// Kernel across the rows and the one of the `ALONG` rows it filters, for each of the `ACROSS` rows.
    across: [(Kernel<f32>, usize); ACROSS],
    largest_colour_difference: f32,
    rows_a: Vec<f32>,
    rows_b: Vec<f32>,
}

impl LdrFlip {
    /// For images of `width` by `height` pixels.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let radius = colour_radius();
        let colour = |channel: &[(f64, f64)], term: usize, sum: f64| {
            let sigma = sigma(channel[term].1);
            // Six standard deviations out a weight is lost in f32.
            Kernel::gaussian(sigma, radius.min((6.0 * sigma).ceil() as usize), sum)
        };
        let weights = term_weights(&BLUE_YELLOW, radius);
        let feature_sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let feature_radius = (3.0 * feature_sigma).ceil() as usize;
        let blur = || Kernel::gaussian(feature_sigma, feature_radius, 1.0);
        let edge = || Kernel::first_derivative(feature_sigma, feature_radius);
        let point = || Kernel::second_derivative(feature_sigma, feature_radius);
        Self {
            width,
            along: [
                (colour(&ACHROMATIC, 0, 1.0), 0),
                (colour(&RED_GREEN, 0, 1.0), 1),
                (colour(&BLUE_YELLOW, 0, 1.0), 2),
                (colour(&BLUE_YELLOW, 1, 1.0), 2),
                (blur(), 0),
                (edge(), 0),
                (point(), 0),
            ],
            across: [
                (colour(&ACHROMATIC, 0, 1.0), 0),
                (colour(&RED_GREEN, 0, 1.0), 1),
                (colour(&BLUE_YELLOW, 0, weights[0]), 2),
                (colour(&BLUE_YELLOW, 1, weights[1]), 3),
                (blur(), 5),
                (edge(), 4),
                (blur(), 6),
                (point(), 4),
            ],
            largest_colour_difference: largest_colour_difference(),
            rows_a: vec![0.0; ALONG * width * height],
            rows_b: vec![0.0; ALONG * width * height],
        }
    }

    /// Raises each of `errors` to the FLIP error of A against B where that is larger; `display` brings a pixel into
    /// linear display range.
    pub(super) fn raise(
        &mut self,
        errors: &mut [f32],
        a: &ImageRgb,
        b: &ImageRgb,
        display: impl Fn([f32; 3]) -> [f32; 3] + Sync,
    ) {
        let width = self.width;
        if width == 0 {
            return;
        }
        filter_along(&self.along, a, &display, &mut self.rows_a);
        filter_along(&self.along, b, &display, &mut self.rows_b);
        errors.par_chunks_mut(width).enumerate().for_each_init(
            || {
                [
                    vec![0.0; ACROSS * width],
                    vec![0.0; ACROSS * width],
                    vec![0.0; 2 * width],
                ]
            },
            |[a, b, differences], (y, errors)| {
                filter_across(&self.across, &self.rows_a, width, y, a);
                filter_across(&self.across, &self.rows_b, width, y, b);
                let (colours, features) = differences.split_at_mut(width);
                differ_by_colour(a, b, colours);
                differ_by_feature(a, b, features);
                for ((error, colour), feature) in errors.iter_mut().zip(colours).zip(features) {
                    let colour = redistribute(*colour, self.largest_colour_difference);
                    *error = error.max(colour.powf(1.0 - *feature));
                }
            },
        );
    }
}

/// HyAB distance at each pixel of a row between the colours seen in both images. A loop of its own, without calls into
/// the mathematics library, so that it compiles to vector code.
fn differ_by_colour(a: &[f32], b: &[f32], out: &mut [f32]) {
    let width = out.len();
    let rows = |rows| -> [&[f32]; 4] { std::array::from_fn(|i| row(rows, i, width)) };
    let (a, b) = (rows(a), rows(b));
    for (x, out) in out.iter_mut().enumerate() {
        let a = seen_colour([a[0][x], a[1][x], a[2][x], a[3][x]]);
        let b = seen_colour([b[0][x], b[1][x], b[2][x], b[3][x]]);
        *out = hyab(a, b);
    }
}

/// Feature difference at each pixel of a row, 0..1: of edges or of points, whichever is larger.
fn differ_by_feature(a: &[f32], b: &[f32], out: &mut [f32]) {
    let width = out.len();
    let rows = |rows| -> [&[f32]; 4] { std::array::from_fn(|i| row(rows, 4 + i, width)) };
    let (a, b) = (rows(a), rows(b));
    for (x, out) in out.iter_mut().enumerate() {
        let size = |x: f32, y: f32| (x * x + y * y).sqrt();
        let edge = (size(a[0][x], a[1][x]) - size(b[0][x], b[1][x])).abs();
        let point = (size(a[2][x], a[3][x]) - size(b[2][x], b[3][x])).abs();
        *out = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
    }
}

fn row(rows: &[f32], i: usize, width: usize) -> &[f32] {
    &rows[i * width..][..width]
}

/// Filters along the rows: the image's opponent channels into `ALONG` rows each, the border pixel repeated outside.
///
/// FLIP's Y_yC_xC_z is linear in XYZ and its kernels sum to 1, so Y, X−Y and Y−Z relative to white stand for it.
fn filter_along(
    kernels: &[(Kernel<f32>, usize); ALONG],
    image: &ImageRgb,
    display: &(impl Fn([f32; 3]) -> [f32; 3] + Sync),
    rows: &mut [f32],
) {
    let width = image.width;
    let border = kernels.iter().map(|(kernel, _)| kernel.radius()).max().unwrap_or(0);
    let padded = width + 2 * border;
    rows.par_chunks_mut(ALONG * width)
        .zip(image.pixels.par_chunks(width))
        .for_each_init(
            || vec![0.0; 3 * padded],
            |channels, (rows, pixels)| {
                for (x, rgb) in pixels.iter().enumerate() {
                    let [big_x, big_y, big_z] = xyz_from_rgb(display(*rgb));
                    for (channel, value) in [big_y, big_x - big_y, big_y - big_z].into_iter().enumerate() {
                        channels[channel * padded + border + x] = value;
                    }
                }
                for channel in channels.chunks_exact_mut(padded) {
                    let (first, last) = (channel[border], channel[border + width - 1]);
                    channel[..border].fill(first);
                    channel[border + width..].fill(last);
                }
                for ((kernel, source), out) in kernels.iter().zip(rows.chunks_exact_mut(width)) {
                    kernel.apply(
                        |offset| &channels[(source * padded + border).strict_add_signed(offset)..],
                        out,
                    );
                }
            },
        );
}

/// Filters across the rows at row `y`, the border row repeated outside, into `ACROSS` rows.
fn filter_across(kernels: &[(Kernel<f32>, usize); ACROSS], rows: &[f32], width: usize, y: usize, out: &mut [f32]) {
    let last = rows.len() / (ALONG * width) - 1;
    for ((kernel, source), out) in kernels.iter().zip(out.chunks_exact_mut(width)) {
        let row = |offset: isize| y.saturating_add_signed(offset).min(last);
        kernel.apply(|offset| &rows[(row(offset) * ALONG + source) * width..][..width], out);
    }
}

/// The colour seen at a pixel: the filtered opponent channels back to display range and on to L*a*b*.
#[inline(always)]
fn seen_colour([y, x_minus_y, y_minus_z, more_y_minus_z]: [f32; 4]) -> [f32; 3] {
    let rgb = rgb_from_xyz([y + x_minus_y, y, y - (y_minus_z + more_y_minus_z)]);
    hunt_lab_from_xyz(xyz_from_rgb(clamped(rgb)))
}

/// HyAB distance to 0..1: compressed, and most of the range left to the small distances.
#[inline]
fn redistribute(hyab: f32, largest: f32) -> f32 {
    let difference = hyab.powf(COLOUR_EXPONENT);
    let knee = KNEE_IN * largest;
    if difference < knee {
        KNEE_OUT / knee * difference
    } else {
        KNEE_OUT + (difference - knee) / (largest - knee) * (1.0 - KNEE_OUT)
    }
}

/// The largest difference in display range, between green and blue, to the colour exponent.
fn largest_colour_difference() -> f32 {
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt_lab_from_xyz(xyz_from_rgb(rgb)));
    hyab(green, blue).powf(COLOUR_EXPONENT)
}

/// Standard deviation in pixels of a contrast-sensitivity term, whose exponent is −π²d²/b with d in degrees.
fn sigma(b: f64) -> f64 {
    (b / 2.0).sqrt() / PI * PIXELS_PER_DEGREE
}

/// Three standard deviations of the widest term; the paper cuts all channels off there.
fn colour_radius() -> usize {
    let widest = [&ACHROMATIC[..], &RED_GREEN, &BLUE_YELLOW]
        .concat()
        .iter()
        .fold(0.0_f64, |widest, t| widest.max(t.1));
    (3.0 * sigma(widest)).ceil() as usize
}

/// Share of each term in a channel's kernel, which is normalised as a whole over its square.
fn term_weights<const N: usize>(channel: &[(f64, f64); N], radius: usize) -> [f64; N] {
    let volumes = channel.map(|(a, b)| {
        let side = |x: usize| (-0.5 * (x as f64 / sigma(b)).powi(2)).exp();
        let line = 1.0 + 2.0 * (1..=radius).map(side).sum::<f64>();
        a * (PI / b).sqrt() * line * line
    });
    let total: f64 = volumes.iter().sum();
    volumes.map(|volume| volume / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(rgb: [f32; 3]) -> ImageRgb {
        ImageRgb {
            width: 25,
            height: 21,
            pixels: vec![rgb; 525],
        }
    }

    #[test]
    fn green_against_blue_is_the_largest_error() {
        let errors = error_map(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]));
        assert!(errors.iter().all(|error| (error - 1.0).abs() < 1e-4));
    }

    #[test]
    fn order_of_the_images_does_not_matter() {
        let (mut a, b) = (flat([0.5, 0.1, 0.2]), flat([0.4, 0.3, 0.2]));
        a.pixels[200] = [1.0; 3];
        assert_eq!(error_map(&a, &b), error_map(&b, &a));
        assert_eq!(error_map(&a, &a), vec![0.0; 525]);
    }

    #[test]
    fn flat_images_differ_by_their_colour_alone() {
        let (p, q) = ([0.5, 0.1, 0.2], [0.4, 0.3, 0.2]);
        let [lab_p, lab_q] = [p, q].map(|rgb| hunt_lab_from_xyz(xyz_from_rgb(rgb)));
        let expected = redistribute(hyab(lab_p, lab_q), largest_colour_difference());
        assert!(
            error_map(&flat(p), &flat(q))
                .iter()
                .all(|error| (error - expected).abs() < 1e-4)
        );
    }
}
