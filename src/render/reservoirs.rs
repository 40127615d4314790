//! Memory of the reuse of light samples between frames and pixels: `shaders/include/reservoir.glsl`.

use super::frame_constants::FrameConstants;
use super::settings::Settings;
use crate::gpu::{Buffer, Device, GpuError, MemoryKind};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// `struct Reservoir` of `shaders/include/scene.glsl`, which says what its members are.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Reservoir {
    pub position: [f32; 3],
    pub shading_normal: u32,
    pub geometric_normal: u32,
    pub row: u32,
    pub light: u32,
    pub weight: f32,
    pub point: [f32; 2],
    pub count: f32,
    pub target: f32,
}

/// What the history depends on besides the scene: when it changes, history starts anew.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Validity {
    candidates: u32,
    cull_lights: u32,
    soft_shadows: bool,
    seed: u32,
}

/// Reservoirs of one view.
pub struct Reservoirs {
    pub current: Buffer,
    pub history: Buffer,
    /// What the history was made with; `None` after a frame that left none.
    old: Option<Validity>,
}

impl Reservoirs {
    /// Memory for a view of `size` pixels.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, size: (u32, u32)) -> Result<Self, GpuError> {
        let bytes = u64::from(size.0) * u64::from(size.1) * size_of::<Reservoir>() as u64;
        let buffer = |name| {
            Buffer::new(
                device,
                name,
                bytes,
                vk::BufferUsageFlags::STORAGE_BUFFER,
                MemoryKind::DeviceLocal,
            )
        };
        Ok(Self {
            current: buffer("reservoirs")?,
            history: buffer("reservoir history")?,
            old: None,
        })
    }

    /// Drops the history.
    pub fn forget(&mut self) {
        self.old = None;
    }

    /// Completes the constants of a frame that reuses samples, and keeps them for the next one.
    pub fn complete(&mut self, constants: FrameConstants, s: &Settings) -> FrameConstants {
        let validity = Validity {
            candidates: s.candidates,
            cull_lights: s.cull_lights,
            soft_shadows: s.soft_shadows,
            seed: s.seed,
        };
        let complete = FrameConstants {
            reservoirs: self.current.address(),
            reservoir_history: self.history.address(),
            reservoirs_used: 1,
            reuse_history: if self.old == Some(validity) { s.reuse_history } else { 0 },
            reuse_neighbours: s.reuse_neighbours,
            ..constants
        };
        self.old = Some(validity);
        complete
    }
}
