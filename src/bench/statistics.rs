//! Medians, intervals and slopes.

use serde::{Deserialize, Serialize};

/// Two-sided 95% quantiles of Student's t by degrees of freedom, from 1.
const T95: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];

/// Half the width of the 95% interval of a t-distributed figure of standard deviation 1.
pub fn t95(degrees: usize) -> f64 {
    match degrees {
        0 => f64::INFINITY,
        n => T95.get(n - 1).copied().unwrap_or(1.96 + 2.5 / n as f64),
    }
}

/// Value in the middle; `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    match n % 2 {
        _ if n == 0 => None,
        1 => Some(sorted[n / 2]),
        _ => Some(0.5 * (sorted[n / 2 - 1] + sorted[n / 2])),
    }
}

/// Mean and standard deviation of what may be repeated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Repeated {
    pub count: usize,
    pub mean: f64,
    /// Of one; 0 where there is no second.
    pub deviation: f64,
}

impl Repeated {
    /// Of some runs.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        Self {
            count: n,
            mean,
            deviation: if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 },
        }
    }

    /// Half the width of the interval around the mean that holds another run with a probability of 95%; `None` without runs to
    /// tell it by.
    pub fn of_another(&self) -> Option<f64> {
        let n = self.count as f64;
        (self.count > 1).then(|| t95(self.count - 1) * self.deviation * (1.0 + 1.0 / n).sqrt())
    }

    /// Standard error of the mean.
    pub fn error(&self) -> f64 {
        self.deviation / (self.count.max(1) as f64).sqrt()
    }

    /// Whether two means differ by more than chance makes them differ in 1 of 20 cases (Welch 1947).
    pub fn differs(&self, other: &Self) -> bool {
        let (a, b) = (self.error().powi(2), other.error().powi(2));
        let joined = a + b;
        if joined == 0.0 || self.count < 2 || other.count < 2 {
            return false;
        }
        let degrees = joined * joined / (a * a / (self.count - 1) as f64 + b * b / (other.count - 1) as f64);
        (self.mean - other.mean).abs() > t95(degrees.floor().max(1.0) as usize) * joined.sqrt()
    }
}

/// A straight line through points by least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    pub slope: f64,
    pub intercept: f64,
    /// Standard error of the slope; infinite with two points.
    pub error: f64,
}

/// The power law that fits points best: a line through their logarithms. `None` where fewer than two are above 0.
pub fn power_law(points: &[(f64, f64)]) -> Option<Line> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let n = logs.len() as f64;
    let (mx, my) = (
        logs.iter().map(|p| p.0).sum::<f64>() / n,
        logs.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let xx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    if logs.len() < 2 || xx <= 0.0 {
        return None;
    }
    let slope = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / xx;
    let intercept = my - slope * mx;
    let rest: f64 = logs.iter().map(|p| (p.1 - intercept - slope * p.0).powi(2)).sum();
    let error = if logs.len() > 2 {
        (rest / (n - 2.0) / xx).sqrt()
    } else {
        f64::INFINITY
    };
    Some(Line {
        slope,
        intercept,
        error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_is_found_again() {
        let points: Vec<(f64, f64)> = (1..9).map(|n| (f64::from(n), 3.0 / f64::from(n * n))).collect();
        let line = power_law(&points).expect("a line");
        assert!((line.slope + 2.0).abs() < 1e-12 && (line.intercept.exp() - 3.0).abs() < 1e-12);
        assert_eq!(power_law(&[(1.0, 1.0)]), None);
        assert_eq!(power_law(&[(0.0, 1.0), (1.0, 1.0)]), None);
    }

    /// The interval holds as many further runs as it says, and means of the same are told apart as often as it says.
    #[test]
    fn intervals_hold_what_they_say() {
        let normal = |seed: u32, i: u32| {
            let unit = |k: u32| f64::from(crate::scene::sampling::unit(crate::scene::sampling::key(seed, i, k)));
            (0..12).map(unit).sum::<f64>() - 6.0
        };
        let (mut held, mut told) = (0, 0);
        let sets = 4000;
        for set in 0..sets {
            let runs: Vec<f64> = (0..6).map(|i| normal(set, i)).collect();
            let others: Vec<f64> = (10..16).map(|i| normal(set, i)).collect();
            let (a, b) = (Repeated::of(&runs), Repeated::of(&others));
            held += u32::from((normal(set, 99) - a.mean).abs() <= a.of_another().expect("runs"));
            told += u32::from(a.differs(&b));
        }
        let share = |n: u32| f64::from(n) / f64::from(sets);
        assert!((share(held) - 0.95).abs() < 0.015, "{}", share(held));
        assert!(share(told) < 0.06, "{}", share(told));
        assert!(!Repeated::of(&[1.0]).differs(&Repeated::of(&[2.0])));
        assert_eq!(Repeated::of(&[1.0]).of_another(), None);
    }

    #[test]
    fn middles() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
