//! Time of a scene: what moves textures, colours, geometry and machines.
//!
//! A single-precision time in seconds moves in visible jerks after some hours, and a period's fraction of a large number is
//! noise. Time is counted in ticks instead, and rates in 2⁻³² periods a tick: their product, wrapping, is the fraction of the
//! period, exact however long the program has run.

/// Ticks a second.
pub const TICKS: f64 = 16_384.0;
/// Noise repeats after this many steps.
pub const NOISE_STEPS: f32 = 256.0;

/// A moment; wraps after three days.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Clock(pub u32);

impl Clock {
    /// From seconds.
    pub fn from_seconds(seconds: f64) -> Self {
        Self((seconds * TICKS).round().rem_euclid(4_294_967_296.0) as u32)
    }

    /// So many seconds later.
    pub fn after(self, seconds: f64) -> Self {
        Self(self.0.wrapping_add(Self::from_seconds(seconds).0))
    }

    /// Seconds, 0 to three days.
    pub fn seconds(self) -> f64 {
        f64::from(self.0) / TICKS
    }

    /// Fraction of the period, 0..1.
    pub fn fraction(self, rate: u32) -> f32 {
        // 24 bits: what a float below 1 holds without rounding up to 1.
        (self.0.wrapping_mul(rate) >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

/// A frequency in periods a second as a rate: periods a tick in 2⁻³², wrapping.
pub fn rate(frequency: f32) -> u32 {
    let periods = f64::from(frequency) / TICKS * 4_294_967_296.0;
    if periods.is_finite() {
        periods.round().rem_euclid(4_294_967_296.0) as u32
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_follow_time_forwards_and_backwards() {
        let clock = Clock::from_seconds(2.25);
        assert!((clock.fraction(rate(1.0)) - 0.25).abs() < 1e-6);
        assert!((clock.fraction(rate(-1.0)) - 0.75).abs() < 1e-6);
        assert!((clock.fraction(rate(0.1)) - 0.225).abs() < 1e-5);
    }

    #[test]
    fn a_day_later_a_period_is_as_smooth() {
        let start = 86_400.0;
        let steps: Vec<f32> = (0..8)
            .map(|i| Clock::from_seconds(start + f64::from(i) / 128.0).fraction(rate(1.0)))
            .collect();
        for pair in steps.windows(2) {
            assert!((pair[1] - pair[0] - 1.0 / 128.0).abs() < 1e-5, "{steps:?}");
        }
    }
}
