//! Where games are installed.

use std::path::{Path, PathBuf};

/// Game folders that hold the base content, in order of preference.
const BASE_GAMES: [&str; 2] = ["baseq3", "baseoa"];

/// One installed game: its content folders, the highest priority first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Install {
    pub folders: Vec<PathBuf>,
}

impl Install {
    /// Folders under the given roots (home path first): `--game` over the base game.
    fn under(roots: &[PathBuf], game: Option<&str>) -> Option<Self> {
        let base = BASE_GAMES
            .iter()
            .find(|base| roots.iter().any(|r| r.join(base).is_dir()))?;
        let mut folders = Vec::new();
        for name in game.into_iter().filter(|g| g != base).chain([*base]) {
            folders.extend(roots.iter().map(|r| r.join(name)).filter(|p| p.is_dir()));
        }
        Some(Self { folders })
    }

    /// The install at `--basepath`: a folder that contains `baseq3` or `baseoa`, or is itself one of paks or maps.
    pub fn at(root: &Path, game: Option<&str>) -> Self {
        Self::under(&[root.to_owned()], game).unwrap_or_else(|| {
            let game = game.map(|g| root.join(g)).filter(|p| p.is_dir());
            Self {
                folders: game.into_iter().chain([root.to_owned()]).collect(),
            }
        })
    }

    /// Everything found in the usual places of this platform, the working directory first.
    pub fn discover(game: Option<&str>) -> Vec<Self> {
        let mut found: Vec<Self> = Vec::new();
        for roots in usual_roots() {
            if let Some(install) = Self::under(&roots, game)
                && !found.iter().any(|f| f.folders == install.folders)
            {
                found.push(install);
            }
        }
        found
    }
}

/// Groups of root folders that belong together (home path, then install paths).
fn usual_roots() -> Vec<Vec<PathBuf>> {
    let home = std::env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" }).map(PathBuf::from);
    let under_home =
        |parts: &[&str]| -> Vec<PathBuf> { home.iter().flat_map(|h| parts.iter().map(move |p| h.join(p))).collect() };
    let plain = |parts: &[&str]| -> Vec<PathBuf> { parts.iter().map(PathBuf::from).collect() };
    let mut groups = vec![plain(&["."])];
    if let Some(beside) = std::env::current_exe()
        .ok()
        .and_then(|p| p.parent().map(Path::to_owned))
    {
        groups.push(vec![beside]);
    }
    if cfg!(windows) {
        for drive_folder in [
            r"C:\Program Files (x86)\Quake III Arena",
            r"C:\Program Files\Quake III Arena",
            r"C:\Quake III Arena",
            r"C:\Program Files (x86)\Steam\steamapps\common\Quake 3 Arena",
            r"C:\GOG Games\Quake III",
            r"C:\GOG Games\Quake III Gold",
            r"C:\Program Files\OpenArena",
            r"C:\Program Files (x86)\OpenArena",
        ] {
            groups.push(plain(&[drive_folder]));
        }
        return groups;
    }
    let mut quake = under_home(&[
        ".q3a",
        ".local/share/Quake3",
        ".var/app/org.ioquake3.ioquake3/.q3a",
        "Library/Application Support/Quake3",
        ".steam/steam/steamapps/common/Quake 3 Arena",
        ".local/share/Steam/steamapps/common/Quake 3 Arena",
        "Library/Application Support/Steam/steamapps/common/Quake 3 Arena",
        "GOG Games/Quake III Arena",
    ]);
    quake.extend(plain(&[
        "/usr/local/share/games/quake3",
        "/usr/local/games/quake3",
        "/usr/share/games/quake3",
        "/usr/share/quake3",
        "/usr/lib/games/quake3",
        "/usr/lib/ioquake3",
        "/opt/quake3",
        "/Applications/ioquake3",
    ]));
    let mut arena = under_home(&[".openarena", "Library/Application Support/OpenArena"]);
    arena.extend(plain(&[
        "/usr/local/share/games/openarena",
        "/usr/share/games/openarena",
        "/usr/share/openarena",
        "/usr/lib/openarena",
        "/opt/openarena",
        "/Applications/OpenArena",
    ]));
    groups.push(quake);
    groups.push(arena);
    groups
}
