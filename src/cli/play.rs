//! `q3rays` and `q3rays play`

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use crate::app::{headless, window};
use crate::console::Cvars;
use crate::content::fly_through;
use crate::engine::Engine;
use crate::output::stdout;
use std::path::Path;

/// Map that is played where none is named.
const DEFAULT_MAP: &str = fly_through::MAP;
/// Where a run without a display writes.
const OUT: &str = "q3rays-out";

/// Arguments of `play`.
#[derive(clap::Args, Default)]
pub struct Args {
    /// Map name; the map that ships with the program if none is given
    map: Option<String>,
    /// Close the window after so many frames
    #[arg(long, value_name = "N", hide = true)]
    frames: Option<u32>,
}

/// Opens the window on a map, or does a run without one where there is no display.
pub fn run(common: &Common, cvars: Cvars, args: Args, map: Option<String>) -> CliResult {
    let map = args.map.or(map).unwrap_or_else(|| DEFAULT_MAP.to_owned());
    let (scene, _) = common.played_scene(&map, &cvars)?;
    let engine = common.engine(&cvars)?;
    match engine {
        Engine::Vulkan { .. } if window::has_display() => {
            // The window needs a device that can present, which is opened with it.
            drop(engine);
            return window::run(window::Options {
                scene,
                cvars,
                device: common.device.clone(),
                frames: args.frames,
            });
        }
        Engine::Vulkan { .. } => stdout::line("no display: running without a window"),
        Engine::Cpu => stdout::line("the window needs a Vulkan device: running without one"),
    }
    .map_err(CliError::failed)?;
    let bar = progress(1000, &map);
    let done = headless::run(&engine, &scene, &cvars, Path::new(OUT), &|share| {
        bar.set_position((share * 1000.0) as u64);
    });
    bar.finish_and_clear();
    done
}
