//! Frame times along a way through a map, run after run.

use super::statistics::{Repeated, median};
use crate::game::recording::{RecordedView, Recording};
use crate::gpu::SubmitSync;
use crate::output::stats::{FrameStats, Summary};
use crate::render::frame::FrameInput;
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::Settings;
use crate::scene::camera::Camera;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Frames a second of the scene's clock.
pub const RATE: f64 = 60.0;
/// A frame that takes this many times the median is a stutter.
const STUTTER: f64 = 2.0;
/// Share of the automatic exposure that a frame renews.
const EXPOSURE_BLEND: f32 = 0.1;

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub size: (u32, u32),
    /// Frames before those that count.
    pub warmup: usize,
    pub runs: usize,
}

/// Where frames are seen from.
pub struct Way {
    pub name: String,
    pub views: Vec<RecordedView>,
}

impl Way {
    /// Cameras at the scene's own pace.
    pub fn of_cameras(name: &str, cameras: &[Camera], start: crate::scene::clock::Clock) -> Self {
        let views = cameras.iter().enumerate().map(|(i, camera)| RecordedView {
            camera: *camera,
            clock: start.after(i as f64 / RATE),
            entities: Vec::new(),
        });
        Self {
            name: name.to_owned(),
            views: views.collect(),
        }
    }

    /// So many frames of a recording, again from its start where it is shorter.
    pub fn of_recording(name: &str, recording: &Recording, frames: usize) -> Self {
        let length = recording.length() + 1.0 / RATE;
        let views = (0..frames).filter_map(|i| recording.at((i as f64 / RATE).rem_euclid(length)));
        Self {
            name: name.to_owned(),
            views: views.collect(),
        }
    }
}

/// One frame.
#[derive(Clone, Debug)]
pub struct FrameTime {
    pub stats: FrameStats,
    /// From the frame before to this one, milliseconds.
    pub wall_ms: f64,
}

/// One run along the way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunReport {
    /// GPU milliseconds a frame, CPU where the device tells no times.
    pub summary: Summary,
    /// Frames over twice the median.
    pub stutters: usize,
    pub cpu_p50: f64,
    /// Median time from frame to frame.
    pub wall_p50: f64,
    /// Medians of the passes.
    pub passes: BTreeMap<String, f64>,
}

/// A pass over all frames of all runs.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PassTime {
    pub p50: f64,
    pub p95: f64,
    /// Of the runs' medians.
    pub runs: Repeated,
}

/// Means over all frames.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Rays {
    pub primary: f64,
    pub shadow: f64,
    /// Light samples that ended before a ray was traced.
    pub shadow_skipped: f64,
}

/// A map's measurements.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct MapFrames {
    /// What the figures depend on: those of another run with the same are taken over.
    pub key: String,
    pub map: String,
    pub triangles: usize,
    pub lights: usize,
    pub size: [u32; 2],
    pub way: String,
    pub frames: usize,
    /// All frames of all runs.
    pub summary: Summary,
    pub stutters: usize,
    /// Of the runs' medians.
    pub medians: Repeated,
    pub runs: Vec<RunReport>,
    pub passes: BTreeMap<String, PassTime>,
    pub rays: Rays,
    /// GPU memory in use.
    pub memory: u64,
    /// GPU milliseconds of the first run's frames, for the graph.
    pub graph: Vec<f64>,
}

fn passes_of<'a>(frames: impl Iterator<Item = &'a FrameTime>) -> BTreeMap<String, Vec<f64>> {
    let mut out: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for frame in frames {
        for (name, ms) in &frame.stats.passes {
            out.entry(name.clone()).or_default().extend(ms.as_f64());
        }
    }
    out
}

impl RunReport {
    fn of(frames: &[FrameTime]) -> Self {
        let times: Vec<f64> = frames.iter().map(|f| f.stats.ms()).collect();
        let summary = Summary::of(times.clone());
        let cpu: Vec<f64> = frames.iter().map(|f| f.stats.cpu_ms).collect();
        let wall: Vec<f64> = frames.iter().map(|f| f.wall_ms).collect();
        Self {
            stutters: stutters(&times, summary.p50),
            summary,
            cpu_p50: median(&cpu).unwrap_or(0.0),
            wall_p50: median(&wall).unwrap_or(0.0),
            passes: passes_of(frames.iter())
                .into_iter()
                .filter_map(|(name, values)| Some((name, median(&values)?)))
                .collect(),
        }
    }
}

fn stutters(times: &[f64], middle: f64) -> usize {
    times.iter().filter(|t| **t > STUTTER * middle).count()
}

/// Goes a way once; the frames that count.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn go(
    realtime: &mut Realtime,
    settings: &Settings,
    way: &Way,
    warmup: usize,
    done: &dyn Fn(),
) -> Result<Vec<FrameTime>, RenderError> {
    let Some(first) = way.views.first() else {
        return Ok(Vec::new());
    };
    let mut out = Vec::new();
    let (mut walls, mut last) = (Vec::new(), Instant::now());
    for index in 0..warmup + way.views.len() {
        let view = index.checked_sub(warmup).map_or(first, |i| &way.views[i]);
        let input = FrameInput {
            camera: view.camera,
            settings: Settings {
                clock: view.clock,
                ..*settings
            },
            lights: &[],
            polygons: &[],
            entities: &view.entities,
            sample_index: index as u32,
            accumulated: 0,
            exposure_blend: if index == 0 { 1.0 } else { EXPOSURE_BLEND },
            reuse: true,
            output: true,
        };
        out.extend(realtime.frame(&input, |shown| shown.frame.submit(SubmitSync::default()))?);
        walls.push(last.elapsed().as_secs_f64() * 1e3);
        last = Instant::now();
        done();
    }
    out.extend(realtime.finish()?);
    // Statistics come in the order of the frames, one each.
    let frames = out.into_iter().zip(walls).skip(warmup);
    Ok(frames.map(|(stats, wall_ms)| FrameTime { stats, wall_ms }).collect())
}

/// Measures a map; also returns all frames of all runs. `done` is called after each frame.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn run(
    scene: &Arc<SceneGpu>,
    settings: &Settings,
    way: &Way,
    options: Options,
    mut report: MapFrames,
    done: &dyn Fn(),
) -> Result<(MapFrames, Vec<Vec<FrameTime>>), RenderError> {
    let mut realtime = Realtime::new(scene.clone(), options.size, None)?;
    let mut all = Vec::new();
    for _ in 0..options.runs {
        all.push(go(&mut realtime, settings, way, options.warmup, done)?);
    }
    report.memory = scene.device.memory_allocated();
    report.runs = all.iter().map(|frames| RunReport::of(frames)).collect();
    let flat = || all.iter().flatten();
    let times: Vec<f64> = flat().map(|f| f.stats.ms()).collect();
    report.summary = Summary::of(times.clone());
    report.stutters = stutters(&times, report.summary.p50);
    let of_runs = |f: &dyn Fn(&RunReport) -> f64| Repeated::of(&report.runs.iter().map(f).collect::<Vec<_>>());
    report.medians = of_runs(&|r| r.summary.p50);
    report.passes = passes_of(flat())
        .into_iter()
        .map(|(name, values)| {
            let summary = Summary::of(values);
            let runs = of_runs(&|r| r.passes.get(&name).copied().unwrap_or(0.0));
            let time = PassTime {
                p50: summary.p50,
                p95: summary.p95,
                runs,
            };
            (name, time)
        })
        .collect();
    let mean =
        |f: &dyn Fn(&FrameStats) -> u64| flat().map(|t| f(&t.stats) as f64).sum::<f64>() / times.len().max(1) as f64;
    report.rays = Rays {
        primary: mean(&|s| s.rays.primary),
        shadow: mean(&|s| s.rays.shadow),
        shadow_skipped: mean(&|s| s.rays.shadow_skipped),
    };
    report.graph = all.first().into_iter().flatten().map(|f| f.stats.ms()).collect();
    Ok((report, all))
}
