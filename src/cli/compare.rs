//! `q3rays compare`

use super::args::{CliError, CliResult};
use crate::assets::image::decode_srgb;
use crate::metrics::{ImageRgb, Kind, compare, heatmap};
use crate::output::{exr_file, png_file, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `compare`.
#[derive(clap::Args)]
pub struct Args {
    /// Image
    a: PathBuf,
    /// Reference
    b: PathBuf,
    /// Image that is not black where pixels count
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// Write the FLIP error map
    #[arg(long, value_name = "FILE.png")]
    heatmap: Option<PathBuf>,
}

/// Reads a PNG (decoded to linear) or an EXR.
fn read(path: &Path) -> Result<(ImageRgb, Kind), CliError> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let (width, height, pixels, kind) = match extension.as_ref().and_then(|e| e.to_str()) {
        Some("exr") => {
            let (w, h, planes) = exr_file::read(path).map_err(CliError::failed)?;
            let pixels = exr_file::pixels(path, &planes).map_err(CliError::failed)?;
            (w, h, pixels, Kind::Linear)
        }
        Some("png") => {
            let (w, h, pixels) = png_file::read(path).map_err(CliError::failed)?;
            let linear = pixels.into_iter().map(|p| p.map(decode_srgb)).collect();
            (w, h, linear, Kind::Display)
        }
        _ => {
            return Err(CliError::Failed(format!(
                "{} is neither a .png nor an .exr file",
                path.display()
            )));
        }
    };
    let image = ImageRgb {
        width: width as usize,
        height: height as usize,
        pixels,
    };
    Ok((image, kind))
}

/// Prints the metrics of A against B as JSON.
pub fn run(args: &Args) -> CliResult {
    let (a, kind_a) = read(&args.a)?;
    let (b, kind_b) = read(&args.b)?;
    if kind_a != kind_b {
        return Err(CliError::Failed(
            "one image is a PNG and the other an EXR: compare like with like".to_owned(),
        ));
    }
    let mask = match &args.mask {
        None => None,
        Some(path) => {
            let (m, _) = read(path)?;
            if (m.width, m.height) != (a.width, a.height) {
                return Err(CliError::Failed(format!(
                    "the mask {} is {}x{}, the image {}x{}",
                    path.display(),
                    m.width,
                    m.height,
                    a.width,
                    a.height
                )));
            }
            Some(m.pixels.iter().map(|p| p.iter().any(|c| *c > 0.0)).collect::<Vec<_>>())
        }
    };
    let metrics = compare(&a, &b, kind_a, mask.as_deref()).map_err(CliError::failed)?;
    if let Some(path) = &args.heatmap {
        let map = heatmap(&a, &b, kind_a).map_err(CliError::failed)?;
        png_file::write(path, a.width as u32, a.height as u32, &map, &[]).map_err(CliError::failed)?;
    }
    stdout::line(serde_json::to_string_pretty(&metrics).map_err(CliError::failed)?).map_err(CliError::failed)
}
