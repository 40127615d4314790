//! The figures that need no neighbourhood: means, squared errors, PSNR.

use super::types::Kind;

/// The figures of this module; undefined ones are not finite.
pub(super) struct Basic {
    pub rel_mse: f64,
    pub rel_mse_trimmed: f64,
    pub rmse: f64,
    pub mean_a: f64,
    pub mean_b: f64,
    pub psnr: f64,
    pub max_abs: f64,
}

/// Figures over the pixels with `counted[i]`; all slices have one entry per pixel.
pub(super) fn basic(a: &[[f32; 3]], b: &[[f32; 3]], kind: Kind, counted: &[bool]) -> Basic {
    let pairs = || {
        a.iter()
            .zip(b)
            .zip(counted)
            .filter(|(_, counted)| **counted)
            .map(|((a, b), _)| (a, b))
    };
    let (mut pixels, mut sum_a, mut sum_b, mut sum_squared) = (0_usize, 0.0, 0.0, 0.0);
    let (mut max_abs, mut max_b) = (0.0_f64, f64::NEG_INFINITY);
    for (a, b) in pairs() {
        pixels += 1;
        for (a, b) in channels(a, b) {
            sum_a += a;
            sum_b += b;
            sum_squared += (a - b) * (a - b);
            max_abs = max_abs.max((a - b).abs());
            max_b = max_b.max(b);
        }
    }
    let values = (pixels * 3) as f64;
    let mean_b = sum_b / values;
    let floor = 0.01 * mean_b * mean_b;
    let mut errors: Vec<f64> = pairs()
        .map(|(a, b)| channels(a, b).map(|(a, b)| (a - b) * (a - b) / (b * b + floor)).sum())
        .collect();
    let rel_mse = errors.iter().sum::<f64>() / values;
    let rmse = (sum_squared / values).sqrt();
    let peak = match kind {
        Kind::Linear => max_b,
        Kind::Display => 1.0,
    };
    Basic {
        rel_mse,
        rel_mse_trimmed: trimmed_sum(&mut errors) / ((pixels - pixels / 1000) * 3) as f64,
        rmse,
        mean_a: sum_a / values,
        mean_b,
        psnr: 20.0 * (peak / rmse).log10(),
        max_abs: if pixels == 0 { f64::NAN } else { max_abs },
    }
}

fn channels(a: &[f32; 3], b: &[f32; 3]) -> impl Iterator<Item = (f64, f64)> {
    (0..3).map(move |c| (f64::from(a[c]), f64::from(b[c])))
}

/// Sum without the largest thousandth; reorders the errors.
fn trimmed_sum(errors: &mut [f64]) -> f64 {
    let kept = errors.len() - errors.len() / 1000;
    if kept < errors.len() {
        errors.select_nth_unstable_by(kept, f64::total_cmp);
    }
    errors[..kept].iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_by_hand() {
        let figures = basic(
            &[[2.0; 3], [0.0; 3]],
            &[[1.0; 3], [3.0; 3]],
            Kind::Linear,
            &[true, true],
        );
        assert_eq!((figures.mean_a, figures.mean_b, figures.max_abs), (1.0, 2.0, 3.0));
        let expected = (1.0 / 1.04 + 9.0 / 9.04) / 2.0;
        assert!((figures.rel_mse - expected).abs() < 1e-12);
        assert!((figures.rmse - 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((figures.psnr - 20.0 * (3.0 / 5.0_f64.sqrt()).log10()).abs() < 1e-12);
    }

    #[test]
    fn trimming_drops_the_firefly_only() {
        let b = vec![[1.0; 3]; 1000];
        let mut a = vec![[1.1; 3]; 1000];
        a[123] = [1000.0; 3];
        let figures = basic(&a, &b, Kind::Linear, &[true; 1000]);
        assert!(figures.rel_mse > 900.0);
        assert!((figures.rel_mse_trimmed - 0.01 / 1.01).abs() < 1e-6);
    }

    #[test]
    fn nothing_counted_is_undefined() {
        let figures = basic(&[[1.0; 3]], &[[1.0; 3]], Kind::Display, &[false]);
        assert!(!figures.rel_mse.is_finite() && !figures.mean_a.is_finite() && !figures.max_abs.is_finite());
        assert!(!figures.psnr.is_finite() && !figures.rmse.is_finite() && !figures.rel_mse_trimmed.is_finite());
    }
}
