//! Notices when shaders are changed on disk.

use crate::gpu::shader_compiler::source_root;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

/// How often to look.
const EVERY: Duration = Duration::from_millis(500);

/// When the sources were last changed.
pub struct ShaderWatch {
    newest: Option<SystemTime>,
    looked: Instant,
}

impl ShaderWatch {
    /// As they are now.
    pub fn new() -> Self {
        Self {
            newest: newest(&source_root()),
            looked: Instant::now(),
        }
    }

    /// Whether any was changed since the last call.
    pub fn changed(&mut self) -> bool {
        if self.looked.elapsed() < EVERY {
            return false;
        }
        self.looked = Instant::now();
        let now = newest(&source_root());
        std::mem::replace(&mut self.newest, now) != now
    }
}

/// Time of the last change in a folder and one below it.
fn newest(folder: &Path) -> Option<SystemTime> {
    let files = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let time = |entry: std::fs::DirEntry| entry.metadata().and_then(|m| m.modified()).ok();
    let own = files(folder).filter(|e| e.path().is_file()).filter_map(time);
    let below = files(&folder.join("include")).filter_map(time);
    own.chain(below).max()
}
