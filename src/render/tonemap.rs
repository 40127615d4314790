//! Exposure and tone map. Counterpart of `shaders/include/tonemap.glsl`.

use super::settings::Tonemap;
use crate::assets::image::encode_srgb;

/// Exposure of the game: luxels of 64 show textures as they are.
pub const GAME_EXPOSURE: f32 = 255.0 / 64.0;
/// Log-average of the exposed luminance at which the automatic exposure is the game's.
pub const KEY: f32 = 0.12;
/// Radiance below this counts as this much in the log-average, so that black pixels do not blow the exposure up.
pub const LUMINANCE_FLOOR: f32 = 1e-4;
/// Range of the automatic exposure.
pub const EXPOSURE_RANGE: (f32, f32) = (0.05, 16.0);

/// Rec. 709 luminance.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Cells per image edge whose means enter the log-average: noise, most of it black pixels, must not raise the exposure.
const EXPOSURE_CELLS: usize = 32;

/// Cells darker than this share of the mean count the less for it: a black sky says nothing about how bright the floor under it should be.
pub const DARK_SHARE: f32 = 1.0 / 16.0;

/// Exposure that goes half the way, in the logarithm, from the game's to what brings the log-average of the luminance of 32 x
/// 32 cells to [`KEY`]: dark maps stay dark, and something is seen in them. Cells that are black beside the others count little.
pub fn automatic_exposure(pixels: &[[f32; 3]], width: u32, height: u32) -> f32 {
    let (w, h) = (width as usize, height as usize);
    let (nx, ny) = (w.min(EXPOSURE_CELLS), h.min(EXPOSURE_CELLS));
    let mut sums = vec![(0f64, 0u32); nx * ny];
    for (i, p) in pixels.iter().enumerate() {
        let (x, y) = (i % w, i / w);
        let l = luminance(*p);
        let cell = &mut sums[y * ny / h * nx + x * nx / w];
        cell.0 += if l.is_finite() { f64::from(l) } else { 0.0 };
        cell.1 += 1;
    }
    let cells: Vec<f64> = sums.iter().map(|(sum, n)| sum / f64::from((*n).max(1))).collect();
    let dark = cells.iter().sum::<f64>() / cells.len().max(1) as f64 * f64::from(DARK_SHARE);
    let (mut logs, mut weights) = (0.0, 0.0);
    for l in cells {
        let weight = if dark > 0.0 { (l / dark).min(1.0) } else { 1.0 };
        logs += weight * l.max(f64::from(LUMINANCE_FLOOR)).ln();
        weights += weight;
    }
    let average = (logs / f64::max(weights, f64::MIN_POSITIVE)).exp() as f32;
    (GAME_EXPOSURE * KEY / average)
        .sqrt()
        .clamp(EXPOSURE_RANGE.0, EXPOSURE_RANGE.1)
}

fn curve(x: f32, tonemap: Tonemap) -> f32 {
    match tonemap {
        // Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
        Tonemap::Aces => (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14),
        Tonemap::Reinhard => x / (1.0 + x),
        Tonemap::Clamp => x,
    }
}

/// Display bytes of a radiance.
pub fn display(radiance: [f32; 3], exposure: f32, tonemap: Tonemap) -> [u8; 3] {
    radiance.map(|x| {
        let x = if x.is_finite() {
            (x * exposure).clamp(0.0, 1e4)
        } else {
            0.0
        };
        (encode_srgb(curve(x, tonemap).clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_black_sky_changes_no_exposure() {
        let floor = vec![[0.3, 0.3, 0.3]; 64 * 64];
        let mut outside = vec![[0.0; 3]; 64 * 64];
        outside.extend(&floor);
        let (alone, under) = (
            automatic_exposure(&floor, 64, 64),
            automatic_exposure(&outside, 64, 128),
        );
        assert!((alone / under - 1.0).abs() < 1e-5, "{alone} {under}");
        // A dim sky counts.
        outside[..64 * 64].fill([0.1; 3]);
        assert!(automatic_exposure(&outside, 64, 128) > alone * 1.2);
        assert_eq!(automatic_exposure(&[[0.0; 3]; 16], 4, 4), EXPOSURE_RANGE.1);
    }
}
