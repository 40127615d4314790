//! The search path: mounts in priority order.

use super::FileSource;
use super::discover::Install;
use super::mount::{Mount, VfsError, normalise};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

/// A map that can be opened, and the mount it would come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundMap {
    /// Name as given to `map`: the path below `maps/` without extension.
    pub name: String,
    /// Archive or folder.
    pub place: String,
}

#[derive(Clone)]
struct Entry {
    mount: Arc<Mount>,
    install: usize,
}

/// Files of all mounted places, the highest priority first; the content we ship always stands last.
#[derive(Clone)]
pub struct Vfs {
    entries: Vec<Entry>,
    /// Places that could not be mounted, one sentence each.
    pub warnings: Vec<String>,
}

impl Vfs {
    /// Mounts the folders of each install: in a folder loose files first, then archives in descending name order.
    pub fn mount(installs: &[Install], embedded: &'static [(&'static str, &'static [u8])]) -> Self {
        let mut entries = Vec::new();
        let mut warnings = Vec::new();
        for (install, place) in installs.iter().enumerate() {
            for folder in &place.folders {
                let (mounts, problems) = mount_folder(folder);
                warnings.extend(problems);
                entries.extend(mounts.into_iter().map(|mount| Entry {
                    mount: Arc::new(mount),
                    install,
                }));
            }
        }
        entries.push(Entry {
            mount: Arc::new(Mount::embedded(embedded)),
            install: installs.len(),
        });
        Self { entries, warnings }
    }

    /// The same files with the install that holds `map` first, so that its own textures and scripts are used even
    /// where another game is installed beside it.
    pub fn focused_on(&self, map: &str) -> Self {
        let path = map_path(map);
        let mut out = self.clone();
        if let Some(install) = self.entries.iter().find(|e| e.mount.contains(&path)).map(|e| e.install) {
            out.entries.sort_by_key(|e| e.install != install);
        }
        out
    }

    /// All maps, sorted by name, each with the place it comes from.
    pub fn maps(&self) -> Vec<FoundMap> {
        let mut seen = HashSet::new();
        let mut maps = Vec::new();
        for entry in &self.entries {
            for path in entry.mount.paths() {
                let name = path.strip_prefix("maps/").and_then(|p| p.strip_suffix(".bsp"));
                if let Some(name) = name
                    && seen.insert(name.to_owned())
                {
                    maps.push(FoundMap {
                        name: name.to_owned(),
                        place: entry.mount.label(),
                    });
                }
            }
        }
        maps.sort_by(|a, b| a.name.cmp(&b.name));
        maps
    }
}

/// Path of a map's file.
pub fn map_path(map: &str) -> String {
    let name = normalise(map);
    let name = name.strip_prefix("maps/").unwrap_or(&name);
    format!("maps/{}.bsp", name.strip_suffix(".bsp").unwrap_or(name))
}

fn mount_folder(folder: &Path) -> (Vec<Mount>, Vec<String>) {
    let (mut mounts, mut problems) = (Vec::new(), Vec::new());
    match Mount::folder(folder) {
        Ok(mount) => mounts.push(mount),
        Err(e) => problems.push(e.to_string()),
    }
    let mut paks: Vec<_> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pk3")))
        .collect();
    // Upper-cased names, the last one first: id's order.
    paks.sort_by_key(|p| p.file_name().map(|n| n.to_string_lossy().to_ascii_uppercase()));
    for pak in paks.iter().rev() {
        match Mount::pak(pak) {
            Ok(mount) => mounts.push(mount),
            Err(e) => problems.push(e.to_string()),
        }
    }
    (mounts, problems)
}

impl FileSource for Vfs {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, VfsError> {
        let path = normalise(path);
        for entry in &self.entries {
            if let Some(bytes) = entry.mount.read(&path)? {
                return Ok(Some(bytes));
            }
        }
        Ok(None)
    }

    fn list(&self, folder: &str, extension: &str) -> Vec<String> {
        let prefix = format!("{}/", normalise(folder));
        let suffix = format!(".{extension}");
        let mut seen = HashSet::new();
        let mut out = Vec::new();
        for entry in &self.entries {
            for path in entry.mount.paths() {
                let inside = path
                    .strip_prefix(&prefix)
                    .is_some_and(|rest| !rest.contains('/') && rest.ends_with(&suffix));
                if inside && seen.insert(path.to_owned()) {
                    out.push(path.to_owned());
                }
            }
        }
        out
    }
}
