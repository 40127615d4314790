//! Strata of the denoiser: what the next frame's gradients are taken of. The stages that shade write them
//! (`shaders/include/strata.glsl`).

use super::gbuffer::STRATUM;
use super::pass::groups_over;
use crate::gpu::{Buffer, Device, GpuError, MemoryKind};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// `struct Stratum` of `shaders/include/scene.glsl`, which says what its members are.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Stratum {
    pub position: [f32; 3],
    pub shading_normal: u32,
    pub geometric_normal: u32,
    pub row: u32,
    pub instance: u32,
    pub address: u32,
    pub sample_index: u32,
    pub light: u32,
    pub point: [f32; 2],
    pub weight: f32,
    pub luminance: f32,
}

/// Samples of one view, one per stratum.
pub struct Strata {
    pub buffer: Buffer,
}

fn strata(size: (u32, u32)) -> (u32, u32) {
    (size.0.div_ceil(STRATUM), size.1.div_ceil(STRATUM))
}

/// Work groups with one thread per stratum of an image.
pub fn strata_groups(size: (u32, u32)) -> [u32; 3] {
    groups_over(strata(size))
}

impl Strata {
    /// Memory for a view of `size` pixels.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, size: (u32, u32)) -> Result<Self, GpuError> {
        let (w, h) = strata(size);
        let bytes = u64::from(w) * u64::from(h) * size_of::<Stratum>() as u64;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        Ok(Self {
            buffer: Buffer::new(device, "strata", bytes, usage, MemoryKind::DeviceLocal)?,
        })
    }
}
