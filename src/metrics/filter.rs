//! One-dimensional kernels, even or odd about their centre, applied to rows or to columns of rows.

use std::ops::{Add, Mul, Sub};

/// What a filter computes in: f32 for FLIP, f64 for SSIM, whose variances are differences of nearly equal sums.
pub(super) trait Sample: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn from_f64(value: f64) -> Self;
}

impl Sample for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
}

impl Sample for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
}

/// A kernel of `2 * radius + 1` taps, stored from its centre outwards.
pub(super) struct Kernel<T> {
    taps: Vec<T>,
    odd: bool,
}

impl<T: Sample> Kernel<T> {
    /// A Gaussian of `sigma` pixels that sums to `sum`, cut off at `radius`.
    pub(super) fn gaussian(sigma: f64, radius: usize, sum: f64) -> Self {
        let weights: Vec<f64> = (0..=radius).map(|x| gaussian(x, sigma)).collect();
        let total = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        Self {
            taps: weights.iter().map(|w| T::from_f64(w * sum / total)).collect(),
            odd: false,
        }
    }

    /// The Gaussian's first derivative, its positive half scaled to sum to 1.
    pub(super) fn first_derivative(sigma: f64, radius: usize) -> Self {
        let weights: Vec<f64> = (0..=radius).map(|x| x as f64 * gaussian(x, sigma)).collect();
        let total: f64 = weights.iter().sum();
        Self {
            taps: weights.iter().map(|w| T::from_f64(w / total)).collect(),
            odd: true,
        }
    }

    /// The Gaussian's second derivative, its positive weights scaled to sum to 1 and its negative ones to −1.
    pub(super) fn second_derivative(sigma: f64, radius: usize) -> Self {
        let shape = |x: usize| ((x as f64 / sigma).powi(2) - 1.0) * gaussian(x, sigma);
        let weights: Vec<f64> = (0..=radius).map(shape).collect();
        let total = |sign: f64| -> f64 {
            weights
                .iter()
                .enumerate()
                .map(|(x, w)| (w * sign).max(0.0) * if x == 0 { 1.0 } else { 2.0 })
                .sum()
        };
        let (positive, negative) = (total(1.0), total(-1.0));
        let scaled = weights
            .iter()
            .map(|w| T::from_f64(w / if *w > 0.0 { positive } else { negative }));
        Self {
            taps: scaled.collect(),
            odd: false,
        }
    }

    /// Taps on either side of the centre.
    pub(super) fn radius(&self) -> usize {
        self.taps.len() - 1
    }

    /// Writes to `out` the weighted sum of the slices `at(offset)`, offsets −radius..=radius, each at least as long as
    /// `out`: shifted views of one row filter along it, neighbouring rows filter across.
    pub(super) fn apply<'a>(&self, at: impl Fn(isize) -> &'a [T], out: &mut [T])
    where
        T: 'a,
    {
        let centre = self.taps[0];
        for (out, value) in out.iter_mut().zip(at(0)) {
            *out = centre * *value;
        }
        // Two taps at a time: the sums go through memory half as often.
        for (i, taps) in (1..).step_by(2).zip(self.taps[1..].chunks(2)) {
            let sides = |i: isize| at(-i).iter().zip(at(i));
            let near = sides(i);
            match (taps, self.odd) {
                ([near_tap, far_tap], false) => {
                    for ((out, near), far) in out.iter_mut().zip(near).zip(sides(i + 1)) {
                        *out = *out + *near_tap * (*near.1 + *near.0) + *far_tap * (*far.1 + *far.0);
                    }
                }
                ([near_tap, far_tap], true) => {
                    for ((out, near), far) in out.iter_mut().zip(near).zip(sides(i + 1)) {
                        *out = *out + *near_tap * (*near.1 - *near.0) + *far_tap * (*far.1 - *far.0);
                    }
                }
                (last, odd) => {
                    for (out, near) in out.iter_mut().zip(near) {
                        *out = *out + last[0] * if odd { *near.1 - *near.0 } else { *near.1 + *near.0 };
                    }
                }
            }
        }
    }
}

fn gaussian(x: usize, sigma: f64) -> f64 {
    (-0.5 * (x as f64 / sigma).powi(2)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(kernel: &Kernel<f64>, signal: impl Fn(f64) -> f64) -> f64 {
        let values: Vec<f64> = (-9..=9).map(|x| signal(f64::from(x))).collect();
        let mut out = [0.0];
        kernel.apply(|offset| &values[(9 + offset) as usize..], &mut out);
        out[0]
    }

    #[test]
    fn kernels_answer_polynomials() {
        let blur = Kernel::gaussian(2.7, 9, 1.0);
        assert!((response(&blur, |_| 5.0) - 5.0).abs() < 1e-12 && response(&blur, |x| x).abs() < 1e-12);
        let first = Kernel::first_derivative(2.7, 9);
        assert!(response(&first, |_| 5.0).abs() < 1e-12);
        assert!((response(&first, |x| if x > 0.0 { 1.0 } else { 0.0 }) - 1.0).abs() < 1e-12);
        let second = Kernel::second_derivative(2.7, 9);
        assert!(response(&second, |_| 5.0).abs() < 1e-12 && response(&second, |x| x).abs() < 1e-12);
        assert!((response(&second, |x| if x.abs() > 2.7 { 1.0 } else { 0.0 }) - 1.0).abs() < 1e-12);
    }
}
