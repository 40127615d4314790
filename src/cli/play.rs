//! `q3rays` and `q3rays play`

use super::args::{CliError, CliResult, ConsoleWords};
use super::common::{Common, LoadNews, progress};
use crate::app::folders::Folders;
use crate::app::window::{Start, StatsRun};
use crate::app::{MapSource, headless, window};
use crate::console::config::{AUTOEXEC, Config};
use crate::console::tokens::quoted;
use crate::console::{Cvars, Shell};
use crate::content::fly_through;
use crate::output::stdout;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Map that is played where none is named.
const DEFAULT_MAP: &str = fly_through::MAP;
/// Where a run without a display writes.
const OUT: &str = "q3rays-out";

/// Arguments of `play`.
#[derive(clap::Args, Default)]
pub struct Args {
    /// Map name; the map that ships with the program if none is given
    map: Option<String>,
    /// Write the times of all frames: .json or .csv
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Close the window after so many frames
    #[arg(long, value_name = "N", hide = true)]
    frames: Option<u32>,
}

/// Opens the window on a map, or does a run without one where there is no display. `cvars`: as the command line sets them.
pub fn run(common: &Common, cvars: Cvars, args: Args, words: ConsoleWords) -> CliResult {
    let map = words.map().or(args.map.clone());
    if window::has_display() && cvars.get("rt_backend").as_deref() != Some("cpu") {
        match in_window(common, map.clone(), &args, &words) {
            Err(CliError::NoWindow(reason)) => eprintln!("{reason}"),
            done => return done,
        }
    } else if cvars.get("rt_backend").as_deref() == Some("cpu") {
        stdout::line("the window needs a Vulkan device: running without one").map_err(CliError::failed)?;
    } else {
        stdout::line("no display: running without a window").map_err(CliError::failed)?;
    }
    let map = map.unwrap_or_else(|| DEFAULT_MAP.to_owned());
    let (scene, _) = common.played_scene(&map, &cvars)?;
    let engine = common.engine(&cvars)?;
    let bar = progress(1000, &map);
    let done = headless::run(&engine, &scene, &cvars, Path::new(OUT), &|share| {
        bar.set_position((share * 1000.0) as u64);
    });
    bar.finish_and_clear();
    done
}

fn in_window(common: &Common, map: Option<String>, args: &Args, words: &ConsoleWords) -> CliResult {
    let folders = Folders::new(common.home.as_deref());
    let files = Arc::new(common.files()?);
    let mut shell = Shell::default();
    let (mut config, message) = Config::load(&folders.config, &mut shell);
    if let Some(message) = message {
        eprintln!("warning: {message}");
        shell.log.warn(message);
    }
    for (name, value) in words
        .sets
        .iter()
        .map(|(n, v)| (n.as_str(), v.as_str()))
        .chain(common.sets())
    {
        let note = config
            .set_for_this_run(&mut shell, name, value)
            .map_err(CliError::Usage)?;
        note.into_iter().for_each(|n| eprintln!("{n}"));
    }
    if folders.config.join(AUTOEXEC).is_file() {
        shell.push(&format!("exec {AUTOEXEC}"));
    }
    let is_map = |words: &[String]| matches!(words[0].as_str(), "map" | "devmap");
    let commands: Vec<String> = words
        .commands
        .iter()
        .filter(|words| !is_map(words))
        .map(|words| words.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" "))
        .collect();
    let load = {
        let (common, files) = (common.clone(), files.clone());
        move |map: &str, cvars: &Cvars, report: &(dyn Fn(&str, f32) + Sync)| {
            let news = LoadNews {
                share: &|share| report("finding its lights", 0.3 + 0.7 * share),
                warn: &|_| {},
            };
            let loaded = common.played_scene_from(&files, map, cvars, &news);
            loaded.map(|(scene, _)| scene).map_err(|e| e.to_string())
        }
    };
    window::run(Start {
        source: MapSource {
            files,
            load: Arc::new(load),
        },
        folders,
        config,
        shell,
        map,
        device: common.device.clone().unwrap_or_else(|| "auto".to_owned()),
        frames: args.frames,
        stats: args.stats.clone().map(StatsRun::new),
        resume: None,
        lost: None,
        log_seen: 0,
        commands: commands.join("\n"),
    })
}
