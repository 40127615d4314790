//! What a walk looks like, frame by frame: three seconds at 60 frames per second with sudden turns and a jump to another place.

use super::references::{Pixels, References};
use super::stage::Stage;
use crate::game::movement::Command;
use crate::game::play::{Event, Play};
use crate::render::gpu_renderer::history_lengths;
use crate::render::scene_gpu::RenderError;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use serde::Serialize;

/// Frames of the walk, and how many a second.
pub const FRAMES: u32 = 180;
const RATE: f32 = 60.0;
/// Frames in which one turns at once, and by how much to the left, degrees; in between one turns slowly.
const TURNS: [(u32, f32); 2] = [(40, 90.0), (80, -120.0)];
const SLOW_TURN: f32 = 0.5;
/// Frame that shows another place all of a sudden.
pub const JUMP: u32 = 120;
/// Every so many frames the truth is found out, and in all frames from the jump to so many later.
const EVERY: u32 = 6;
const AFTER_JUMP: u32 = 12;
/// Frames after the jump that the view is looked at, and for how many frames it stood still before where the jump leads to for what it
/// is held against.
const RECOVERED: u32 = 8;
const SETTLED: u32 = 40;
/// Samples of the raw frames that the walk is held against.
pub const RAW: u32 = 16;
/// Age of pixels, in frames, at which what was hidden before is looked at; those around them, at most so many pixels away, are
/// at least so old.
const YOUNG: u32 = 4;
const OLD: f32 = 16.0;
const AROUND: usize = 8;
/// Frames in which such pixels are not looked for: all pixels are young.
const RESTART: u32 = 20;

/// One frame of the walk.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrameReport {
    pub frame: u32,
    /// FLIP of the frame that is shown, and of [`RAW`] raw samples.
    pub flip: f64,
    pub raw_flip: f64,
    pub rel_mse: f64,
    pub raw_rel_mse: f64,
    pub mean_ratio: f64,
}

/// The measurements of a map.
#[derive(Clone, Debug, Serialize)]
pub struct MotionReport {
    pub map: String,
    pub frames: Vec<FrameReport>,
    /// Means over the frames looked at.
    pub flip: f64,
    pub raw_flip: f64,
    /// FLIP 8 frames after the jump, and of the same frame where one did not jump but had stood there before.
    pub after_jump: f64,
    pub settled: f64,
    /// Pixels that were hidden four frames before, over all frames, and their mean FLIP and that of their surroundings.
    pub young_pixels: usize,
    pub young: f64,
    pub around: f64,
}

/// Where the eye is in each frame: somebody who walks straight on from the first spawn, and from another one after the jump.
pub fn walk(scene: &Scene, fov: f32) -> Vec<Camera> {
    let mut play = Play::new(&scene.bsp, &scene.entities, &scene.spawns);
    let yaw = scene.spawns.first().map_or(0.0, |s| s.angle);
    let mut camera = Camera::new(play.body.eye(), yaw, fov);
    (0..FRAMES)
        .map(|frame| {
            if frame == JUMP {
                camera.yaw = play.respawn();
            } else if frame > 0 {
                let at_once = TURNS.iter().find(|(at, _)| *at == frame).map_or(0.0, |t| t.1);
                camera.yaw += SLOW_TURN + at_once;
                let command = Command {
                    forward: 1.0,
                    yaw: camera.yaw,
                    ..Command::default()
                };
                for event in play.advance(1.0 / RATE, Clock::default(), true, &command) {
                    if let Event::Turned(yaw) = event {
                        camera.yaw = yaw;
                    }
                }
            }
            camera.eye = play.body.eye().into();
            camera
        })
        .collect()
}

/// Whether the truth of a frame is found out.
fn looked_at(frame: u32) -> bool {
    frame.is_multiple_of(EVERY) || (JUMP..=JUMP + AFTER_JUMP).contains(&frame)
}

/// What is seen for the fourth frame, and what lies around that and has been seen for long.
fn young_and_around(ages: &[f32], width: usize) -> [Vec<bool>; 2] {
    let height = ages.len() / width.max(1);
    let young: Vec<bool> = ages.iter().map(|age| (age - YOUNG as f32).abs() < 0.5).collect();
    let mut around = vec![false; ages.len()];
    for i in (0..ages.len()).filter(|i| young[*i]) {
        let (x, y) = (i % width, i / width);
        for v in y.saturating_sub(AROUND)..(y + AROUND + 1).min(height) {
            for u in x.saturating_sub(AROUND)..(x + AROUND + 1).min(width) {
                around[v * width + u] |= ages[v * width + u] >= OLD;
            }
        }
    }
    [young, around]
}

/// Sums of FLIP over pixels that were hidden and over those around them.
#[derive(Default)]
struct Trails {
    sums: [f64; 2],
    counts: [usize; 2],
}

impl Trails {
    fn add(&mut self, stage: &Stage, image: &Pixels, truth: &References, ages: &[f32]) {
        let masks = young_and_around(ages, stage.size.0 as usize);
        for (k, mask) in masks.iter().enumerate() {
            let count = mask.iter().filter(|m| **m).count();
            let metrics = stage.compare(image, truth, Some(mask)).ok();
            if let Some(flip) = metrics.and_then(|m| m.flip) {
                self.sums[k] += flip * count as f64;
                self.counts[k] += count;
            }
        }
    }

    fn means(&self) -> [f64; 2] {
        [0, 1].map(|k| self.sums[k] / self.counts[k] as f64)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
    sum / f64::from(n)
}

/// Walks through a map. `progress` is told how much is done, 0..1.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn run(stage: &mut Stage, map: &str, path: &[Camera], progress: &dyn Fn(f32)) -> Result<MotionReport, RenderError> {
    let settings = stage.base;
    // All frames first: averaged ones end the histories.
    let mut seen = Vec::new();
    for (index, camera) in (0..).zip(path) {
        stage.frame(camera, &settings, index, 0)?;
        if looked_at(index) {
            let image = stage.shown()?;
            seen.push((index, image, history_lengths(&stage.realtime.view)?));
        }
    }
    let there = path[JUMP as usize];
    for index in 0..SETTLED {
        stage.frame(&there, &settings, index, 0)?;
    }
    for (index, camera) in (SETTLED..).zip(&path[JUMP as usize..=(JUMP + RECOVERED) as usize]) {
        stage.frame(camera, &settings, index, 0)?;
    }
    let settled_image = stage.shown()?;
    let mut settled = f64::NAN;
    let mut frames = Vec::new();
    let mut trails = Trails::default();
    let all = seen.len() as f32;
    for (i, (index, image, ages)) in seen.into_iter().enumerate() {
        progress(i as f32 / all);
        let camera = path[index as usize];
        let truth = stage.references(&camera)?;
        let raw = stage.accumulated(&camera, &settings, RAW)?;
        let (shown, raw) = (stage.figures(&image, &truth), stage.figures(&raw, &truth));
        let restarted = index < RESTART || (JUMP..JUMP + RESTART).contains(&index);
        if !restarted {
            trails.add(stage, &image, &truth, &ages);
        }
        if index == JUMP + RECOVERED {
            settled = stage.figures(&settled_image, &truth).flip;
        }
        frames.push(FrameReport {
            frame: index,
            flip: shown.flip,
            raw_flip: raw.flip,
            rel_mse: shown.rel_mse,
            raw_rel_mse: raw.rel_mse,
            mean_ratio: shown.mean_ratio,
        });
    }
    let [young, around] = trails.means();
    let recovered = frames.iter().find(|f| f.frame == JUMP + RECOVERED);
    Ok(MotionReport {
        map: map.to_owned(),
        flip: mean(frames.iter().map(|f| f.flip)),
        raw_flip: mean(frames.iter().map(|f| f.raw_flip)),
        after_jump: recovered.map_or(f64::NAN, |f| f.flip),
        settled,
        young_pixels: trails.counts[0],
        young,
        around,
        frames,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_hidden_is_told_from_what_is_around_it() {
        let width = 40;
        let mut ages = vec![30.0; width * 20];
        ages[10 * width + 20] = 4.0;
        ages[10 * width + 21] = 1.0;
        let [young, around] = young_and_around(&ages, width);
        assert_eq!(young.iter().filter(|y| **y).count(), 1);
        assert!(around[10 * width + 12] && !around[10 * width + 11] && !around[10 * width + 21]);
        assert!(around[2 * width + 20] && !around[width + 20]);
    }

    #[test]
    fn the_jump_is_among_the_frames_looked_at() {
        assert!((JUMP..=JUMP + 8).all(looked_at) && !looked_at(1) && looked_at(FRAMES - EVERY));
    }
}
