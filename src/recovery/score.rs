//! How well a prediction agrees with what is stored.

use glam::Vec3;

/// Agreement of predicted and stored irradiance over a set of luxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Score {
    /// Pearson's correlation, all three channels pooled.
    pub correlation: f64,
    /// Median over luxels of predicted over stored, each the mean of its channels.
    pub ratio: f64,
}

/// Scores predictions against stored values of the same luxels. An empty or constant set has correlation 0.
pub fn score(predicted: &[Vec3], stored: &[Vec3]) -> Score {
    let n = predicted.len().min(stored.len()) as f64 * 3.0;
    let (mut sp, mut ss, mut spp, mut sss, mut sps) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (p, s) in predicted.iter().zip(stored) {
        for c in 0..3 {
            let (p, s) = (f64::from(p[c]), f64::from(s[c]));
            sp += p;
            ss += s;
            spp += p * p;
            sss += s * s;
            sps += p * s;
        }
    }
    let variance = (spp - sp * sp / n) * (sss - ss * ss / n);
    let correlation = if variance > 0.0 {
        (sps - sp * ss / n) / variance.sqrt()
    } else {
        0.0
    };
    let mut ratios: Vec<f32> = predicted
        .iter()
        .zip(stored)
        .map(|(p, s)| p.element_sum() / s.element_sum().max(f32::MIN_POSITIVE))
        .collect();
    ratios.sort_by(f32::total_cmp);
    Score {
        correlation,
        ratio: ratios.get(ratios.len() / 2).map_or(0.0, |r| f64::from(*r)),
    }
}

/// Scores of the predictions that a recovery makes, on luxels that it never fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Scores {
    /// Luxels scored.
    pub luxels: usize,
    /// Lights in the files as they stand there.
    pub known: Score,
    /// The same with fitted scales, nothing else fitted along.
    pub known_scaled: Score,
    /// Known and recovered lights alone: what a renderer of direct light shows.
    pub direct: Score,
    /// The same with ambient light, powers fitted without the gathered term.
    pub without_indirect: Score,
    /// Everything: known and recovered lights, ambient and gathered light.
    pub full: Score,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_of_known_cases() {
        let stored: Vec<Vec3> = (1..50).map(|i| Vec3::splat(i as f32)).collect();
        let twice: Vec<Vec3> = stored.iter().map(|s| *s * 2.0).collect();
        let s = score(&twice, &stored);
        assert!((s.correlation - 1.0).abs() < 1e-9 && (s.ratio - 2.0).abs() < 1e-6);
        let opposite: Vec<Vec3> = stored.iter().map(|s| Vec3::splat(60.0) - *s).collect();
        assert!((score(&opposite, &stored).correlation + 1.0).abs() < 1e-9);
        assert_eq!(score(&[], &[]).correlation, 0.0);
        assert_eq!(score(&stored, &vec![Vec3::ONE; stored.len()]).correlation, 0.0);
    }
}
