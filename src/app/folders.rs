//! Where the program keeps what is the user's.

use crate::assets::vfs::{FileSource, Vfs};
use crate::console::complete::Names;
use crate::console::shell::Scripts;
use directories::ProjectDirs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Longest name of a file that a command may give.
const LONGEST_NAME: usize = 100;

/// The user's folders.
#[derive(Clone, Debug)]
pub struct Folders {
    /// Configuration and scripts.
    pub config: PathBuf,
    /// Screenshots, recordings, films, statistics.
    data: PathBuf,
    /// What can be made again.
    cache: PathBuf,
}

impl Folders {
    /// Below one folder, or in the platform's usual places; where there is no home, for this run alone.
    pub fn new(home: Option<&Path>) -> Self {
        let below = |home: &Path| Self {
            config: home.to_owned(),
            data: home.to_owned(),
            cache: home.join("cache"),
        };
        match (home, ProjectDirs::from("", "", "q3rays")) {
            (Some(home), _) => below(home),
            (None, Some(dirs)) => Self {
                config: dirs.config_dir().to_owned(),
                data: dirs.data_dir().to_owned(),
                cache: dirs.cache_dir().to_owned(),
            },
            (None, None) => below(&std::env::temp_dir().join("q3rays")),
        }
    }

    /// The driver's compiled pipelines.
    pub fn pipelines(&self) -> PathBuf {
        self.cache.join("pipelines.bin")
    }

    /// Light cells of maps.
    pub fn light_cells(&self) -> PathBuf {
        self.cache.join("light_cells")
    }

    /// File of a recording.
    ///
    /// # Errors
    /// One sentence for a name that is none.
    pub fn recording(&self, name: &str) -> Result<PathBuf, String> {
        self.file("recordings", name, "json")
    }

    /// A file of the user's: `name` without folder, or the first of its stem and a number that is not there yet.
    ///
    /// # Errors
    /// One sentence for a name that is none.
    pub fn named_or_new(
        &self,
        folder: &str,
        name: Option<&str>,
        stem: &str,
        extension: &str,
    ) -> Result<PathBuf, String> {
        if let Some(name) = name {
            return self.file(folder, name, extension);
        }
        for number in 0..100_000 {
            let path = self.data.join(folder).join(format!("{stem}-{number:04}.{extension}"));
            if !path.exists() {
                return Ok(path);
            }
        }
        Err(format!("{} is full", self.data.join(folder).display()))
    }

    /// A file of the user's by a name that a command gave.
    ///
    /// # Errors
    /// One sentence for a name that leads elsewhere.
    pub fn file(&self, folder: &str, name: &str, extension: &str) -> Result<PathBuf, String> {
        let suffix = format!(".{extension}");
        let stem = name.strip_suffix(&suffix).unwrap_or(name);
        let fits = |c: char| c.is_alphanumeric() || "-_. +".contains(c);
        if stem.is_empty() || stem.len() > LONGEST_NAME || stem.starts_with('.') || !stem.chars().all(fits) {
            return Err(format!(
                "\"{name}\" is no name for a file: letters, digits, - and _ make one"
            ));
        }
        Ok(self.data.join(folder).join(stem.to_owned() + &suffix))
    }

    /// Names that completion offers.
    pub fn names(&self, files: &Vfs) -> Names {
        Names {
            maps: files.maps().into_iter().map(|m| m.name).collect(),
            scripts: stems(&self.config, "cfg", true),
            recordings: stems(&self.data.join("recordings"), "json", false),
        }
    }
}

/// Names of a folder's files with an extension, sorted.
fn stems(folder: &Path, extension: &str, keep_extension: bool) -> Vec<String> {
    let mut out: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .filter_map(|path| {
            let name = if keep_extension {
                path.file_name()
            } else {
                path.file_stem()
            };
            name.map(|n| n.to_string_lossy().into_owned())
        })
        .collect();
    out.sort();
    out
}

/// Scripts of the user's folder, then those of the game's files.
pub struct UserScripts<'a> {
    pub folder: &'a Path,
    pub files: &'a Arc<Vfs>,
}

impl Scripts for UserScripts<'_> {
    fn script(&self, name: &str) -> Result<Option<String>, String> {
        let name = if name.contains('.') {
            name.to_owned()
        } else {
            format!("{name}.cfg")
        };
        if name.contains("..") || Path::new(&name).is_absolute() {
            return Err(format!("scripts lie in {}", self.folder.display()));
        }
        let path = self.folder.join(&name);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => Some(bytes),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => self.files.read(&name).map_err(|e| e.to_string())?,
            Err(e) => return Err(format!("cannot read {} ({e})", path.display())),
        };
        Ok(bytes.map(|b| String::from_utf8_lossy(&b).into_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_their_folder() {
        let home = tempfile::tempdir().expect("a temporary folder");
        let folders = Folders::new(Some(home.path()));
        for bad in ["", "../x", "/etc/x", ".x", "a/b", "a\\b", "a\0b"] {
            assert!(folders.recording(bad).is_err(), "{bad:?}");
        }
        assert_eq!(folders.recording("a").ok(), Some(home.path().join("recordings/a.json")));
        assert_eq!(folders.recording("a.json").ok(), folders.recording("a").ok());
    }

    #[test]
    fn new_files_do_not_replace_old_ones() {
        let home = tempfile::tempdir().expect("a temporary folder");
        let folders = Folders::new(Some(home.path()));
        let first = folders.named_or_new("screenshots", None, "m", "png").expect("a name");
        std::fs::create_dir_all(home.path().join("screenshots")).expect("a folder");
        std::fs::write(&first, b"x").expect("written");
        let second = folders.named_or_new("screenshots", None, "m", "png").expect("a name");
        assert_ne!(first, second);
    }
}
