//! What goes into a comparison and what comes out.

use serde::{Deserialize, Serialize};

/// An image in memory: linear RGB, Rec. 709 primaries, D65 white.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRgb {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels, row by row from the top. Scene radiance or decoded display values, see [`Kind`].
    pub pixels: Vec<[f32; 3]>,
}

/// What the numbers of both images stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Scene-referred radiance without an upper bound (EXR): HDR-FLIP; the PSNR's peak is B's largest value.
    Linear,
    /// Display images decoded from sRGB to linear, 0..1 (PNG): LDR-FLIP; the PSNR's peak is 1.
    Display,
}

/// The figures of one comparison, A the image and B the reference.
///
/// "Counted" pixels are those the mask selects (all without a mask) that are finite in both images. A figure that is
/// infinite or undefined is `None`, `null` in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Mean over counted pixels and channels of (A−B)²/(B² + 0.01·m²), m = `mean_b`.
    pub rel_mse: Option<f64>,
    /// `mean_a` / `mean_b`.
    pub mean_ratio: Option<f64>,
    /// Root of the mean over counted pixels and channels of (A−B)², in the images' unit.
    pub rmse: Option<f64>,
    /// Mean of A over counted pixels and channels, in the images' unit.
    pub mean_a: Option<f64>,
    /// Mean of B over counted pixels and channels, in the images' unit.
    pub mean_b: Option<f64>,
    /// Mean structural similarity of the tone-mapped luminances, 1 = equal. `None` where no counted pixel is at least
    /// 5 pixels from every border, so for every image under 11 pixels in either direction.
    pub ssim: Option<f64>,
    /// Mean of the FLIP error map, 0 = equal, 1 = as different as can be.
    pub flip: Option<f64>,
    /// Peak signal-to-noise ratio in dB: 20·log10(peak/`rmse`), the peak as [`Kind`] says. Equal images: `None`.
    pub psnr: Option<f64>,
    /// Largest |A−B| over counted pixels and channels, in the images' unit.
    pub max_abs: Option<f64>,
    /// Pixels the mask selects that are not finite in A or in B.
    pub nan_count: usize,
    /// `rel_mse` without the worst 0.1% of counted pixels (rounded down to whole pixels), ranked by their mean over
    /// the channels; m as in `rel_mse`.
    pub rel_mse_trimmed: Option<f64>,
}

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricsError {
    /// The two images differ in size.
    #[error("the images differ in size: {}x{} against {}x{}", a.0, a.1, b.0, b.1)]
    SizesDiffer {
        /// Width and height of A in pixels.
        a: (usize, usize),
        /// Width and height of B in pixels.
        b: (usize, usize),
    },
    /// An image's pixel list does not fit its width and height.
    #[error("an image of {width}x{height} has {pixels} pixels")]
    PixelCount {
        /// Pixels per row.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels in the list.
        pixels: usize,
    },
    /// The mask does not have one value per pixel.
    #[error("the mask has {mask} values for {pixels} pixels")]
    MaskSize {
        /// Values in the mask.
        mask: usize,
        /// Pixels in each image.
        pixels: usize,
    },
}
