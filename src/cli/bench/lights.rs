//! `q3rays bench lights`

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::super::view::{at_spawn, parse_size};
use super::{FOV, keep, vulkan};
use crate::bench::lights::{LightsBench, Options};
use crate::bench::lights_plot;
use crate::bench::lights_report::LightsReport;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::output::{atomic, stdout};
use crate::render::scene_gpu::SceneGpu;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;
use std::sync::Arc;

/// Maps from some ten lights to tens of thousands.
const LIGHT_MAPS: [&str; 10] = [
    "islanddm",
    "oa_dm4",
    "oa_dm1",
    "kaos",
    "am_galmevish2",
    "oa_minia",
    "ctf_compromise",
    "slimefac",
    "oacmpctf3",
    "oacmpdm1",
];

#[derive(clap::Args)]
pub(super) struct LightsArgs {
    /// Map names
    #[arg(default_values = LIGHT_MAPS)]
    maps: Vec<String>,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples of each of the two references
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    references: u32,
    /// Longest time for lighting a frame that is of interest, milliseconds
    #[arg(long, value_name = "MS", default_value_t = 16.0)]
    longest: f64,
    /// Also write everything measured as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Also draw error against time as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

/// Measures the maps.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &LightsArgs) -> CliResult {
    for path in [&args.json, &args.plot].into_iter().flatten() {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let (device, backend) = vulkan(common, cvars, "lights")?;
    let options = Options {
        size: args.size,
        references: args.references,
        longest: args.longest,
    };
    let mut report = LightsReport {
        device: device.info().name.clone(),
        driver: device.info().driver.clone(),
        size: args.size.into(),
        maps: Vec::new(),
    };
    for map in &args.maps {
        let (scene, _) = common.lit_scene(map, cvars)?;
        let view = at_spawn(&scene, None, FOV)?;
        let gpu = SceneGpu::new(&device, &scene, backend, BvhQuality::Balanced).map_err(CliError::failed)?;
        let bench = LightsBench::new(Arc::new(gpu), view, &settings(cvars), options).map_err(CliError::failed)?;
        let bar = progress(0, map);
        let measured = bench
            .run(map, scene.lights.lights.len(), &|step| {
                bar.set_message(format!("{map}: {step}"))
            })
            .map_err(CliError::failed)?;
        bar.finish_and_clear();
        report.maps.push(measured);
        // What is measured is kept, also where a later map fails.
        keep(args.json.as_deref(), &report)?;
    }
    if let Some(path) = &args.plot {
        let text = lights_plot::svg(&report).map_err(CliError::failed)?;
        atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
    }
    stdout::line(&report).map_err(CliError::failed)
}
