//! Frames one after another, several in flight, with their times.

use super::frame::{FrameInput, FrameRenderer};
use super::scene_gpu::{RenderError, SceneGpu};
use super::view_state::ViewState;
use crate::gpu::{Commands, Frame, FrameRing, GpuError, Image, PipelineCache, Tracker};
use crate::output::stats::FrameStats;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

/// Frames that the GPU may be behind the CPU.
pub const FRAMES_IN_FLIGHT: usize = 2;
/// Timers of a frame: one per pass, and the frame's own.
const TIMERS: u32 = 32;
/// Name of the timer around all passes.
const WHOLE_FRAME: &str = "frame";

/// One view rendered continuously.
pub struct Realtime {
    pub scene: Arc<SceneGpu>,
    frames: FrameRenderer,
    pub view: ViewState,
    ring: FrameRing,
    /// CPU time and rays of frames whose GPU times are still to come: (frame, ms).
    cpu_times: VecDeque<(u64, f64)>,
}

impl Realtime {
    /// Makes pipelines and images.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: Arc<SceneGpu>, size: (u32, u32), cache: Option<&PipelineCache>) -> Result<Self, RenderError> {
        let frames = FrameRenderer::new(&scene, cache)?;
        let view = ViewState::new(&scene.device, &frames.view_layout, size, FRAMES_IN_FLIGHT)?;
        let ring = FrameRing::new(&scene.device, FRAMES_IN_FLIGHT, TIMERS)?;
        Ok(Self {
            scene,
            frames,
            view,
            ring,
            cpu_times: VecDeque::new(),
        })
    }

    /// Gives the view another size; its histories start anew.
    ///
    /// # Errors
    /// [`RenderError`], out of memory above all.
    pub fn resize(&mut self, size: (u32, u32)) -> Result<(), RenderError> {
        if size != self.view.gbuffer.size {
            self.ring.wait()?;
            self.view = ViewState::new(&self.scene.device, &self.frames.view_layout, size, FRAMES_IN_FLIGHT)?;
        }
        Ok(())
    }

    /// Makes the view anew: no history of what it has shown is left.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn forget(&mut self) -> Result<(), RenderError> {
        self.ring.wait()?;
        let size = self.view.gbuffer.size;
        self.view = ViewState::new(&self.scene.device, &self.frames.view_layout, size, FRAMES_IN_FLIGHT)?;
        Ok(())
    }

    /// Makes all passes anew from their shaders; with the feature `compile-shaders` these are compiled now. The old ones stay where that
    /// fails.
    ///
    /// # Errors
    /// [`RenderError`], a shader that does not compile above all.
    pub fn reload_shaders(&mut self, cache: Option<&PipelineCache>) -> Result<(), RenderError> {
        let frames = FrameRenderer::new(&self.scene, cache)?;
        self.ring.wait()?;
        self.frames = frames;
        Ok(())
    }

    /// Renders a frame. `show` records what happens to the display image and submits the frame; `false` from it means
    /// that there is nowhere to show it now. Returns the statistics of an earlier frame that has ended meanwhile.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn frame(
        &mut self,
        input: &FrameInput,
        show: impl FnOnce(Shown<'_, '_>) -> Result<(), GpuError>,
    ) -> Result<Option<FrameStats>, RenderError> {
        let start = Instant::now();
        let frame = self.ring.begin()?;
        let slot = frame.slot();
        let ended = take_stats(&frame, &mut self.view, &mut self.cpu_times)?;
        let index = frame.index();
        let cmd = frame.commands();
        let whole = frame.timestamps().begin(&cmd, WHOLE_FRAME);
        self.frames
            .record(&cmd, Some(frame.timestamps()), &self.scene, &mut self.view, slot, input)?;
        frame.timestamps().end(&cmd, whole);
        let ViewState { gbuffer, tracker, .. } = &mut self.view;
        show(Shown {
            frame,
            tracker,
            image: gbuffer.display(),
        })?;
        self.cpu_times.push_back((index, start.elapsed().as_secs_f64() * 1e3));
        Ok(ended)
    }

    /// Waits for the GPU and returns the statistics still outstanding.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn finish(&mut self) -> Result<Vec<FrameStats>, RenderError> {
        let mut out = Vec::new();
        for _ in 0..FRAMES_IN_FLIGHT {
            let frame = self.ring.begin()?;
            out.extend(take_stats(&frame, &mut self.view, &mut self.cpu_times)?);
        }
        self.ring.wait()?;
        Ok(out)
    }
}

impl Drop for Realtime {
    fn drop(&mut self) {
        // Passes and images go before the ring, which would wait too late.
        if let Err(error) = self.ring.wait() {
            tracing::debug!("{error}");
        }
    }
}

/// A recorded frame on its way to where it is shown.
pub struct Shown<'a, 'b> {
    pub frame: Frame<'a>,
    pub tracker: &'b mut Tracker,
    pub image: &'b Image,
}

impl Shown<'_, '_> {
    /// The frame's commands.
    pub fn commands(&self) -> Commands<'_> {
        self.frame.commands()
    }
}

/// Statistics of the frame that last used this frame's slot.
fn take_stats(
    frame: &Frame<'_>,
    view: &mut ViewState,
    cpu_times: &mut VecDeque<(u64, f64)>,
) -> Result<Option<FrameStats>, RenderError> {
    let slot = frame.slot();
    // Without timestamps a frame is known to have ended when its slot comes round again.
    let ended = match frame.timings() {
        Some(timings) => timings.frame,
        None if cpu_times.len() >= FRAMES_IN_FLIGHT => cpu_times[0].0,
        None => return Ok(None),
    };
    while cpu_times.front().is_some_and(|(index, _)| *index < ended) {
        cpu_times.pop_front();
    }
    let Some((_, cpu_ms)) = cpu_times.pop_front() else {
        return Ok(None);
    };
    let (mut rays, history) = view.take_counts(slot)?;
    rays.primary = u64::from(view.gbuffer.size.0) * u64::from(view.gbuffer.size.1);
    let scopes = frame.timings().map(|t| t.scopes.as_slice()).unwrap_or_default();
    let gpu_ms = scopes.iter().find(|s| s.name == WHOLE_FRAME).map(|s| s.milliseconds);
    let passes = scopes
        .iter()
        .filter(|s| s.name != WHOLE_FRAME)
        .map(|s| (s.name.to_string(), s.milliseconds.into()))
        .collect();
    Ok(Some(FrameStats {
        index: ended as u32,
        cpu_ms,
        gpu_ms,
        passes,
        rays,
        history,
    }))
}
