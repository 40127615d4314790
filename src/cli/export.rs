//! `q3rays export`

use super::args::{CliError, CliResult};
use super::common::Common;
use super::view::ViewArgs;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::export::glb;
use crate::output::{atomic, stdout};
use crate::render::settings::Settings;
use crate::scene::clock::Clock;
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(clap::Args)]
pub struct Args {
    /// Map name
    map: String,
    /// File to write
    #[arg(value_name = "OUT.glb")]
    out: PathBuf,
    #[command(flatten)]
    view: ViewArgs,
    /// Scene clock, seconds
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, default_value_t = 0.0)]
    time: f64,
}

/// Writes the map as glTF.
pub fn run(common: &Common, cvars: &Cvars, args: &Args) -> CliResult {
    if !args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        return Err(CliError::Usage(format!(
            "export writes binary glTF: {} must end in .glb",
            args.out.display()
        )));
    }
    atomic::create_parent(&args.out).map_err(CliError::failed)?;
    let (scene, _) = common.lit_scene(&args.map, cvars)?;
    let camera = args.view.camera(&scene, cvars.number("cg_fov") as f32)?;
    let settings = Settings {
        clock: Clock::from_seconds(args.time),
        ..settings(cvars)
    };
    let bytes = glb(&scene, &settings, &camera).map_err(CliError::failed)?;
    atomic::write(&args.out, &bytes).map_err(CliError::failed)?;
    stdout::line(args.out.display()).map_err(CliError::failed)
}
