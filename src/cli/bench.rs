//! `q3rays bench`

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use super::render::{camera, parse_size};
use crate::bench::denoiser::{DenoiserBench, Options as DenoiserOptions};
use crate::bench::denoiser_report::DenoiserReport;
use crate::bench::lights::{LightsBench, Options as LightsOptions};
use crate::bench::lights_plot;
use crate::bench::lights_report::LightsReport;
use crate::bench::ray_report::{MOST_DISAGREEMENT, RaysReport};
use crate::bench::rays::{EYE_JITTER, RaysBench, RaysOptions};
use crate::bench::structures::{StructuresReport, measure};
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::engine::Engine;
use crate::output::{atomic, stdout};
use crate::render::backend::Backend;
use crate::render::scene_gpu::SceneGpu;
use crate::scene::bvh::BvhQuality;
use std::path::PathBuf;
use std::sync::Arc;

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
    /// Error against time of the ways to choose a light
    Lights(LightsArgs),
    /// What acceleration structures cost to build, refit and upload
    Structures(StructuresArgs),
    /// What the denoiser makes of one light sample per pixel, and its times
    Denoiser(DenoiserArgs),
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

#[derive(clap::Args)]
struct StructuresArgs {
    /// Map names
    #[arg(default_values = DEFAULT_MAPS)]
    maps: Vec<String>,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

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
struct LightsArgs {
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

#[derive(clap::Args)]
struct DenoiserArgs {
    /// Map names
    #[arg(default_values = DENOISER_MAPS)]
    maps: Vec<String>,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples of each of the two references
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    references: u32,
    /// Spawn points per map
    #[arg(long, value_name = "N", default_value_t = 3)]
    spawns: usize,
    /// Also write everything measured as JSON
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
        What::Lights(args) => lights(common, cvars, args),
        What::Structures(args) => structures(common, cvars, args),
        What::Denoiser(args) => denoiser(common, cvars, args),
    }
}

fn denoiser(common: &Common, cvars: &Cvars, args: &DenoiserArgs) -> CliResult {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let Engine::Vulkan { device, backend } = common.engine(cvars)? else {
        return Err(CliError::Failed(
            "bench denoiser measures Vulkan devices; there is none".to_owned(),
        ));
    };
    let options = DenoiserOptions {
        size: args.size,
        references: args.references,
    };
    let mut report = DenoiserReport {
        device: device.info().name.clone(),
        driver: device.info().driver.clone(),
        size: args.size.into(),
        views: Vec::new(),
    };
    for map in &args.maps {
        let (scene, _) = common.lit_scene(map, cvars)?;
        let gpu = SceneGpu::new(&device, &scene, backend, BvhQuality::Balanced).map_err(CliError::failed)?;
        let mut bench = DenoiserBench::new(Arc::new(gpu), &settings(cvars), options).map_err(CliError::failed)?;
        for spawn in 0..args.spawns.min(scene.spawns.len()) {
            let view = camera(&scene, None, Some(spawn), FOV)?;
            report
                .views
                .push(bench.run(map, spawn, &view).map_err(CliError::failed)?);
            // What is measured is kept, also where a later view fails.
            if let Some(path) = &args.json {
                let text = serde_json::to_string_pretty(&report).map_err(CliError::failed)?;
                atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
            }
        }
    }
    stdout::line(&report).map_err(CliError::failed)
}

fn lights(common: &Common, cvars: &Cvars, args: &LightsArgs) -> CliResult {
    for path in [&args.json, &args.plot].into_iter().flatten() {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let Engine::Vulkan { device, backend } = common.engine(cvars)? else {
        return Err(CliError::Failed(
            "bench lights measures Vulkan devices; there is none".to_owned(),
        ));
    };
    let options = LightsOptions {
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
        let view = camera(&scene, None, None, FOV)?;
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
        if let Some(path) = &args.json {
            let text = serde_json::to_string_pretty(&report).map_err(CliError::failed)?;
            atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
        }
    }
    if let Some(path) = &args.plot {
        let text = lights_plot::svg(&report).map_err(CliError::failed)?;
        atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
    }
    stdout::line(&report).map_err(CliError::failed)
}

fn structures(common: &Common, cvars: &Cvars, args: &StructuresArgs) -> CliResult {
    if let Some(path) = &args.json {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let Engine::Vulkan { device, .. } = common.engine(cvars)? else {
        return Err(CliError::Failed(
            "bench structures measures Vulkan devices; there is none".to_owned(),
        ));
    };
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
        if let Some(path) = &args.json {
            let text = serde_json::to_string_pretty(&report).map_err(CliError::failed)?;
            atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
        }
    }
    stdout::line(&report).map_err(CliError::failed)
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
