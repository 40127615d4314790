//! `q3rays bench compare`

use super::super::args::{CliError, CliResult};
use super::results::{kind, read};
use crate::bench::comparison::Comparison;
use crate::bench::{error_report, frames_report};
use crate::output::stdout;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(super) struct CompareArgs {
    /// Folder or data.json of the run before
    before: PathBuf,
    /// Folder or data.json of the run after
    after: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

fn data(path: &Path) -> PathBuf {
    if path.is_dir() {
        path.join("data.json")
    } else {
        path.to_owned()
    }
}

/// Compares two runs.
pub(super) fn run(args: &CompareArgs) -> CliResult {
    let (a, b) = (data(&args.before), data(&args.after));
    let kinds = (kind(&a)?, kind(&b)?);
    let found = match (kinds.0.as_str(), kinds.1.as_str()) {
        (frames_report::KIND, frames_report::KIND) => Comparison::of_frames(&read(&a)?, &read(&b)?),
        (error_report::KIND, error_report::KIND) => Comparison::of_errors(&read(&a)?, &read(&b)?),
        _ => {
            return Err(CliError::Failed(format!(
                "the runs are of different kinds ({} and {}): compare like with like",
                kinds.0, kinds.1
            )));
        }
    };
    if args.json {
        return stdout::line(serde_json::to_string_pretty(&found).map_err(CliError::failed)?).map_err(CliError::failed);
    }
    stdout::line(found).map_err(CliError::failed)
}
