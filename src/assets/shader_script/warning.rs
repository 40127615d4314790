//! What is wrong with a script, and where.

use std::fmt;
use std::sync::Arc;

/// One fault of a shader script. Reading always goes on after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Name of the script file as the caller gave it.
    pub file: Arc<str>,
    /// Line in the file, from 1.
    pub line: u32,
    /// Name of the definition it is in.
    pub shader: String,
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}:{}: shader {:?}: {}",
            self.file, self.line, self.shader, self.message
        )
    }
}
