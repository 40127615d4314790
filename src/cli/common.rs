//! Options that every sub-command takes, and what follows from them.

use super::args::CliError;
use crate::app::folders::Folders;
use crate::assets::vfs::{FileSource, Install, Vfs};
use crate::console::Cvars;
use crate::console::settings::lights;
use crate::content;
use crate::engine::{BackendChoice, Engine};
use crate::gpu::ValidationMode;
use crate::lighting::{self, Lighting};
use crate::recovery::Options;
use crate::scene::Scene;
use crate::scene::load::LoadOptions;
use crate::scene::player::Player;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Options common to all sub-commands.
#[derive(clap::Args, Clone, Debug)]
pub struct Common {
    /// Folder that holds baseq3 (or baseoa, or paks); switches automatic discovery off
    #[arg(long, global = true, value_name = "DIR")]
    pub basepath: Option<PathBuf>,
    /// Mod folder searched before the base game
    #[arg(long, global = true, value_name = "DIR")]
    pub game: Option<String>,
    /// How to trace: auto, rayquery, bvh or cpu (the same as +set rt_backend)
    #[arg(long, global = true, value_name = "NAME")]
    pub backend: Option<String>,
    /// GPU to use: its number or part of its name
    #[arg(long, global = true, value_name = "INDEX|NAME", allow_hyphen_values = true)]
    pub device: Option<String>,
    /// Seed of all random numbers (the same as +set rt_seed)
    #[arg(long, global = true, value_name = "N", allow_hyphen_values = true)]
    pub seed: Option<String>,
    /// Folder for settings, recordings, screenshots, recovered lights and all else that is kept
    #[arg(long, global = true, value_name = "DIR")]
    pub home: Option<PathBuf>,
    /// Body that mirrors show, and with it a weapon before the eye; in `play`, sarge where there is one
    #[arg(long, global = true, value_name = "MODEL[/SKIN]")]
    pub player: Option<String>,
}

impl Common {
    /// Puts options that stand for variables into them.
    pub fn apply(&self, cvars: &mut Cvars) -> Result<(), CliError> {
        for (name, value) in self.sets() {
            let note = cvars.set(name, value).map_err(|e| CliError::Usage(e.to_string()))?;
            note.into_iter().for_each(|n| eprintln!("{n}"));
        }
        Ok(())
    }

    /// Options that stand for variables, with their values.
    pub fn sets(&self) -> impl Iterator<Item = (&str, &str)> {
        let pairs = [("rt_backend", &self.backend), ("rt_seed", &self.seed)];
        pairs
            .into_iter()
            .filter_map(|(name, value)| Some((name, value.as_deref()?)))
    }

    /// Mounts the game files.
    pub fn files(&self) -> Result<Vfs, CliError> {
        let installs = match &self.basepath {
            Some(path) if !path.is_dir() => {
                return Err(CliError::Failed(format!("--basepath {} is no folder", path.display())));
            }
            Some(path) => vec![Install::at(path, self.game.as_deref())],
            None => Install::discover(self.game.as_deref()),
        };
        let files = Vfs::mount(&installs, content::embedded::EMBEDDED);
        for warning in &files.warnings {
            eprintln!("warning: {warning}");
        }
        Ok(files)
    }

    /// Chooses what traces, and says so.
    pub fn engine(&self, cvars: &Cvars) -> Result<Engine, CliError> {
        let choice = BackendChoice::from_word(&cvars.get("rt_backend").unwrap_or_default());
        let choice = Engine::choose(choice, self.device.as_deref(), ValidationMode::Off).map_err(CliError::failed)?;
        eprintln!("{}", choice.line);
        Ok(choice.engine)
    }

    /// Loads a map as its files describe it and tells what is missing.
    pub fn scene(&self, map: &str) -> Result<Scene, CliError> {
        let files = self.files()?.focused_on(map);
        let scene = Scene::load(&files, map).map_err(CliError::failed)?;
        tell_warnings(&scene, &|text| eprintln!("warning: {text}"));
        Ok(scene)
    }

    /// Loads a map with the lights that the variables ask for, and the player that the options name.
    pub fn lit_scene(&self, map: &str, cvars: &Cvars) -> Result<(Scene, Lighting), CliError> {
        let files = self.files()?.focused_on(map);
        with_bar(map, &|news| {
            self.lit_scene_with(&files, map, cvars, self.player.as_deref().map(player), news)
        })
    }

    /// The same for somebody who plays: the default player where none is named and its files are there.
    pub fn played_scene(&self, map: &str, cvars: &Cvars) -> Result<(Scene, Lighting), CliError> {
        let files = self.files()?;
        with_bar(map, &|news| self.played_scene_from(&files, map, cvars, news))
    }

    /// The same from files that are mounted already.
    pub fn played_scene_from(
        &self,
        files: &Vfs,
        map: &str,
        cvars: &Cvars,
        news: &LoadNews<'_>,
    ) -> Result<(Scene, Lighting), CliError> {
        let files = files.focused_on(map);
        let there = |p: &Player| {
            let path = format!("models/players/{}/lower.md3", p.model);
            matches!(files.read(&path), Ok(Some(_)))
        };
        let player = match &self.player {
            Some(name) => Some(player(name)),
            None => Some(Player::default()).filter(there),
        };
        self.lit_scene_with(&files, map, cvars, player, news)
    }

    fn lit_scene_with(
        &self,
        files: &Vfs,
        map: &str,
        cvars: &Cvars,
        player: Option<Player>,
        news: &LoadNews<'_>,
    ) -> Result<(Scene, Lighting), CliError> {
        let options = LoadOptions {
            player,
            ..LoadOptions::default()
        };
        let mut scene = Scene::load_with(files, map, &options).map_err(CliError::failed)?;
        tell_warnings(&scene, news.warn);
        // Beside the configuration.
        let folders = Folders::new(self.home.as_deref());
        let kept = lighting::Kept {
            lights: folders.config.join("lights"),
            cells: folders.light_cells(),
        };
        let lit = lighting::light(&mut scene, files, lights(cvars), &kept, &Options::default(), news.share);
        let lit = lit.map_err(CliError::failed)?;
        lit.warnings.iter().for_each(|warning| (news.warn)(warning));
        Ok((scene, lit))
    }
}

/// Who hears of a loading.
pub struct LoadNews<'a> {
    /// Share of the search for lights that is done.
    pub share: &'a (dyn Fn(f32) + Sync),
    /// What is missing or damaged, one sentence each.
    pub warn: &'a dyn Fn(&str),
}

/// A loading with a bar and warnings on the terminal.
fn with_bar<T>(map: &str, load: &dyn Fn(&LoadNews<'_>) -> Result<T, CliError>) -> Result<T, CliError> {
    let bar = progress(RECOVERY_STEPS, &format!("{map}: lights"));
    let loaded = load(&LoadNews {
        share: &|share| bar.set_position((share * RECOVERY_STEPS as f32) as u64),
        warn: &|text| bar.suspend(|| eprintln!("warning: {text}")),
    });
    bar.finish_and_clear();
    loaded
}

/// The player of a MODEL[/SKIN].
fn player(name: &str) -> Player {
    let (model, skin) = name.split_once('/').unwrap_or((name, "default"));
    Player {
        model: model.to_ascii_lowercase(),
        skin: skin.to_ascii_lowercase(),
        ..Player::default()
    }
}

/// Steps of the bar that recovering lights moves.
const RECOVERY_STEPS: u64 = 1000;

/// Warnings of a map that are told one by one.
const WARNINGS_SHOWN: usize = 5;

fn tell_warnings(scene: &Scene, warn: &dyn Fn(&str)) {
    for warning in scene.warnings.iter().take(WARNINGS_SHOWN) {
        warn(&format!("{}: {warning}", scene.name));
    }
    if let Some(more @ 1..) = scene.warnings.len().checked_sub(WARNINGS_SHOWN) {
        warn(&format!(
            "{}: and {more} more (see `q3rays info {}`)",
            scene.name, scene.name
        ));
    }
}

/// A bar of `steps` steps on a terminal, nothing in a pipe.
pub fn progress(steps: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(steps);
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% {eta}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(what.to_owned());
    bar
}
