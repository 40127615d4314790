//! Files of results: what an earlier run has left, and writing anew.

use super::super::args::{CliError, CliResult};
use crate::output::atomic;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

#[derive(Deserialize)]
struct Kind {
    kind: String,
}

/// Writes a whole file, and its folder where there is none.
pub(super) fn write(path: &Path, text: &str) -> CliResult {
    atomic::create_parent(path).map_err(CliError::failed)?;
    atomic::write(path, text.as_bytes()).map_err(CliError::failed)
}

/// Results of a kind.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, CliError> {
    let text =
        std::fs::read_to_string(path).map_err(|e| CliError::Failed(format!("cannot read {} ({e})", path.display())))?;
    serde_json::from_str(&text).map_err(|e| {
        CliError::Failed(format!(
            "{} holds no results that this version reads ({e}); measure again with --fresh",
            path.display()
        ))
    })
}

/// The kind of results that a file holds.
pub(super) fn kind(path: &Path) -> Result<String, CliError> {
    read::<Kind>(path).map(|k| k.kind)
}

/// What an earlier run has left; `None` where nothing is there.
pub(super) fn earlier<T: DeserializeOwned>(path: &Path, wanted: &str) -> Result<Option<T>, CliError> {
    if !path.exists() {
        return Ok(None);
    }
    let found = kind(path)?;
    if found != wanted {
        return Err(CliError::Failed(format!(
            "{} holds results of another kind ({found}); name another folder with --out",
            path.display()
        )));
    }
    read(path).map(Some)
}
