//! PNG images of the display.

use super::{OutputError, atomic};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::path::Path;

/// Writes 8-bit sRGB pixels, row by row from the top.
///
/// # Errors
/// [`OutputError`] naming the file.
pub fn write(path: &Path, width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<(), OutputError> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(bytemuck::cast_slice(pixels), width, height, ExtendedColorType::Rgb8)
        .map_err(|e| OutputError::Encode {
            path: path.to_owned(),
            reason: e.to_string(),
        })?;
    atomic::write(path, &bytes)
}

/// Reads any 8- or 16-bit PNG as encoded RGB in 0..1, alpha dropped.
///
/// # Errors
/// [`OutputError::Read`].
pub fn read(path: &Path) -> Result<(u32, u32, Vec<[f32; 3]>), OutputError> {
    let failed = |reason: String| OutputError::Read {
        path: path.to_owned(),
        reason,
    };
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    let image = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
        .map_err(|e| failed(e.to_string()))?
        .into_rgb32f();
    let (w, h) = image.dimensions();
    Ok((w, h, image.pixels().map(|p| p.0).collect()))
}
