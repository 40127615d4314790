//! `q3rays bench denoiser`, `bench motion` and `bench culling`: what frames look like as they are shown.

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::super::view::{at_spawn, parse_size};
use super::{FOV, keep, vulkan};
use crate::bench::bandwidth::copy_bandwidth;
use crate::bench::denoiser_report::{CullingTable, DenoiserReport, MotionTable};
use crate::bench::stage::Stage;
use crate::bench::{culling, denoiser, motion};
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::output::{atomic, exr_file, stdout};
use crate::render::scene_gpu::SceneGpu;
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;
use std::sync::Arc;

/// Maps of suns, of few and of many lamps.
const DENOISER_MAPS: [&str; 8] = [
    "oa_dm1",
    "am_galmevish2",
    "oa_minia",
    "ctf_compromise",
    "kaos",
    "oa_dm4",
    "wrackdm17",
    "slimefac",
];

/// What these benchmarks have in common.
#[derive(clap::Args)]
pub(super) struct PictureArgs {
    /// Map names
    #[arg(default_values = DENOISER_MAPS)]
    maps: Vec<String>,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples of each of the two references; `denoiser` takes up to 16 times as many where these are noisier than a tenth of what it
    /// measures
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    references: u32,
    /// Spawn points per map that the denoiser is measured at
    #[arg(long, value_name = "N", default_value_t = 3)]
    spawns: usize,
    /// Also write everything measured as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(super) struct DenoiserArgs {
    #[command(flatten)]
    common: PictureArgs,
    /// Also write the images that are measured into this folder, as MAP_SPAWN_NAME.exr
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
}

/// Loads the maps one by one and hands each to `measure` on a stage of its own. `name` is the benchmark's.
fn each_map(
    common: &Common,
    cvars: &Cvars,
    args: &PictureArgs,
    name: &str,
    mut measure: impl FnMut(&str, &Scene, &mut Stage) -> CliResult,
) -> Result<(String, String), CliError> {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let (device, backend) = vulkan(common, cvars, name)?;
    for map in &args.maps {
        let (scene, _) = common.lit_scene(map, cvars)?;
        let gpu = SceneGpu::new(&device, &scene, backend, BvhQuality::Balanced).map_err(CliError::failed)?;
        let mut stage =
            Stage::new(Arc::new(gpu), &settings(cvars), args.size, args.references).map_err(CliError::failed)?;
        measure(map, &scene, &mut stage)?;
    }
    Ok((device.info().name.clone(), device.info().driver.clone()))
}

/// Measures still and moving views.
pub(super) fn denoiser(common: &Common, cvars: &Cvars, asked: &DenoiserArgs) -> CliResult {
    let args = &asked.common;
    if let Some(folder) = &asked.pictures {
        // Before hours of measuring.
        atomic::create_parent(&folder.join("x.exr")).map_err(CliError::failed)?;
    }
    let mut views = Vec::new();
    let (device, driver) = each_map(common, cvars, args, "denoiser", |map, scene, stage| {
        for spawn in 0..args.spawns.min(scene.spawns.len()) {
            let view = at_spawn(scene, Some(spawn), FOV)?;
            let (report, looked) = denoiser::run(stage, map, spawn, &view).map_err(CliError::failed)?;
            views.push(report);
            // What is measured is kept, also where a later view fails.
            keep(args.json.as_deref(), &views)?;
            if let Some(folder) = &asked.pictures {
                for (name, pixels) in looked {
                    let file = folder.join(format!("{map}_{spawn}_{name}.exr"));
                    let (width, height) = args.size;
                    exr_file::write(&file, width, height, exr_file::rgb(&pixels), &[]).map_err(CliError::failed)?;
                }
            }
        }
        Ok(())
    })?;
    let (measured, _) = vulkan(common, cvars, "denoiser")?;
    let report = DenoiserReport {
        device,
        driver,
        size: args.size.into(),
        copy_bandwidth: copy_bandwidth(&measured).map_err(CliError::failed)?,
        views,
    };
    keep(args.json.as_deref(), &report)?;
    stdout::line(&report).map_err(CliError::failed)
}

/// Measures walks.
pub(super) fn motion(common: &Common, cvars: &Cvars, args: &PictureArgs) -> CliResult {
    let mut maps = Vec::new();
    let (device, driver) = each_map(common, cvars, args, "motion", |map, scene, stage| {
        let bar = progress(1000, map);
        let path = motion::walk(scene, FOV);
        let advance = |share: f32| bar.set_position((share * 1000.0) as u64);
        maps.push(motion::run(stage, map, &path, &advance).map_err(CliError::failed)?);
        bar.finish_and_clear();
        keep(args.json.as_deref(), &maps)
    })?;
    let report = MotionTable {
        device,
        driver,
        size: args.size.into(),
        maps,
    };
    keep(args.json.as_deref(), &report)?;
    stdout::line(&report).map_err(CliError::failed)
}

/// Measures what culling does.
pub(super) fn culling(common: &Common, cvars: &Cvars, args: &PictureArgs) -> CliResult {
    let mut maps = Vec::new();
    let (device, driver) = each_map(common, cvars, args, "culling", |map, scene, stage| {
        let view = at_spawn(scene, None, FOV)?;
        let lights = scene.lights.lights.len();
        maps.push(culling::run(stage, map, lights, &view).map_err(CliError::failed)?);
        keep(args.json.as_deref(), &maps)
    })?;
    let report = CullingTable {
        device,
        driver,
        size: args.size.into(),
        maps,
    };
    keep(args.json.as_deref(), &report)?;
    stdout::line(&report).map_err(CliError::failed)
}
