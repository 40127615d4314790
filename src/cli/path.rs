//! `q3rays render MAP --path F.json`: films of recordings.

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use super::render::Args;
use crate::app::film::FilmJob;
use crate::app::headless::run_stats;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::engine::Prepared;
use crate::game::recording::Recording;
use crate::output::stdout;
use std::path::Path;

/// Renders a recording frame by frame, or at fixed steps of time where `--fps` is given.
pub fn run(common: &Common, cvars: &Cvars, args: &Args, path: &Path) -> CliResult {
    let recording = Recording::read(path).map_err(CliError::failed)?;
    if recording.map != args.map {
        eprintln!("warning: {} was recorded on {}", path.display(), recording.map);
    }
    let (scene, _) = common.played_scene(&args.map, cvars)?;
    let engine = common.engine(cvars)?;
    let Prepared::Gpu(on_gpu) = engine.prepare(&scene).map_err(CliError::failed)? else {
        return Err(CliError::Failed(
            "films need a Vulkan device: the CPU tracer has no frame loop (--camera and --spp render single views)"
                .to_owned(),
        ));
    };
    let job = FilmJob {
        scene: on_gpu,
        recording: &recording,
        settings: settings(cvars),
        cache: None,
        size: args.size,
        fps: args.fps,
        samples: args.spp.unwrap_or(1),
        out: args.out.clone(),
    };
    let bar = progress(1000, &args.map);
    let made = job.run(&|share| {
        bar.set_position((share * 1000.0) as u64);
        true
    });
    bar.finish_and_clear();
    let (said, frames) = made.map_err(CliError::Failed)?;
    stdout::line(format!("wrote {said}")).map_err(CliError::failed)?;
    if let Some(path) = &args.stats {
        let stats = run_stats(&engine, cvars, &args.map, args.size, frames);
        stats.write(path).map_err(CliError::failed)?;
    }
    Ok(())
}
