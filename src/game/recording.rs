//! A way through a map, written down frame by frame: what was pressed, what was seen and what moved.

use super::movement::Command;
use super::play::{Event, Play, PlayState};
use crate::output::{OutputError, atomic};
use crate::scene::camera::{Camera, Shot};
use crate::scene::clock::Clock;
use crate::scene::entity_geometry::EntityState;
use serde::{Deserialize, Serialize};
use std::path::Path;
use thiserror::Error;

/// Version of the format.
const VERSION: u32 = 1;
/// Most frames of a recording: a day at 60 a second would not fit into memory.
pub const MOST_FRAMES: usize = 2_000_000;

/// Frames from one that names all entities that are not as the map has them to the next that does.
const KEY_FRAME: usize = 256;

/// Why a recording cannot be used.
#[derive(Debug, Error)]
pub enum RecordingError {
    #[error("cannot read the recording '{}' ({reason}); `record` makes a new one", path.display())]
    Read { path: std::path::PathBuf, reason: String },
    #[error(transparent)]
    Write(#[from] OutputError),
}

/// A recorded frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedFrame {
    /// Seconds since the recording began.
    pub at: f64,
    /// Scene time that went by, seconds.
    pub seconds: f32,
    /// The scene's time at the frame's end.
    pub clock: Clock,
    /// Nothing moved but the player.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub frozen: bool,
    pub command: Command,
    /// The view at the frame's end, in the units and angles of [`Camera`].
    pub camera: Camera,
    /// Entities that are not as the map has them, where they differ from the frame before, and from time to time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entities: Option<Vec<EntityState>>,
    /// The state that the frame began with, where that does not follow from the frame before: at the start, and after commands such as
    /// `setviewpos`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<PlayState>,
}

/// Frames one after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    pub version: u32,
    pub map: String,
    /// Console variables at the start.
    pub settings: serde_json::Map<String, serde_json::Value>,
    pub frames: Vec<RecordedFrame>,
}

/// What a moment of a recording shows.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedView {
    pub camera: Camera,
    pub clock: Clock,
    pub entities: Vec<EntityState>,
}

impl Recording {
    /// An empty recording.
    pub fn new(map: &str, settings: serde_json::Map<String, serde_json::Value>) -> Self {
        Self {
            version: VERSION,
            map: map.to_owned(),
            settings,
            frames: Vec::new(),
        }
    }

    /// Adds a frame; `entities` are all that are not as the map has them. False where it is full.
    pub fn push(&mut self, mut frame: RecordedFrame, entities: &[EntityState]) -> bool {
        if self.frames.len() >= MOST_FRAMES {
            return false;
        }
        let known = self
            .frames
            .iter()
            .rev()
            .find_map(|f| f.entities.as_deref())
            .unwrap_or_default();
        // Again from time to time, so that nobody has to look far for them.
        if known != entities || self.frames.len().is_multiple_of(KEY_FRAME) {
            frame.entities = Some(entities.to_vec());
        }
        self.frames.push(frame);
        true
    }

    /// Seconds from its start to its last frame.
    pub fn length(&self) -> f64 {
        self.frames.last().map_or(0.0, |f| f.at)
    }

    /// What frame `index` shows.
    pub fn view(&self, index: usize) -> Option<RecordedView> {
        let frame = self.frames.get(index)?;
        let entities = self.frames[..=index].iter().rev().find_map(|f| f.entities.clone());
        Some(RecordedView {
            camera: frame.camera,
            clock: frame.clock,
            entities: entities.unwrap_or_default(),
        })
    }

    /// What it shows at a time, seconds from its start: cameras go straight on between frames, unless one was a jump.
    pub fn at(&self, seconds: f64) -> Option<RecordedView> {
        let next = self.frames.partition_point(|f| f.at < seconds);
        let (Some(after), Some(before)) = (self.frames.get(next), next.checked_sub(1)) else {
            return self.view(next.min(self.frames.len().saturating_sub(1)));
        };
        let mut view = self.view(before)?;
        let span = after.at - self.frames[before].at;
        let share = if span > 0.0 {
            ((seconds - self.frames[before].at) / span) as f32
        } else {
            1.0
        };
        let shot = Shot {
            open: view.camera,
            close: after.camera,
        };
        if glam::Vec3::from(shot.open.eye).distance(shot.close.eye.into()) < JUMP && after.start.is_none() {
            view.camera = shot.at(share);
        }
        if !after.frozen {
            let later =
                f64::from(after.clock.0.wrapping_sub(view.clock.0).min(i32::MAX as u32)) / crate::scene::clock::TICKS;
            view.clock = view.clock.after(later * f64::from(share));
        }
        Some(view)
    }

    /// Plays the keys again on the map that they were pressed on, and returns the first frame whose view comes out otherwise.
    pub fn replay(&self, play: &mut Play) -> Option<usize> {
        for (index, frame) in self.frames.iter().enumerate() {
            if let Some(start) = &frame.start
                && !play.restore(start)
            {
                return Some(index);
            }
            let events = play.advance(frame.seconds, frame.clock, frame.frozen, &frame.command);
            let turned = events.iter().rev().find_map(|e| match e {
                Event::Turned(yaw) => Some((yaw.rem_euclid(360.0), 0.0)),
                _ => None,
            });
            let looked = turned.unwrap_or((frame.command.yaw, frame.command.pitch));
            if <[f32; 3]>::from(play.body.eye()) != frame.camera.eye || looked != (frame.camera.yaw, frame.camera.pitch)
            {
                return Some(index);
            }
        }
        None
    }

    /// Reads a recording.
    ///
    /// # Errors
    /// [`RecordingError::Read`] for a file that is not there, is damaged or of another version.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let failed = |reason: String| RecordingError::Read {
            path: path.to_owned(),
            reason,
        };
        let text = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
        let read: Self = serde_json::from_slice(&text).map_err(|e| failed(e.to_string()))?;
        if read.version != VERSION {
            return Err(failed(format!("it is of version {}, not {VERSION}", read.version)));
        }
        let sound = |f: &RecordedFrame| f.at.is_finite() && f.seconds.is_finite() && f.camera.is_finite();
        if let Some(bad) = read.frames.iter().position(|f| !sound(f)) {
            return Err(failed(format!("frame {bad} has numbers that are not finite")));
        }
        if !read.frames.is_sorted_by(|a, b| a.at <= b.at) {
            return Err(failed("its frames go back in time".to_owned()));
        }
        Ok(read)
    }

    /// Writes it.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        atomic::create_parent(path)?;
        let text = serde_json::to_vec(self).map_err(|e| OutputError::Encode {
            path: path.to_owned(),
            reason: e.to_string(),
        })?;
        Ok(atomic::write(path, &text)?)
    }
}

/// Farther from one frame to the next, units, is a jump.
const JUMP: f32 = 200.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(at: f64, x: f32, yaw: f32) -> RecordedFrame {
        RecordedFrame {
            at,
            seconds: 0.1,
            clock: Clock::from_seconds(at),
            frozen: false,
            command: Command::default(),
            camera: Camera::new(glam::Vec3::new(x, 0.1, 1.0 / 3.0), yaw, 90.0),
            entities: None,
            start: None,
        }
    }

    #[test]
    fn files_keep_every_bit() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a/b.json");
        let mut recording = Recording::new("m", serde_json::Map::new());
        let state = EntityState {
            entity: 3,
            offset: glam::Vec3::new(0.1, 1e-30, 1e30),
            hidden: false,
        };
        for i in 0..200 {
            let at = f64::from(i) / 7.0;
            let states = if i < 100 { &[][..] } else { &[state][..] };
            assert!(recording.push(frame(at, (at as f32).sin() * 1e4, (at as f32).cos() * 180.0), states));
        }
        assert_eq!(recording.frames.iter().filter(|f| f.entities.is_some()).count(), 2);
        assert!(recording.write(&path).is_ok());
        assert_eq!(Recording::read(&path).ok(), Some(recording));
        std::fs::write(&path, b"{\"version\": 1").expect("written");
        assert!(Recording::read(&path).is_err());
    }

    #[test]
    fn moments_between_frames_lie_between_them() {
        let mut recording = Recording::new("m", serde_json::Map::new());
        for (at, x, yaw) in [(0.0, 0.0, 350.0), (1.0, 10.0, 10.0), (2.0, 900.0, 10.0)] {
            assert!(recording.push(frame(at, x, yaw), &[]));
        }
        let view = recording.at(0.5).expect("a view");
        assert_eq!((view.camera.eye[0], view.camera.yaw.rem_euclid(360.0)), (5.0, 0.0));
        assert_eq!(view.clock, Clock::from_seconds(0.5));
        assert_eq!(recording.at(1.9).map(|v| v.camera.eye[0]), Some(10.0), "a jump");
        assert_eq!(recording.at(99.0).map(|v| v.camera.eye[0]), Some(900.0));
        assert_eq!(Recording::new("m", serde_json::Map::new()).at(0.0), None);
    }
}
