//! Files that are written: images, EXR, statistics.

pub mod atomic;
pub mod checksum;
pub mod exr_file;
pub mod picture;
pub mod png_file;
pub mod stats;
pub mod stdout;

use std::path::PathBuf;
use thiserror::Error;

/// Why a file could not be written or read back.
#[derive(Debug, Error)]
pub enum OutputError {
    #[error("cannot write {path}: {source}")]
    Write { path: PathBuf, source: std::io::Error },
    #[error("cannot read {path}: {reason}")]
    Read { path: PathBuf, reason: String },
    #[error("cannot encode {path}: {reason}")]
    Encode { path: PathBuf, reason: String },
    #[error("do not know what kind of image {path} is; the name must end in .png or .exr")]
    Extension { path: PathBuf },
}
