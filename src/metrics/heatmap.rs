//! The FLIP error map as a picture.

use super::compare::{blackened, check, flip_map};
use super::magma::MAGMA;
use super::types::{ImageRgb, Kind, MetricsError};

/// The FLIP error of each pixel in the magma palette: sRGB bytes, `width * height` pixels row by row from the top.
/// Black is no error, pale yellow the largest. A pixel not finite in either image is black in both.
pub fn heatmap(a: &ImageRgb, b: &ImageRgb, kind: Kind) -> Result<Vec<[u8; 3]>, MetricsError> {
    let finite = check(a, b)?;
    let map = flip_map(&blackened(a, &finite), &blackened(b, &finite), kind);
    Ok(map
        .iter()
        .map(|error| MAGMA[(error.clamp(0.0, 1.0) * 255.0).round() as usize])
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn difference_glows_where_it_is() {
        let b = ImageRgb {
            width: 40,
            height: 30,
            pixels: vec![[0.2; 3]; 1200],
        };
        let mut a = b.clone();
        a.pixels[15 * 40 + 20] = [1.0, 0.0, 0.0];
        let map = heatmap(&a, &b, Kind::Display).unwrap();
        assert_eq!((map.len(), map[0]), (1200, [0, 0, 4]));
        let brightness = |p: &[u8; 3]| p.iter().map(|v| u32::from(*v)).sum::<u32>();
        let brightest = (0..1200).max_by_key(|i| brightness(&map[*i])).unwrap();
        assert!((brightest % 40).abs_diff(20) <= 3 && (brightest / 40).abs_diff(15) <= 3);
    }

    #[test]
    fn sizes_must_agree() {
        let b = ImageRgb {
            width: 2,
            height: 1,
            pixels: vec![[0.0; 3]; 2],
        };
        let a = ImageRgb {
            width: 1,
            height: 2,
            pixels: vec![[0.0; 3]; 2],
        };
        assert!(heatmap(&a, &b, Kind::Linear).is_err());
    }
}
