//! PNG images of the display.

use super::{OutputError, atomic};
use std::path::Path;

/// Writes 8-bit sRGB pixels, row by row from the top, with text chunks of a keyword and a text.
///
/// # Errors
/// [`OutputError`] naming the file.
pub fn write(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[[u8; 3]],
    texts: &[(&str, String)],
) -> Result<(), OutputError> {
    let mut bytes = Vec::new();
    let encoded = (|| {
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        for (keyword, text) in texts {
            encoder.add_itxt_chunk((*keyword).to_owned(), text.clone())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytemuck::cast_slice(pixels))?;
        writer.finish()
    })();
    encoded.map_err(|e: png::EncodingError| OutputError::Encode {
        path: path.to_owned(),
        reason: e.to_string(),
    })?;
    atomic::write(path, &bytes)
}

/// Reads any PNG as 8-bit encoded RGB, alpha dropped.
///
/// # Errors
/// [`OutputError::Read`].
pub fn read_bytes(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>), OutputError> {
    let (w, h, pixels) = read(path)?;
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    Ok((w, h, pixels.into_iter().map(|p| p.map(byte)).collect()))
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
