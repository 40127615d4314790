//! `q3rays bench`

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use super::render::{camera, parse_size};
use crate::bench::ray_report::{MOST_DISAGREEMENT, RaysReport};
use crate::bench::rays::{EYE_JITTER, RaysBench, RaysOptions};
use crate::console::Cvars;
use crate::engine::Engine;
use crate::output::{atomic, stdout};
use crate::render::backend::Backend;
use crate::render::scene_gpu::SceneGpu;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;

/// Arguments of `bench`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Rays per second of the traversal alone
    Rays(RaysArgs),
}

/// Maps of the published figures, from small to large.
const DEFAULT_MAPS: [&str; 5] = ["oa_dm1", "am_galmevish2", "ctf_compromise", "oa_minia", "oacmpctf3"];

#[derive(clap::Args)]
struct RaysArgs {
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

/// Runs a benchmark.
pub fn run(common: &Common, cvars: &Cvars, args: &Args) -> CliResult {
    match &args.what {
        What::Rays(args) => rays(common, cvars, args),
    }
}

/// Field of view of the primary rays, degrees.
const FOV: f32 = 90.0;

fn rays(common: &Common, cvars: &Cvars, args: &RaysArgs) -> CliResult {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let Engine::Vulkan { device, backend } = common.engine(cvars)? else {
        return Err(CliError::Failed(
            "bench rays measures Vulkan devices; there is none".to_owned(),
        ));
    };
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
        let mut view = camera(&scene, None, None, FOV)?;
        view.eye = std::array::from_fn(|i| view.eye[i] + EYE_JITTER[i]);
        let gpu = SceneGpu::new(&device, &scene, backend, quality).map_err(CliError::failed)?;
        let bench = RaysBench::new(&scene, &gpu, &view, options, seed).map_err(CliError::failed)?;
        let bar = progress(RaysBench::combinations(report.ray_query), map);
        let measured = bench.run(&scene, &|| bar.inc(1)).map_err(CliError::failed)?;
        bar.finish_and_clear();
        report.maps.push(measured);
    }
    stdout::line(&report).map_err(CliError::failed)?;
    if let Some(path) = &args.json {
        let text = serde_json::to_string_pretty(&report).map_err(CliError::failed)?;
        atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
    }
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
