//! Recordings being made and shown.

use super::level::{View, Walked};
use crate::game::play::PlayState;
use crate::game::recording::{RecordedFrame, Recording};
use crate::output::stats::FrameStats;
use std::path::PathBuf;
use std::time::Instant;

/// A recording being made.
pub struct Recorder {
    pub path: PathBuf,
    pub recording: Recording,
    seconds: f64,
    /// The next frame begins with a state that does not follow from the one before.
    pub disturbed: bool,
}

impl Recorder {
    /// Begins an empty recording that is to be written to `path`.
    pub fn new(path: PathBuf, recording: Recording) -> Self {
        Self {
            path,
            recording,
            seconds: 0.0,
            disturbed: true,
        }
    }

    /// Adds a frame, which began with the player's state `before`. False where the recording is full.
    pub fn push(&mut self, walked: &Walked, before: PlayState) -> bool {
        if !self.recording.frames.is_empty() {
            self.seconds += f64::from(walked.view.seconds);
        }
        let start = std::mem::take(&mut self.disturbed).then_some(before);
        let frame = RecordedFrame {
            at: self.seconds,
            seconds: walked.seconds,
            clock: walked.view.clock,
            frozen: walked.frozen,
            command: walked.command,
            camera: walked.view.camera,
            entities: None,
            start,
        };
        self.recording.push(frame, &walked.view.entities)
    }
}

/// A recording being shown.
pub struct Playback {
    pub name: String,
    recording: Recording,
    /// Every frame, as fast as can be.
    pub timed: bool,
    began: Instant,
    next: usize,
    /// Times of the frames of a timed one.
    pub stats: Vec<FrameStats>,
}

impl Playback {
    /// Begins to show a recording.
    pub fn new(name: &str, recording: Recording, timed: bool) -> Self {
        Self {
            name: name.to_owned(),
            recording,
            timed,
            began: Instant::now(),
            next: 0,
            stats: Vec::new(),
        }
    }

    /// Map that it was recorded on.
    pub fn map(&self) -> &str {
        &self.recording.map
    }

    /// Begins at its first frame now: the map may only just have come.
    pub fn restart(&mut self) {
        (self.began, self.next) = (Instant::now(), 0);
        self.stats.clear();
    }

    /// Share of it that has been shown.
    pub fn share(&self) -> f32 {
        self.next as f32 / self.recording.frames.len().max(1) as f32
    }

    /// Seconds from its first frame to its last.
    pub fn length(&self) -> f64 {
        self.recording.length()
    }

    /// What is shown next; `None` at its end.
    pub fn next(&mut self, real_seconds: f32) -> Option<View> {
        let (view, seconds) = if self.timed {
            let at = |i: usize| self.recording.frames.get(i).map_or(0.0, |f| f.at);
            let seconds = at(self.next) - at(self.next.saturating_sub(1));
            let view = self.recording.view(self.next)?;
            self.next += 1;
            (view, seconds as f32)
        } else {
            let now = self.began.elapsed().as_secs_f64();
            if now > self.recording.length() && self.next > 0 {
                return None;
            }
            self.next = self.recording.frames.partition_point(|f| f.at < now).max(1);
            (self.recording.at(now)?, real_seconds)
        };
        Some(View {
            camera: view.camera,
            clock: view.clock,
            entities: view.entities,
            accumulate: false,
            seconds,
        })
    }
}
