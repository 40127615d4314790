//! `q3rays render`

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use super::view::{ViewArgs, parse_camera, parse_size};
use crate::app::headless::{Loop, Run, run_frames, run_stats};
use crate::console::Cvars;
use crate::console::settings::{FRAME_RATE, settings};
use crate::engine::Job;
use crate::output::stats::FrameStats;
use crate::output::{OutputError, atomic, exr_file};
use crate::reference::direct::RayCounts;
use crate::render::film::{Aovs, Film};
use crate::render::settings::Settings;
use crate::scene::camera::Shot;
use crate::scene::clock::Clock;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `render`.
#[derive(clap::Args)]
pub struct Args {
    /// Map name
    pub map: String,
    #[command(flatten)]
    view: ViewArgs,
    /// Where the camera is when the shutter closes, for rt_motionblur
    #[arg(long, value_name = "X,Y,Z,PITCH,YAW[,ROLL]", allow_hyphen_values = true)]
    camera_to: Option<String>,
    /// Horizontal field of view, degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    fov: Option<String>,
    /// Image size
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Average N independent samples per pixel (default 32)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Number of the first sample, for runs that are merged later
    #[arg(long, value_name = "K", default_value_t = 0)]
    first_sample: u32,
    /// Run the real-time loop for N frames and write the last
    #[arg(long, value_name = "N", conflicts_with = "spp", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Scene clock of the first frame, seconds
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    time: Option<f64>,
    /// Frames per second of the scene clock; without it the clock stands still
    #[arg(long, value_name = "F", value_parser = parse_rate)]
    pub fps: Option<f64>,
    /// Write times per frame: .json or .csv
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Image to write: .png or .exr
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Folder for the intermediate images as EXR
    #[arg(long, value_name = "DIR")]
    aov: Option<PathBuf>,
    /// Render a recording: each of its frames, or fixed steps of time with --fps; --out F.png or F.exr numbers the frames, F.mp4 and the
    /// like need ffmpeg
    #[arg(long, value_name = "FILE", conflicts_with_all = ["camera", "camera_to", "spawn", "frames", "time", "aov", "first_sample"])]
    path: Option<PathBuf>,
}

/// Parses a frame rate.
fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate.is_finite() && rate > 0.0 => Ok(rate),
        _ => Err("expected frames per second above 0, such as 60".to_owned()),
    }
}

fn write_aovs(folder: &Path, film: &Film, aovs: &Aovs) -> Result<(), OutputError> {
    std::fs::create_dir_all(folder).map_err(|source| OutputError::Write {
        path: folder.to_owned(),
        source,
    })?;
    let one = |name: &str, values: &[f32]| vec![(name.to_owned(), values.to_vec())];
    let dark = vec![[0.0; 3]; film.mean.len()];
    for (name, planes) in [
        ("albedo", exr_file::rgb(&aovs.albedo)),
        ("normal", exr_file::xyz(&aovs.normal)),
        ("geo_normal", exr_file::xyz(&aovs.geo_normal)),
        ("depth", one("Z", &aovs.depth)),
        ("position", exr_file::xyz(&aovs.position)),
        ("motion", exr_file::xy(&aovs.motion)),
        ("cluster", one("Y", &aovs.cluster)),
        ("material", one("Y", &aovs.material)),
        ("direct", exr_file::rgb(&film.direct)),
        ("indirect", exr_file::rgb(&dark)),
        ("emission", exr_file::rgb(&film.emission)),
        ("transparent", exr_file::rgb(&film.transparent)),
    ] {
        exr_file::write(
            &folder.join(format!("{name}.exr")),
            film.width,
            film.height,
            planes,
            &[],
        )?;
    }
    Ok(())
}

/// An accumulation counts as one frame.
fn accumulation_stats(start: Instant, rays: RayCounts) -> FrameStats {
    FrameStats {
        index: 0,
        cpu_ms: start.elapsed().as_secs_f64() * 1e3,
        gpu_ms: None,
        passes: serde_json::Map::new(),
        rays,
        history: None,
    }
}

/// Renders one view.
pub fn run(common: &Common, mut cvars: Cvars, args: Args) -> CliResult {
    if let Some(fov) = &args.fov {
        let note = cvars.set("cg_fov", fov).map_err(|e| CliError::Usage(e.to_string()))?;
        note.into_iter().for_each(|n| eprintln!("{n}"));
    }
    let ends_in = |wanted: &str| args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    let is_frame = args.frames.is_some() || args.path.is_some();
    if cvars.number("rt_view") != 0.0 && (!is_frame || ends_in("exr")) {
        return Err(CliError::Usage(
            "rt_view shows what a frame is made of, as a picture: --frames N (or --path F.json) and --out F.png (--aov writes such images as EXR)"
                .to_owned(),
        ));
    }
    // An output that cannot be written is told before the work is done, not after it.
    if let Some(path) = args.path.clone() {
        atomic::create_parent(&args.out).map_err(CliError::failed)?;
        return super::path::run(common, &cvars, &args, &path);
    }
    if !ends_in("png") && !ends_in("exr") {
        return Err(CliError::Usage(OutputError::Extension { path: args.out }.to_string()));
    }
    atomic::create_parent(&args.out).map_err(CliError::failed)?;
    let (scene, _) = common.lit_scene(&args.map, &cvars)?;
    let settings = Settings {
        clock: Clock::from_seconds(args.time.unwrap_or(0.0)),
        shutter: settings(&cvars).shutter * args.fps.map_or(1.0, |fps| FRAME_RATE / fps as f32),
        ..settings(&cvars)
    };
    let camera = args.view.camera(&scene, cvars.number("cg_fov") as f32)?;
    let shot = Shot {
        open: camera,
        close: match &args.camera_to {
            Some(to) => parse_camera(to, camera.fov)?,
            None => camera,
        },
    };
    if shot.close != shot.open && settings.shutter == 0.0 {
        eprintln!("warning: --camera-to moves the camera only where rt_motionblur keeps the shutter open");
    }
    let spp = args.spp.unwrap_or(32);
    let range = args.first_sample..args.first_sample.saturating_add(spp);
    let engine = common.engine(&cvars)?;
    let prepared = engine.prepare(&scene).map_err(CliError::failed)?;
    let bar = progress(1000, &args.map);
    let advance = |share: f32| bar.set_position((share * 1000.0) as u64);
    let run = if let Some(count) = args.frames {
        let note = |text: &str| eprintln!("{text}");
        let job = Loop {
            size: args.size,
            settings: &settings,
            count,
            path: &|_| camera,
            accumulate: cvars.number("rt_accumulate") != 0.0,
            frame_time: args.fps.map_or(0.0, |fps| 1.0 / fps),
        };
        run_frames(&prepared, &job, &advance, &note)?
    } else {
        let job = Job {
            camera: shot,
            size: args.size,
            settings: &settings,
            range,
        };
        let start = Instant::now();
        let (film, rays) = prepared.accumulate(job, &advance).map_err(CliError::failed)?;
        Run {
            film,
            display: None,
            frames: vec![accumulation_stats(start, rays)],
        }
    };
    bar.finish_and_clear();
    let non_finite = run.film.non_finite();
    if non_finite > 0 {
        eprintln!("warning: {non_finite} pixels are not finite");
    }
    run.write(&args.out, &settings).map_err(CliError::failed)?;
    if let Some(path) = &args.stats {
        let stats = run_stats(&engine, &cvars, &args.map, args.size, run.frames);
        stats.write(path).map_err(CliError::failed)?;
    }
    if let Some(folder) = &args.aov {
        let aovs = prepared.aovs(&camera, args.size, &settings).map_err(CliError::failed)?;
        write_aovs(folder, &run.film, &aovs).map_err(CliError::failed)?;
    }
    Ok(())
}
