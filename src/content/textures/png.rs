//! Textures as PNG files.

use super::Texture;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};
use thiserror::Error;

/// A texture that cannot be written.
#[derive(Debug, Error)]
#[error("texture {name} cannot be encoded: {source}")]
pub struct TextureError {
    name: String,
    source: ImageError,
}

/// The bytes of a PNG, without alpha channel where the texture is opaque.
///
/// # Errors
/// [`TextureError`] where the encoder refuses the image.
pub fn encode(texture: &Texture) -> Result<Vec<u8>, TextureError> {
    let opaque = texture.rgba.chunks_exact(4).all(|p| p[3] == 255);
    let (bytes, color) = if opaque {
        let rgb = texture.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        (rgb, ExtendedColorType::Rgb8)
    } else {
        (texture.rgba.clone(), ExtendedColorType::Rgba8)
    };
    let side = texture.side as u32;
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(&bytes, side, side, color)
        .map_err(|source| TextureError {
            name: texture.name.clone(),
            source,
        })?;
    Ok(png)
}
