//! How strong lights are beside each other: the weights by which they are chosen.

use super::records::{LIGHT_DOME, LIGHT_EVEN, LIGHT_LINEAR, LIGHT_SPHERE, LIGHT_SUN, LIGHT_TRIANGLE, Light};
use std::f32::consts::{FRAC_1_PI, FRAC_2_PI};

/// Weight of all lights together. Integers make prefix sums exact at any number of lights; as a power of two it lets a
/// 32-bit random number be mapped to a weight with equal shares.
pub const TOTAL_WEIGHT: u32 = 1 << 28;

/// Distance at which a light without one (a sun, a linear light) is set beside the others, units: that of a wall lit by a
/// lamp in a room.
const TYPICAL_DISTANCE: f32 = 256.0;

/// Luminance of linear RGB (Rec. 709).
pub fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// Irradiance/π at normal incidence times squared distance, far away in front of the light, luxel units · units².
pub fn strength(light: &Light) -> f32 {
    let l = luminance(light.radiance);
    let s = match light.kind {
        LIGHT_TRIANGLE => l * light.size * FRAC_1_PI,
        LIGHT_DOME if light.flags & LIGHT_EVEN != 0 => l * light.size * FRAC_1_PI,
        // The dome's radiance is V/(255·π·cos elevation): on average over a hemisphere as strong as V/255 · 2/π.
        LIGHT_DOME => l * light.size * FRAC_1_PI * FRAC_2_PI,
        LIGHT_SPHERE if light.flags & LIGHT_LINEAR != 0 => l * light.p2[2] * TYPICAL_DISTANCE * TYPICAL_DISTANCE,
        LIGHT_SPHERE => l * light.size * light.size,
        LIGHT_SUN => l * TYPICAL_DISTANCE * TYPICAL_DISTANCE,
        _ => 0.0,
    };
    if s.is_finite() { s.max(0.0) } else { 0.0 }
}

/// Strength that a weight of 1 stands for.
pub fn strength_of_one(lights: &[Light]) -> f32 {
    let total: f64 = lights.iter().map(|l| f64::from(strength(l))).sum();
    (total / f64::from(TOTAL_WEIGHT)) as f32
}

/// Prefix sums of the lights' weights, one more than there are lights. Every light weighs 1 at least.
pub fn weight_sums(lights: &[Light]) -> Vec<u32> {
    let total: f64 = lights.iter().map(|l| f64::from(strength(l))).sum();
    // What the least weights need is kept apart, so that the sum stays below the total.
    let spread = f64::from(TOTAL_WEIGHT).max(lights.len() as f64) - lights.len() as f64;
    let mut sum = 0;
    let mut sums = vec![0];
    for light in lights {
        let share = if total > 0.0 {
            f64::from(strength(light)) / total
        } else {
            0.0
        };
        sum += 1 + (share * spread) as u32;
        sums.push(sum);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn weights_are_shares_of_strength() {
        let light = |radiance: f32| Light {
            radiance: [radiance; 3],
            size: 2.0,
            ..Light::zeroed()
        };
        let lights: Vec<_> = [1.0, 3.0, 0.0, f32::NAN].map(light).into();
        let sums = weight_sums(&lights);
        let weights: Vec<u32> = sums.windows(2).map(|w| w[1] - w[0]).collect();
        assert_eq!(weights[2..], [1, 1]);
        assert!((f64::from(weights[1]) / f64::from(weights[0]) - 3.0).abs() < 1e-6);
        assert!(sums[4] <= TOTAL_WEIGHT && sums[4] > TOTAL_WEIGHT - 5);
        assert_eq!(weight_sums(&[]), [0]);
    }
}
