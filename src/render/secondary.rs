//! Secondary stage: reflections that branch off at glass, water and glossy surfaces.
//! Shader: `shaders/secondary.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, Device, GpuError, MemoryKind, Use};
use ash::vk;
use std::sync::Arc;

/// Words before the list of pixels: work groups in three dimensions, and the number of pixels.
const HEAD: [u32; 4] = [0, 1, 1, 0];

/// The pixels that the stage runs for.
pub struct SecondaryPixels {
    pub buffer: Buffer,
    /// What the list starts from in every frame.
    empty: Buffer,
}

impl SecondaryPixels {
    /// A list with room for every pixel, and a word for every tile of 8 x 8 pixels: whether something may branch off there.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, size: (u32, u32)) -> Result<Self, GpuError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let words = HEAD.len() as u64
            + u64::from(size.0) * u64::from(size.1)
            + u64::from(size.0.div_ceil(8)) * u64::from(size.1.div_ceil(8));
        let mut empty = Buffer::new(device, "no secondary pixels", 16, usage, MemoryKind::Upload)?;
        empty.write(0, &HEAD)?;
        Ok(Self {
            buffer: Buffer::new(device, "secondary pixels", words * 4, usage, MemoryKind::DeviceLocal)?,
            empty,
        })
    }

    /// Empties the list before the primary stage.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn clear(&self, r: &mut Recorder<'_>) -> Result<(), GpuError> {
        r.tracker
            .pass(r.cmd, &[Use::buffer(&self.buffer, Access::TransferWrite)])?;
        r.cmd.copy_buffer(&self.empty, 0, &self.buffer, 0, self.empty.size())
    }
}

/// The pass.
pub struct Secondary(Pass);

impl Secondary {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "secondary", true).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(
        &self,
        r: &mut Recorder<'_>,
        pixels: &SecondaryPixels,
        counters: &Buffer,
        focus: &Buffer,
    ) -> Result<(), GpuError> {
        let uses = [
            Use::buffer(&pixels.buffer, Access::Indirect),
            Use::buffer(&pixels.buffer, Access::ComputeRead),
            Use::buffer(counters, Access::ComputeReadWrite),
            Use::buffer(focus, Access::ComputeRead),
            Use::image(r.gbuffer.secondary(), Access::ComputeWrite),
        ];
        self.0.record_indirect(r, &uses, &pixels.buffer)
    }
}
