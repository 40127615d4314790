//! `q3rays maps`

use super::args::{CliError, CliResult};
use super::common::Common;
use crate::output::stdout;

/// Arguments of `maps`.
#[derive(clap::Args)]
pub struct Args {}

/// Lists the maps found, and where.
pub fn run(common: &Common, _: &Args) -> CliResult {
    let maps = common.files()?.maps();
    let width = maps.iter().map(|m| m.name.len()).max().unwrap_or(0);
    for map in &maps {
        stdout::line(format_args!("{:width$}  {}", map.name, map.place)).map_err(CliError::failed)?;
    }
    Ok(())
}
