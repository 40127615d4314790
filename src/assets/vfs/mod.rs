//! The virtual file system: `.pk3` archives and folders seen as one tree of lower-case paths.

pub mod discover;
pub mod mount;
pub mod search_path;

pub use discover::Install;
pub use mount::VfsError;
pub use search_path::Vfs;

/// Where the renderer's libraries read files from; paths are relative, with `/`, compared without case.
pub trait FileSource: Sync {
    /// The file's bytes, or `None` where no such file exists.
    ///
    /// # Errors
    /// [`VfsError`] where it exists and cannot be read.
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, VfsError>;

    /// Paths of all files in `folder` (not below it) with the given extension, each once, in id's listing order:
    /// the highest-priority mount first, and within it the mount's own order.
    fn list(&self, folder: &str, extension: &str) -> Vec<String>;
}
