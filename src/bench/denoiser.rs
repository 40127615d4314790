//! What the denoiser makes of one light sample per pixel: error against two references after some frames of a view that stands
//! still and of one that moves, beside the raw frame, and the time of its passes.

use super::references::Pixels;
use super::stage::{Figures, Stage};
use super::truth::Truth;
use crate::render::scene_gpu::RenderError;
use crate::render::settings::Settings;
use crate::scene::camera::Camera;
use serde::Serialize;
use std::collections::BTreeMap;

/// Frames after which a still view is looked at, and the moving one.
pub const STILL: [u32; 2] = [8, 64];
pub const MOVING: u32 = 64;
/// How a moving view moves in a frame: units to the right, degrees to the left.
const SIDEWAYS: f32 = 1.0;
const TURN: f32 = 0.5;
/// Samples of the raw image that the longer of the still views is held against.
pub const RAW: u32 = 128;
/// Runs with other random numbers that figures of single frames are means over.
const RUNS: u32 = 4;
/// Frames whose times are taken.
const TIMED: u32 = 40;
/// The references' noise is to be this share of the least error: SSIM and FLIP cannot be had without it.
const QUIET: f64 = 0.1;
/// Most times as many samples as asked for that references get for it.
const MOST_TIMES: u32 = 16;

/// The measurements of a view.
#[derive(Clone, Debug, Serialize)]
pub struct ViewReport {
    pub map: String,
    pub spawn: usize,
    /// Samples of each reference, and the relative squared error of the mean of both.
    pub references: u32,
    pub reference_error: f64,
    /// One frame as it comes, and the mean of [`RAW`].
    pub raw: Figures,
    pub raw_many: Figures,
    /// The still view after each of [`STILL`] frames.
    pub still: [Figures; 2],
    /// The moving view, which ends where the still one stands.
    pub moved: Figures,
    /// Median milliseconds per pass of the still view and of the moving one, where the device tells times.
    pub passes: BTreeMap<String, f64>,
    pub moving_passes: BTreeMap<String, f64>,
}

/// Raw images of so many samples, each with other random numbers.
fn raw(stage: &mut Stage, camera: &Camera, samples: u32, runs: u32) -> Result<Vec<Pixels>, RenderError> {
    (0..runs)
        .map(|run| {
            let settings = Settings {
                seed: stage.base.seed.wrapping_add(run),
                ..stage.base
            };
            stage.accumulated(camera, &settings, samples)
        })
        .collect()
}

/// The image after so many frames along a path; histories begin with it.
fn shown(stage: &mut Stage, frames: u32, path: &dyn Fn(u32) -> Camera) -> Result<Pixels, RenderError> {
    let settings = stage.base;
    // An averaged frame ends all histories.
    stage.frame(&path(0), &settings, 0, 1)?;
    for index in 0..frames {
        stage.frame(&path(index), &settings, index, 0)?;
    }
    stage.shown()
}

fn times(stage: &mut Stage, path: &dyn Fn(u32) -> Camera) -> Result<BTreeMap<String, f64>, RenderError> {
    let settings = stage.base;
    let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut ended = Vec::new();
    for index in 0..TIMED {
        ended.extend(stage.frame(&path(index), &settings, index, 0)?);
    }
    ended.extend(stage.realtime.finish()?);
    for frame in &ended[ended.len() / 4..] {
        for (name, ms) in &frame.passes {
            times.entry(name.clone()).or_default().extend(ms.as_f64());
        }
        times.entry("frame".into()).or_default().extend(frame.gpu_ms);
    }
    let median = |mut v: Vec<f64>| {
        v.sort_unstable_by(f64::total_cmp);
        v.get(v.len() / 2).copied()
    };
    Ok(times
        .into_iter()
        .filter_map(|(name, v)| Some((name, median(v)?)))
        .collect())
}

/// Images that a view's figures are of, by name.
pub type Looked = Vec<(&'static str, Pixels)>;

/// Measures a view.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn run(stage: &mut Stage, map: &str, spawn: usize, camera: &Camera) -> Result<(ViewReport, Looked), RenderError> {
    let raw_one = raw(stage, camera, 1, RUNS)?;
    let raw_many = raw(stage, camera, RAW, 1)?;
    let mut still = [Vec::new(), Vec::new()];
    for (image, frames) in still.iter_mut().zip(STILL) {
        *image = shown(stage, frames, &|_| *camera)?;
    }
    // The moving view ends where the still one stands, so that the truth is the same.
    let right = camera.axes().right;
    let path = |index: u32| {
        let left = (MOVING - 1 - index) as f32;
        let mut c = *camera;
        c.eye = std::array::from_fn(|i| c.eye[i] - right[i] * SIDEWAYS * left);
        c.yaw -= TURN * left;
        c
    };
    let moved = shown(stage, MOVING, &path)?;
    // Each of the two truths is made of two parts.
    let asked = (stage.references / 2).max(1);
    let mut truth = Truth::new(stage, camera, asked)?;
    while truth.samples < asked * MOST_TIMES {
        let least = [&still[0], &still[1], &moved].map(|image| truth.error(image).rel_mse);
        if 0.5 * truth.references.own_error() <= QUIET * least.into_iter().fold(f64::INFINITY, f64::min) {
            break;
        }
        truth = truth.refine(stage, camera)?;
    }
    let references = &truth.references;
    let figures = |images: &[Pixels]| {
        let figures: Vec<Figures> = images.iter().map(|i| stage.figures(i, references)).collect();
        Figures::mean(&figures)
    };
    let report = ViewReport {
        map: map.to_owned(),
        spawn,
        references: truth.samples * 2,
        reference_error: 0.5 * references.own_error(),
        raw: figures(&raw_one),
        raw_many: figures(&raw_many),
        still: still.each_ref().map(|i| stage.figures(i, references)),
        moved: stage.figures(&moved, references),
        passes: times(stage, &|_| *camera)?,
        moving_passes: times(stage, &path)?,
    };
    let [still_8, still_64] = still;
    let [reference_a, reference_b] = truth.references.images;
    let first = |images: Vec<Pixels>| images.into_iter().next().unwrap_or_default();
    let looked = vec![
        ("raw1", first(raw_one)),
        ("raw128", first(raw_many)),
        ("still8", still_8),
        ("still64", still_64),
        ("moved64", moved),
        ("reference_a", reference_a),
        ("reference_b", reference_b),
    ];
    Ok((report, looked))
}
