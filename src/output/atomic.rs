//! Whole files or none.

use super::OutputError;
use std::path::Path;

/// Writes a file beside its place first and moves it there when it is complete, so that no half-written file is left and
/// an old one is lost only to a whole new one.
///
/// # Errors
/// [`OutputError::Write`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let failed = |source| OutputError::Write {
        path: path.to_owned(),
        source,
    };
    // Devices and pipes (/dev/stdout) cannot be replaced by renaming.
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        return std::fs::write(path, bytes).map_err(failed);
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".part{}", std::process::id()));
    let part = path.with_file_name(name);
    std::fs::write(&part, bytes)
        .and_then(|()| std::fs::rename(&part, path))
        .map_err(|e| {
            // The first error is the one to tell; a part that cannot be removed was most likely never made.
            let _ = std::fs::remove_file(&part);
            failed(e)
        })
}

/// Makes the folder that a file is to lie in.
///
/// # Errors
/// [`OutputError::Write`].
pub fn create_parent(path: &Path) -> Result<(), OutputError> {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => {
            std::fs::create_dir_all(parent).map_err(|source| OutputError::Write {
                path: parent.to_owned(),
                source,
            })
        }
        _ => Ok(()),
    }
}
