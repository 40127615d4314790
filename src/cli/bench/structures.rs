//! `q3rays bench structures`

use super::super::args::{CliError, CliResult};
use super::super::common::Common;
use super::{DEFAULT_MAPS, keep, vulkan};
use crate::bench::structures::{StructuresReport, measure};
use crate::console::Cvars;
use crate::output::{atomic, stdout};
use crate::render::scene_gpu::SceneGpu;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(super) struct StructuresArgs {
    /// Map names
    #[arg(default_values = DEFAULT_MAPS)]
    maps: Vec<String>,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Measures the maps.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &StructuresArgs) -> CliResult {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let (device, _) = vulkan(common, cvars, "structures")?;
    let backend = StructuresReport::backend(device.has_ray_query());
    let mut report = StructuresReport {
        device: device.info().name.clone(),
        driver: device.info().driver.clone(),
        maps: Vec::new(),
    };
    for map in &args.maps {
        let scene = common.scene(map)?;
        let gpu = SceneGpu::new(&device, &scene, backend, BvhQuality::Balanced).map_err(CliError::failed)?;
        report.maps.push(measure(&scene, &gpu).map_err(CliError::failed)?);
        // What is measured is kept, also where a later map fails.
        keep(args.json.as_deref(), &report)?;
    }
    stdout::line(&report).map_err(CliError::failed)
}
