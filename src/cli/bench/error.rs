//! `q3rays bench error`

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::super::view::{at_spawn, parse_size};
use super::frames::usual_maps;
use super::results::{earlier, write};
use super::{FOV, vulkan_engine};
use crate::bench::error::{ErrorBench, Keeper, Options, ViewErrors, WANTED};
use crate::bench::error_report::{ErrorReport, KIND};
use crate::bench::run_info::RunInfo;
use crate::bench::tour::Tour;
use crate::bench::truth::{Truth, content_hash};
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::engine::Prepared;
use crate::output::checksum::fnv1a;
use crate::output::{atomic, png_file, stdout};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(super) struct ErrorArgs {
    /// Map names; without any the shipped one and those of the published figures that are found
    maps: Vec<String>,
    /// Size of the images
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = parse_size)]
    size: (u32, u32),
    /// Spawn points per map
    #[arg(long, value_name = "N", default_value_t = 1)]
    spawns: usize,
    /// Most samples of each of the two truths, each of four lights
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(64..=10_000_000))]
    truth: u32,
    /// Images per choice of settings
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..=1000))]
    images: u32,
    /// Longest frame that is of interest, milliseconds
    #[arg(long, value_name = "MS", default_value_t = 1000.0)]
    longest: f64,
    /// Places along the tour at which a moving camera's frames are looked at; 0: none
    #[arg(long, value_name = "N", default_value_t = 8)]
    stops: usize,
    /// Folder for report.html, data.json, errors.csv, pictures and truths
    #[arg(long, value_name = "DIR", default_value = "q3rays-out/error")]
    out: PathBuf,
    /// Measure again what an interrupted or earlier run of the same kind has left in the folder; truths are kept
    #[arg(long)]
    fresh: bool,
}

/// Where a view's results go.
struct Files<'a> {
    args: &'a ErrorArgs,
    bar: &'a ProgressBar,
    map: &'a str,
    /// Of the view on the bar.
    start: u64,
    truth: &'a Path,
}

impl Keeper for Files<'_> {
    fn truth(&self, truth: &Truth) {
        let kept = atomic::create_parent(self.truth).and_then(|()| truth.write(self.truth, self.args.size));
        if let Err(e) = kept {
            self.bar.println(format!("warning: the truth is not kept: {e}"));
        }
    }

    fn picture(&self, stem: &str, pixels: &[[u8; 3]]) -> Option<String> {
        let name = format!("pictures/{stem}.png");
        let path = self.args.out.join(&name);
        let (width, height) = self.args.size;
        let written = atomic::create_parent(&path).and_then(|()| png_file::write(&path, width, height, pixels, &[]));
        written
            .map_err(|e| self.bar.println(format!("warning: {e}")))
            .ok()
            .map(|()| name)
    }

    fn news(&self, what: &str, share: f32) {
        self.bar.set_message(format!("{}: {what}", self.map));
        self.bar.set_position(self.start + (share * 1000.0) as u64);
    }
}

/// Frames of the tour for the moving camera.
const TOUR: usize = 300;

/// Measures the maps.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &ErrorArgs) -> CliResult {
    let maps = usual_maps(common, &args.maps)?;
    let engine = vulkan_engine(common, cvars, "error")?;
    let mut report = ErrorReport {
        kind: KIND.to_owned(),
        run: RunInfo::new(&engine, cvars),
        views: Vec::new(),
    };
    let kept: Option<ErrorReport> = if args.fresh {
        None
    } else {
        earlier(&args.out.join("data.json"), KIND)?
    };
    let options = Options {
        size: args.size,
        most: args.truth,
        images: args.images,
        longest: args.longest,
        stops: args.stops,
    };
    let bar = progress((maps.len() * args.spawns.max(1) * 1000) as u64, "bench error");
    for (number, map) in maps.iter().enumerate() {
        let (scene, _) = common.lit_scene(map, cvars)?;
        let Prepared::Gpu(gpu) = engine.prepare(&scene).map_err(CliError::failed)? else {
            return Err(CliError::Failed("times are those of Vulkan devices".to_owned()));
        };
        let way = Tour::new(&scene, FOV).cameras(TOUR);
        let mut bench = ErrorBench::new(&gpu, &settings(cvars), options).map_err(CliError::failed)?;
        for spawn in 0..args.spawns.max(1).min(scene.spawns.len().max(1)) {
            let start = ((number * args.spawns.max(1) + spawn) * 1000) as u64;
            bar.set_position(start);
            let view = at_spawn(&scene, (!scene.spawns.is_empty()).then_some(spawn), FOV)?;
            let hash = content_hash(&scene, &view, args.size, bench.base());
            let text = format!("{hash} {options:?} {} {}", report.run.device, report.run.build);
            let key = format!("{:016x}", fnv1a(&[text.as_bytes()]));
            if let Some(done) = kept.iter().flat_map(|k| &k.views).find(|v| v.key == key) {
                report.views.push(done.clone());
                continue;
            }
            let truth_file = args.out.join("truths").join(format!("{map}-{spawn}-{hash:016x}.exr"));
            let blank = ViewErrors {
                key,
                map: map.clone(),
                spawn,
                lights: scene.lights.lights.len(),
                size: args.size.into(),
                ..ViewErrors::default()
            };
            let keeper = Files {
                args,
                bar: &bar,
                map,
                start,
                truth: &truth_file,
            };
            let known = Truth::read(&truth_file, args.size);
            let measured = bench.run(blank, &view, &way, known, &keeper);
            report.views.push(measured.map_err(CliError::failed)?);
            // What is measured is kept, also where a later view fails or somebody interrupts.
            save(&report, args)?;
        }
    }
    bar.finish_and_clear();
    save(&report, args)?;
    for v in &report.views {
        let line = format!(
            "{}, spawn {}: {} choices of settings, truths of {} samples, figures known to {:.0}% or better but for {}",
            v.map,
            v.spawn,
            v.rows.len(),
            v.samples,
            100.0 * WANTED,
            v.unsure
        );
        stdout::line(line).map_err(CliError::failed)?;
    }
    stdout::line(args.out.join("report.html").display()).map_err(CliError::failed)
}

fn save(report: &ErrorReport, args: &ErrorArgs) -> CliResult {
    let json = serde_json::to_string_pretty(report).map_err(CliError::failed)?;
    write(&args.out.join("data.json"), &json)?;
    write(&args.out.join("errors.csv"), &report.csv())?;
    write(
        &args.out.join("report.html"),
        &report.html(&args.out).map_err(CliError::failed)?,
    )
}
