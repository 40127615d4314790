//! A run without a window: a fly-through with statistics, for machines without a display.

use super::capture::display_pixels;
use crate::cli::CliError;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::content::fly_through;
use crate::engine::{Engine, Job, Prepared};
use crate::gpu::SubmitSync;
use crate::output::stats::{FrameStats, RunStats, Summary};
use crate::output::{OutputError, atomic, picture, png_file, stdout};
use crate::reference::direct::RayCounts;
use crate::render::film::Film;
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::{film as read_film, shown_film};
use crate::render::realtime::Realtime;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::spawns::first_view;
use std::path::Path;
use std::time::Instant;

/// Image size and number of frames.
pub const SIZE: (u32, u32) = (640, 360);
pub const FRAMES: u32 = 120;
/// Frames of the flight; in the rest the view at its end settles (denoised as in the window), which becomes the picture.
const FLIGHT: u32 = 56;

/// What a loop of frames left behind.
pub struct Run {
    /// The last frame; on the CPU the mean of all.
    pub film: Film,
    /// What the window would show of the last frame, row by row from the top, where that is one of its intermediate images (`rt_view`).
    pub display: Option<Vec<[u8; 3]>>,
    pub frames: Vec<FrameStats>,
}

impl Run {
    /// Writes what was rendered, by the extension of the name: see [`picture::write`].
    ///
    /// # Errors
    /// [`OutputError`] naming the file.
    pub fn write(&self, path: &Path, settings: &Settings) -> Result<(), OutputError> {
        match &self.display {
            Some(pixels) => png_file::write(path, self.film.width, self.film.height, pixels, &[]),
            None => picture::write(path, &self.film, settings),
        }
    }
}

/// A loop of frames.
pub struct Loop<'a> {
    pub size: (u32, u32),
    pub settings: &'a Settings,
    pub count: u32,
    /// View of each frame.
    pub path: &'a dyn Fn(u32) -> Camera,
    /// Average frames as long as the view stays the same.
    pub accumulate: bool,
    /// Seconds that the scene's clock goes on from one frame to the next.
    pub frame_time: f64,
}

/// Renders frames along a camera path. On the CPU there is no frame loop: the last view is accumulated over as many
/// samples, and `note` is told so.
///
/// # Errors
/// One sentence of the device's.
pub fn run_frames(
    prepared: &Prepared<'_>,
    job: &Loop<'_>,
    progress: &(dyn Fn(f32) + Sync),
    note: &dyn Fn(&str),
) -> Result<Run, CliError> {
    let (count, path) = (job.count, job.path);
    let scene = match prepared {
        Prepared::Cpu(_) if job.settings.view != 0 => {
            return Err(CliError::Failed(
                "rt_view shows what a frame on a Vulkan device is made of: the CPU tracer has none (--aov writes its images)".to_owned(),
            ));
        }
        Prepared::Cpu(_) => {
            note("the CPU tracer has no frame loop: accumulating as many samples of the last view instead");
            let start = Instant::now();
            let still = Job {
                camera: (&path(count.saturating_sub(1))).into(),
                size: job.size,
                settings: job.settings,
                range: 0..count,
            };
            let (film, rays) = prepared.accumulate(still, progress).map_err(CliError::failed)?;
            let cpu_ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(count.max(1));
            let share = |n: u64| n / u64::from(count.max(1));
            let frames = (0..count)
                .map(|index| FrameStats {
                    index,
                    cpu_ms,
                    gpu_ms: None,
                    passes: serde_json::Map::new(),
                    rays: RayCounts {
                        primary: share(rays.primary),
                        shadow: share(rays.shadow),
                        shadow_skipped: share(rays.shadow_skipped),
                    },
                    history: None,
                })
                .collect();
            return Ok(Run {
                film,
                display: None,
                frames,
            });
        }
        Prepared::Gpu(scene) => scene.clone(),
    };
    let mut realtime = Realtime::new(scene, job.size, None).map_err(CliError::failed)?;
    let mut frames = Vec::new();
    let mut accumulated = 0;
    for index in 0..count {
        let camera = path(index);
        let still = index > 0 && camera == path(index - 1) && job.frame_time == 0.0;
        accumulated = if job.accumulate && still { accumulated + 1 } else { 0 };
        let input = FrameInput {
            camera,
            settings: if accumulated > 0 {
                job.settings.at_sample(index)
            } else {
                Settings {
                    clock: job.settings.clock.after(f64::from(index) * job.frame_time),
                    ..*job.settings
                }
            },
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated,
            exposure_blend: 1.0,
            reuse: accumulated == 0,
            output: true,
        };
        let ended = realtime
            .frame(&input, |shown| shown.frame.submit(SubmitSync::default()))
            .map_err(CliError::failed)?;
        frames.extend(ended);
        progress((index + 1) as f32 / count as f32);
    }
    frames.extend(realtime.finish().map_err(CliError::failed)?);
    let film = if accumulated > 0 {
        read_film(&realtime.view, accumulated)
    } else {
        shown_film(&realtime.view)
    }
    .map_err(CliError::failed)?;
    let display = (job.settings.view != 0).then(|| display_pixels(&realtime.view));
    Ok(Run {
        film,
        display: display.transpose().map_err(CliError::Failed)?,
        frames,
    })
}

/// Statistics of a run with what is needed to repeat it.
pub fn run_stats(engine: &Engine, cvars: &Cvars, map: &str, size: (u32, u32), frames: Vec<FrameStats>) -> RunStats {
    let mut stats = RunStats {
        device: String::new(),
        backend: String::new(),
        driver: String::new(),
        map: map.to_owned(),
        size: [size.0, size.1],
        settings: cvars.all(),
        summary: Summary::of_frames(&frames),
        frames,
    };
    engine.label(&mut stats);
    stats
}

/// The main job where there is no display: 120 frames through the map, written to `folder`. Where a CPU does the tracing, light
/// samples are not reused: that would take a third longer.
///
/// # Errors
/// One sentence of the device's or the file system's.
pub fn run(
    engine: &Engine,
    scene: &Scene,
    cvars: &Cvars,
    folder: &Path,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(), CliError> {
    let settings = Settings {
        light_reuse: cvars.number("rt_lightReuse") != 0.0 && !engine.on_cpu(),
        ..settings(cvars)
    };
    let fov = cvars.number("cg_fov") as f32;
    let prepared = engine.prepare(scene).map_err(CliError::failed)?;
    let path = |index: u32| {
        if scene.name == fly_through::MAP {
            return fly_through::camera(index as f32 / FLIGHT as f32, fov);
        }
        // Other maps: a turn on the spot at the first spawn point.
        let mut camera = first_view(&scene.spawns, &scene.bsp, fov);
        camera.yaw += 360.0 * index.min(FLIGHT) as f32 / FLIGHT as f32;
        camera
    };
    let job = Loop {
        size: SIZE,
        settings: &settings,
        count: FRAMES,
        path: &path,
        accumulate: cvars.number("rt_accumulate") != 0.0,
        frame_time: 0.0,
    };
    let run = run_frames(&prepared, &job, progress, &|text| eprintln!("{text}"))?;
    let picture = folder.join("frame.png");
    atomic::create_parent(&picture).map_err(CliError::failed)?;
    run.write(&picture, &settings).map_err(CliError::failed)?;
    let stats = run_stats(engine, cvars, &scene.name, SIZE, run.frames);
    let (json, csv) = (folder.join("stats.json"), folder.join("stats.csv"));
    stats.write(&json).map_err(CliError::failed)?;
    stats.write(&csv).map_err(CliError::failed)?;
    let said = format!(
        "{} frames of {}x{}: median {:.2} ms, 95% {:.2} ms",
        FRAMES, SIZE.0, SIZE.1, stats.summary.p50, stats.summary.p95
    );
    stdout::line(said).map_err(CliError::failed)?;
    for path in [picture, json, csv] {
        stdout::line(path.display()).map_err(CliError::failed)?;
    }
    Ok(())
}
