//! One place that files come from: a folder, a `.pk3` archive, or bytes inside the program.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use thiserror::Error;
use zip::ZipArchive;

/// Largest file that is read, in bytes: beyond it lies damage or a zip bomb, not a map.
const MAX_FILE: u64 = 1 << 30;
/// How deep loose folders are searched.
const MAX_DEPTH: usize = 16;

/// Why a file or archive could not be read.
#[derive(Debug, Error)]
pub enum VfsError {
    #[error("cannot read {path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("cannot read {path}: not a usable zip archive ({source})")]
    Zip {
        path: PathBuf,
        source: zip::result::ZipError,
    },
    #[error("cannot read {file} in {path}: it is larger than {MAX_FILE} bytes")]
    TooLarge { path: PathBuf, file: String },
}

enum Kind {
    Folder(PathBuf),
    Pak(PathBuf, Mutex<ZipArchive<BufReader<File>>>),
    Embedded(&'static [(&'static str, &'static [u8])]),
}

/// A mounted source: its files by lower-case path.
pub struct Mount {
    kind: Kind,
    /// Lower-case path → entry: index in the archive, in the embedded table, or in `paths`.
    files: HashMap<String, usize>,
    /// Lower-case paths in the mount's own order.
    order: Vec<String>,
    /// Real relative paths of a folder's files.
    paths: Vec<PathBuf>,
}

/// Lower case, forward slashes, no leading `./` or `/`.
pub fn normalise(path: &str) -> String {
    path.replace('\\', "/")
        .to_ascii_lowercase()
        .trim_start_matches("./")
        .trim_start_matches('/')
        .to_owned()
}

fn walk(root: &Path, below: &Path, depth: usize, out: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries: Vec<_> = std::fs::read_dir(root.join(below))?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = below.join(entry.file_name());
        // Follows links, so that linked content works; the depth limit ends cycles.
        let Ok(meta) = std::fs::metadata(root.join(&path)) else {
            continue;
        };
        if meta.is_dir() {
            if depth < MAX_DEPTH {
                walk(root, &path, depth + 1, out)?;
            }
        } else if meta.is_file() {
            out.push(path);
        }
    }
    Ok(())
}

impl Mount {
    /// Loose files of a folder.
    ///
    /// # Errors
    /// [`VfsError::Io`] where the folder cannot be listed.
    pub fn folder(root: &Path) -> Result<Self, VfsError> {
        let mut paths = Vec::new();
        walk(root, Path::new(""), 0, &mut paths).map_err(|source| VfsError::Io {
            path: root.to_owned(),
            source,
        })?;
        let order: Vec<_> = paths.iter().map(|p| normalise(&p.to_string_lossy())).collect();
        let files = order.iter().cloned().enumerate().map(|(i, p)| (p, i)).collect();
        Ok(Self {
            kind: Kind::Folder(root.to_owned()),
            files,
            order,
            paths,
        })
    }

    /// A `.pk3` archive.
    ///
    /// # Errors
    /// [`VfsError`] where it cannot be opened or is no zip archive.
    pub fn pak(path: &Path) -> Result<Self, VfsError> {
        let file = File::open(path).map_err(|source| VfsError::Io {
            path: path.to_owned(),
            source,
        })?;
        let archive = ZipArchive::new(BufReader::new(file)).map_err(|source| VfsError::Zip {
            path: path.to_owned(),
            source,
        })?;
        let mut files = HashMap::new();
        let mut order = Vec::new();
        for index in 0..archive.len() {
            let Some(Ok(name)) = archive.name_for_index(index) else {
                continue;
            };
            if name.ends_with('/') {
                continue;
            }
            let name = normalise(&name);
            if files.insert(name.clone(), index).is_none() {
                order.push(name);
            }
        }
        Ok(Self {
            kind: Kind::Pak(path.to_owned(), Mutex::new(archive)),
            files,
            order,
            paths: Vec::new(),
        })
    }

    /// Files compiled into the program.
    pub fn embedded(table: &'static [(&'static str, &'static [u8])]) -> Self {
        let order: Vec<_> = table.iter().map(|(p, _)| normalise(p)).collect();
        let files = order.iter().cloned().enumerate().map(|(i, p)| (p, i)).collect();
        Self {
            kind: Kind::Embedded(table),
            files,
            order,
            paths: Vec::new(),
        }
    }

    /// What a user would call this mount.
    pub fn label(&self) -> String {
        match &self.kind {
            Kind::Folder(path) | Kind::Pak(path, _) => path.display().to_string(),
            Kind::Embedded(_) => "built in".to_owned(),
        }
    }

    /// Whether a (normalised) path exists here.
    pub fn contains(&self, path: &str) -> bool {
        self.files.contains_key(path)
    }

    /// Normalised paths in the mount's own order.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.order.iter().map(String::as_str)
    }

    /// Reads a (normalised) path.
    ///
    /// # Errors
    /// [`VfsError`] where it exists and cannot be read.
    pub fn read(&self, path: &str) -> Result<Option<Vec<u8>>, VfsError> {
        let Some(&index) = self.files.get(path) else {
            return Ok(None);
        };
        match &self.kind {
            Kind::Embedded(table) => Ok(Some(table[index].1.to_vec())),
            Kind::Folder(root) => {
                let path = root.join(&self.paths[index]);
                let io = |source| VfsError::Io {
                    path: path.clone(),
                    source,
                };
                let file = File::open(&path).map_err(io)?;
                read_limited(file, &path, "it").map(Some)
            }
            Kind::Pak(pak, archive) => {
                // A panic while the lock was held would have come from the zip crate; its state is only a file cursor.
                let mut archive = archive.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                let entry = archive.by_index(index).map_err(|source| VfsError::Zip {
                    path: pak.clone(),
                    source,
                })?;
                read_limited(entry, pak, path).map(Some)
            }
        }
    }
}

fn read_limited(reader: impl Read, path: &Path, file: &str) -> Result<Vec<u8>, VfsError> {
    let mut bytes = Vec::new();
    reader
        .take(MAX_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(|source| VfsError::Io {
            path: path.to_owned(),
            source,
        })?;
    if bytes.len() as u64 > MAX_FILE {
        return Err(VfsError::TooLarge {
            path: path.to_owned(),
            file: file.to_owned(),
        });
    }
    Ok(bytes)
}
