//! `q3rays bench rays`

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::super::view::{at_spawn, parse_size};
use super::{DEFAULT_MAPS, FOV, keep, vulkan};
use crate::bench::ray_report::{MOST_DISAGREEMENT, RaysReport};
use crate::bench::rays::{EYE_JITTER, RaysBench, RaysOptions};
use crate::console::Cvars;
use crate::output::{atomic, stdout};
use crate::render::backend::Backend;
use crate::render::scene_gpu::SceneGpu;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(super) struct RaysArgs {
    /// Map names
    #[arg(default_values = DEFAULT_MAPS)]
    maps: Vec<String>,
    /// Number of primary rays
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = parse_size)]
    size: (u32, u32),
    /// Timed dispatches, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    dispatches: u32,
    /// Quality of the own trees
    #[arg(long, default_value = "balanced")]
    trees: Trees,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Trees {
    /// As maps are loaded for rendering
    Balanced,
    /// As fast to trace as can be
    Best,
}

/// Measures the maps.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &RaysArgs) -> CliResult {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let (device, backend) = vulkan(common, cvars, "rays")?;
    let (quality, trees) = match args.trees {
        Trees::Balanced => (BvhQuality::Balanced, "balanced"),
        Trees::Best => (BvhQuality::Best, "best"),
    };
    // On devices with both, `auto` may have chosen the own traversal; here everything is measured.
    let backend = if device.has_ray_query() {
        Backend::RayQuery
    } else {
        backend
    };
    let options = RaysOptions {
        size: args.size,
        dispatches: args.dispatches,
    };
    let seed = cvars.number("rt_seed") as u32;
    let mut report = RaysReport {
        device: device.info().name.clone(),
        driver: device.info().driver.clone(),
        size: args.size.into(),
        dispatches: args.dispatches,
        trees,
        ray_query: device.has_ray_query(),
        maps: Vec::new(),
    };
    for map in &args.maps {
        let scene = common.scene(map)?;
        let mut view = at_spawn(&scene, None, FOV)?;
        view.eye = std::array::from_fn(|i| view.eye[i] + EYE_JITTER[i]);
        let gpu = SceneGpu::new(&device, &scene, backend, quality).map_err(CliError::failed)?;
        let bench = RaysBench::new(&scene, &gpu, &view, options, seed).map_err(CliError::failed)?;
        let bar = progress(RaysBench::combinations(report.ray_query), map);
        let measured = bench.run(&scene, &|| bar.inc(1)).map_err(CliError::failed)?;
        bar.finish_and_clear();
        report.maps.push(measured);
    }
    stdout::line(&report).map_err(CliError::failed)?;
    keep(args.json.as_deref(), &report)?;
    match report
        .maps
        .iter()
        .find(|map| map.worst_disagreement() > MOST_DISAGREEMENT)
    {
        Some(map) => Err(CliError::Failed(format!(
            "map \"{}\": the trees disagree on {:.2e} of the rays, more than {MOST_DISAGREEMENT:.0e}: the figures \
             cannot be trusted",
            map.map,
            map.worst_disagreement()
        ))),
        None => Ok(()),
    }
}
