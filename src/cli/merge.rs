//! `q3rays merge`

use super::args::{CliError, CliResult};
use crate::output::exr_file;
use std::path::PathBuf;

/// Arguments of `merge`.
#[derive(clap::Args)]
pub struct Args {
    /// EXR file to write
    out: PathBuf,
    /// EXR files to join, made with different --first-sample or --seed
    #[arg(required = true)]
    parts: Vec<PathBuf>,
}

/// Joins partial accumulations.
pub fn run(args: &Args) -> CliResult {
    if !args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return Err(CliError::Usage(format!("{} must end in .exr", args.out.display())));
    }
    let mut parts = args.parts.iter();
    let Some(first) = parts.next() else {
        return Err(CliError::Usage("nothing to merge".to_owned()));
    };
    let mut film = exr_file::read_film(first).map_err(CliError::failed)?;
    for path in parts {
        let part = exr_file::read_film(path).map_err(CliError::failed)?;
        film.merge(&part)
            .map_err(|e| CliError::Failed(format!("cannot merge {}: {e}", path.display())))?;
    }
    exr_file::write_film(&args.out, &film, &[]).map_err(CliError::failed)
}
