//! `q3rays bench`

mod comparison;
mod error;
mod figures;
mod frames;
mod lights;
mod pictures;
mod rays;
mod results;
mod structures;

use super::args::{CliError, CliResult};
use super::common::Common;
use crate::console::Cvars;
use crate::engine::Engine;
use crate::gpu::Device;
use crate::output::atomic;
use crate::render::backend::Backend;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Maps of the published figures, from small to large.
const DEFAULT_MAPS: [&str; 5] = ["oa_dm1", "am_galmevish2", "ctf_compromise", "oa_minia", "oacmpctf3"];
/// Field of view, degrees.
const FOV: f32 = 90.0;

/// Arguments of `bench`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    frames: frames::FramesArgs,
}

#[derive(clap::Subcommand)]
enum What {
    /// Run time against error of many choices of settings
    Error(error::ErrorArgs),
    /// What got faster, slower or less accurate from one run to another
    Compare(comparison::CompareArgs),
    /// Rays per second of the traversal alone
    Rays(rays::RaysArgs),
    /// Error against time of the ways to choose a light
    Lights(lights::LightsArgs),
    /// What acceleration structures cost to build, refit and upload
    Structures(structures::StructuresArgs),
    /// What the denoiser makes of one light sample per pixel, and its times
    Denoiser(pictures::DenoiserArgs),
    /// A walk with sudden turns and a jump to another place, frame by frame
    Motion(pictures::PictureArgs),
    /// What culling lights does to denoised frames
    Culling(pictures::PictureArgs),
}

/// Runs a benchmark.
pub fn run(common: &Common, cvars: &Cvars, args: &Args) -> CliResult {
    let Some(what) = &args.what else {
        return match args.frames.figure() {
            Some((name, maps)) => figures::run(common, cvars, &args.frames, name, maps),
            None => frames::run(common, cvars, &args.frames),
        };
    };
    match what {
        What::Error(args) => error::run(common, cvars, args),
        What::Compare(args) => comparison::run(args),
        What::Rays(args) => rays::run(common, cvars, args),
        What::Lights(args) => lights::run(common, cvars, args),
        What::Structures(args) => structures::run(common, cvars, args),
        What::Denoiser(args) => pictures::denoiser(common, cvars, args),
        What::Motion(args) => pictures::motion(common, cvars, args),
        What::Culling(args) => pictures::culling(common, cvars, args),
    }
}

/// The Vulkan device that is measured.
fn vulkan(common: &Common, cvars: &Cvars, name: &str) -> Result<(Arc<Device>, Backend), CliError> {
    match vulkan_engine(common, cvars, name)? {
        Engine::Vulkan { device, backend } => Ok((device, backend)),
        Engine::Cpu => Err(no_device(name)),
    }
}

fn no_device(name: &str) -> CliError {
    CliError::Failed(format!("bench {name} measures Vulkan devices; there is none"))
}

/// The same as an engine.
fn vulkan_engine(common: &Common, cvars: &Cvars, name: &str) -> Result<Engine, CliError> {
    match common.engine(cvars)? {
        Engine::Cpu => Err(no_device(name)),
        engine => Ok(engine),
    }
}

/// Writes what was measured as JSON where that is wanted.
fn keep(path: Option<&Path>, report: &impl Serialize) -> CliResult {
    let Some(path) = path else { return Ok(()) };
    let text = serde_json::to_string_pretty(report).map_err(CliError::failed)?;
    atomic::write(path, text.as_bytes()).map_err(CliError::failed)
}
