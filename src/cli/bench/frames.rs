//! `q3rays bench`: frame times.

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::super::view::{ViewArgs, parse_size};
use super::results::{earlier, write};
use super::{DEFAULT_MAPS, vulkan_engine};
use crate::bench::figures::TRUTH;
use crate::bench::frames::{MapFrames, Options, Way, run as measure};
use crate::bench::frames_report::{FramesReport, KIND, frames_csv};
use crate::bench::run_info::RunInfo;
use crate::bench::tour::Tour;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::content::fly_through;
use crate::engine::Prepared;
use crate::game::recording::Recording;
use crate::output::checksum::fnv1a;
use crate::output::stdout;
use crate::scene::Scene;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(super) struct FramesArgs {
    /// Map names; without any the shipped one and those of the published figures that are found. fig7.1 to fig7.14 or sec7.5 in front of them:
    /// that experiment of the thesis
    maps: Vec<String>,
    /// Recording to go along, in place of a tour of the spawn points
    #[arg(long, value_name = "FILE")]
    path: Option<PathBuf>,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "1920x1080", value_parser = parse_size)]
    pub(super) size: (u32, u32),
    /// Frames of a run that count
    #[arg(long, value_name = "N", default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) frames: u32,
    /// Frames before them
    #[arg(long, value_name = "N", default_value_t = 60)]
    warmup: u32,
    /// Times that each map is gone through
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    runs: u32,
    /// Folder for report.html, data.json, summary.csv and frames.csv
    #[arg(long, value_name = "DIR", default_value = "q3rays-out/bench")]
    pub(super) out: PathBuf,
    /// Measure again what an interrupted or earlier run of the same kind has left in the folder
    #[arg(long)]
    fresh: bool,
    #[command(flatten, next_help_heading = "View of fig7.N and sec7.5")]
    pub(super) view: ViewArgs,
    /// For fig7.12: the light that lights alone, by its number; without it the one that gives the view most
    #[arg(long, value_name = "N")]
    pub(super) light: Option<u32>,
    /// For fig7.N: samples whose mean is the truth
    #[arg(long, value_name = "N", default_value_t = TRUTH, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) truth: u32,
    /// For fig7.1: the original's picture of the view, as tests/original_view.sh makes it
    #[arg(long, value_name = "FILE.png")]
    pub(super) original: Option<PathBuf>,
}

impl FramesArgs {
    /// The experiment of the thesis that is asked for, and its maps.
    pub(super) fn figure(&self) -> Option<(&str, &[String])> {
        let (first, rest) = self.maps.split_first()?;
        (first.starts_with("fig") || first.starts_with("sec7")).then_some((first.as_str(), rest))
    }

    /// The maps asked for, or the usual ones that are there.
    pub(super) fn maps(&self, common: &Common) -> Result<Vec<String>, CliError> {
        usual_maps(common, &self.maps)
    }
}

/// `asked`, or the usual maps that are there.
pub(super) fn usual_maps(common: &Common, asked: &[String]) -> Result<Vec<String>, CliError> {
    if !asked.is_empty() {
        return Ok(asked.to_vec());
    }
    let there = common.files()?.maps();
    let wanted = std::iter::once(fly_through::MAP).chain(DEFAULT_MAPS);
    let (found, missing): (Vec<&str>, Vec<&str>) = wanted.partition(|name| there.iter().any(|m| m.name == *name));
    if !missing.is_empty() {
        eprintln!("not measured, because they are not installed: {}", missing.join(", "));
    }
    Ok(found.into_iter().map(str::to_owned).collect())
}

fn way(args: &FramesArgs, scene: &Scene, cvars: &Cvars) -> Result<Way, CliError> {
    let frames = args.frames as usize;
    match &args.path {
        Some(path) => {
            let recording = Recording::read(path).map_err(CliError::failed)?;
            if recording.map != scene.name {
                return Err(CliError::Failed(format!(
                    "{} was recorded on {}, not on {}",
                    path.display(),
                    recording.map,
                    scene.name
                )));
            }
            Ok(Way::of_recording(&path.display().to_string(), &recording, frames))
        }
        None => {
            let tour = Tour::new(scene, cvars.number("cg_fov") as f32);
            Ok(Way::of_cameras("tour", &tour.cameras(frames), settings(cvars).clock))
        }
    }
}

/// What a map's figures depend on.
fn key(args: &FramesArgs, info: &RunInfo, map: &str, way: &Way) -> String {
    let same = RunInfo {
        command: String::new(),
        ..info.clone()
    };
    let text = format!(
        "{same:?} {map} {:?} {} {} {:?}",
        args.size, args.warmup, args.runs, way.views
    );
    format!("{:016x}", fnv1a(&[text.as_bytes()]))
}

/// Measures the maps.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &FramesArgs) -> CliResult {
    let maps = args.maps(common)?;
    let engine = vulkan_engine(common, cvars, "")?;
    let mut report = FramesReport {
        kind: KIND.to_owned(),
        run: RunInfo::new(&engine, cvars),
        maps: Vec::new(),
    };
    let data = args.out.join("data.json");
    let kept: Option<FramesReport> = if args.fresh { None } else { earlier(&data, KIND)? };
    let frames_file = args.out.join("frames.csv");
    let mut frames_text = match &kept {
        Some(_) => std::fs::read_to_string(&frames_file).unwrap_or_default(),
        None => String::new(),
    };
    // Maps that an earlier call measured and this one does not are in none of its files.
    frames_text = frames_text
        .lines()
        .enumerate()
        .filter(|(i, l)| *i == 0 || maps.iter().any(|m| l.split(',').next() == Some(m)))
        .map(|(_, l)| format!("{l}\n"))
        .collect();
    let total = u64::from(args.runs) * u64::from(args.frames + args.warmup);
    let bar = progress(total * maps.len() as u64, "bench");
    for map in &maps {
        bar.set_message(map.clone());
        let (scene, _) = common.lit_scene(map, cvars)?;
        let way = way(args, &scene, cvars)?;
        let key = key(args, &report.run, map, &way);
        if let Some(done) = kept.iter().flat_map(|k| &k.maps).find(|m| m.key == key) {
            report.maps.push(done.clone());
            bar.inc(total);
            continue;
        }
        let Prepared::Gpu(gpu) = engine.prepare(&scene).map_err(CliError::failed)? else {
            return Err(CliError::Failed("frame times are those of Vulkan devices".to_owned()));
        };
        let blank = MapFrames {
            key,
            map: map.clone(),
            triangles: scene.geometry.triangles.len(),
            lights: scene.lights.lights.len(),
            size: args.size.into(),
            way: way.name.clone(),
            frames: way.views.len(),
            ..MapFrames::default()
        };
        let options = Options {
            size: args.size,
            warmup: args.warmup as usize,
            runs: args.runs as usize,
        };
        let (measured, all) =
            measure(&gpu, &settings(cvars), &way, options, blank, &|| bar.inc(1)).map_err(CliError::failed)?;
        // Rows of an earlier measurement of the map go.
        let start = format!("{map},");
        frames_text = frames_text
            .lines()
            .filter(|l| !l.starts_with(&start))
            .map(|l| format!("{l}\n"))
            .collect();
        frames_text.push_str(&frames_csv(map, &all, frames_text.is_empty()));
        report.maps.push(measured);
        // What is measured is kept, also where a later map fails or somebody interrupts.
        write(&frames_file, &frames_text)?;
        save(&report, args)?;
    }
    bar.finish_and_clear();
    save(&report, args)?;
    for m in &report.maps {
        let s = &m.summary;
        let line = format!(
            "{}: p50 {:.3}, p95 {:.3}, p99 {:.3}, max {:.3} ms, {} stutters in {} frames",
            m.map,
            s.p50,
            s.p95,
            s.p99,
            s.max,
            m.stutters,
            m.frames * m.runs.len()
        );
        stdout::line(line).map_err(CliError::failed)?;
    }
    stdout::line(args.out.join("report.html").display()).map_err(CliError::failed)
}

fn save(report: &FramesReport, args: &FramesArgs) -> CliResult {
    let json = serde_json::to_string_pretty(report).map_err(CliError::failed)?;
    write(&args.out.join("data.json"), &json)?;
    write(&args.out.join("summary.csv"), &report.summary_csv())?;
    write(&args.out.join("report.html"), &report.html().map_err(CliError::failed)?)
}
