//! The image a user asked for, by the extension of its name.

use super::{OutputError, exr_file, png_file};
use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::render::tonemap::{automatic_exposure, display};
use std::path::Path;

/// Writes linear radiance to `.exr`, or the exposed and tone-mapped image to `.png`.
///
/// # Errors
/// [`OutputError`] naming the file.
pub fn write(path: &Path, film: &Film, settings: &Settings) -> Result<(), OutputError> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    match extension.as_ref().and_then(|e| e.to_str()) {
        Some("exr") => exr_file::write_film(path, film, &[]),
        Some("png") => {
            let exposure = if settings.exposure > 0.0 {
                settings.exposure
            } else {
                automatic_exposure(&film.mean, film.width, film.height)
            };
            let pixels: Vec<_> = film
                .mean
                .iter()
                .map(|p| display(*p, exposure, settings.tonemap))
                .collect();
            png_file::write(path, film.width, film.height, &pixels, &[])
        }
        _ => Err(OutputError::Extension { path: path.to_owned() }),
    }
}
