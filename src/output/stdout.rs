//! Standard output that a reader may close early (`q3rays maps | head -1`).

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Prints one line. A reader that has gone away is no error: it has what it wanted.
///
/// # Errors
/// What writing reports otherwise, such as a full disk.
pub fn line(text: impl Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}
