//! Colour arithmetic of the metrics: luminance, sRGB, CIE XYZ and L*a*b* relative to D65 white, the ACES fit.

/// Rec. 709 luminance of linear RGB (ITU-R BT.709, item 3.2).
pub(super) fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Linear 0..1 to sRGB 0..1 (IEC 61966-2-1).
pub(super) fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear RGB to XYZ with each row divided by D65's value, from IEC 61966-2-1's chromaticities: white is (1, 1, 1).
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [0.433_887_4, 0.376_224, 0.189_888_6],
    [0.212_639, 0.715_168_7, 0.072_192_3],
    [0.017_75, 0.109_447_6, 0.872_802_3],
];

/// The inverse of [`XYZ_FROM_RGB`].
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.080_399, -1.537_383_2, -0.543_015_9],
    [-0.921_223_4, 1.875_967_5, 0.045_255_9],
    [0.052_873_9, -0.203_977, 1.151_103],
];

#[inline]
fn transform(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    let dot = |row: [f32; 3]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
    [dot(matrix[0]), dot(matrix[1]), dot(matrix[2])]
}

/// Linear RGB to XYZ relative to D65 white.
#[inline]
pub(super) fn xyz_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    transform(&XYZ_FROM_RGB, rgb)
}

/// XYZ relative to D65 white to linear RGB.
#[inline]
pub(super) fn rgb_from_xyz(xyz: [f32; 3]) -> [f32; 3] {
    transform(&RGB_FROM_XYZ, xyz)
}

/// XYZ relative to its white to L*a*b* (CIE 15), with a* and b* scaled by L*/100 for the Hunt effect: the less
/// luminance, the less colour (FLIP, Andersson et al. 2020, colour pipeline).
#[inline]
pub(super) fn hunt_lab_from_xyz(xyz: [f32; 3]) -> [f32; 3] {
    let (x, y, z) = (lab_curve(xyz[0]), lab_curve(xyz[1]), lab_curve(xyz[2]));
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// Distance between two L*a*b* colours: city-block in L*, Euclidean in the a*b* plane (HyAB, Abasi et al. 2020).
#[inline]
pub(super) fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let (a, b) = (p[1] - q[1], p[2] - q[2]);
    (p[0] - q[0]).abs() + (a * a + b * b).sqrt()
}

#[inline]
fn lab_curve(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    let linear = t * (1.0 / (3.0 * DELTA * DELTA)) + 4.0 / 29.0;
    if t > DELTA * DELTA * DELTA {
        cube_root(t)
    } else {
        linear
    }
}

/// Cube root of a normal positive number to f32 accuracy: a third of the exponent as the first guess (3% off), then
/// two steps of Halley's iteration. Unlike the library's it compiles to vector code, which FLIP spends its time in.
#[inline]
fn cube_root(t: f32) -> f32 {
    const GUESS_BIAS: u32 = 0x2a51_37a0;
    let mut root = f32::from_bits(t.to_bits() / 3 + GUESS_BIAS);
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + 2.0 * t) / (2.0 * cube + t);
    }
    root
}

/// Numerator and denominator coefficients (x², x, 1) of the ACES filmic fit (Narkowicz 2016) with its 0.6 exposure
/// folded in, as HDR-FLIP uses it (Andersson et al. 2021).
pub(super) const ACES: [[f64; 3]; 2] = [[0.36 * 2.51, 0.6 * 0.03, 0.0], [0.36 * 2.43, 0.6 * 0.59, 0.14]];

/// The ACES fit of radiance `x`, clamped to 0..1.
#[inline]
pub(super) fn aces(x: f32) -> f32 {
    const N: [f32; 2] = [ACES[0][0] as f32, ACES[0][1] as f32];
    const D: [f32; 3] = [ACES[1][0] as f32, ACES[1][1] as f32, ACES[1][2] as f32];
    // Above the bound the fit is 1 in any case, and its squares stay finite.
    let x = x.clamp(0.0, 1e6);
    ((N[0] * x + N[1]) * x / ((D[0] * x + D[1]) * x + D[2])).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_inverse_and_keep_white() {
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            let back = rgb_from_xyz(xyz_from_rgb(unit));
            assert!((0..3).all(|i| (back[i] - unit[i]).abs() < 1e-6), "{back:?}");
        }
        assert!(xyz_from_rgb([1.0; 3]).iter().all(|v| (v - 1.0).abs() < 1e-6));
        let white = hunt_lab_from_xyz([1.0; 3]);
        assert!((white[0] - 100.0).abs() < 1e-4 && white[1].abs() < 1e-3 && white[2].abs() < 1e-3);
    }

    #[test]
    fn cube_root_to_f32_accuracy() {
        for i in 1..10_000 {
            let t = i as f32 * 1.3e-4;
            assert!((cube_root(t) / t.cbrt() - 1.0).abs() < 4e-7, "{t}");
        }
    }

    #[test]
    fn curves_at_their_ends() {
        assert_eq!(
            (srgb_encode(0.0), aces(0.0), aces(f32::INFINITY), aces(-1.0)),
            (0.0, 0.0, 1.0, 0.0)
        );
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-12);
        assert!((lab_curve(0.008_857) - lab_curve(0.008_856)).abs() < 1e-4);
    }
}
