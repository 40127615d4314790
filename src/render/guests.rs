//! Lights that frames bring along, one buffer for each frame in flight; it grows as they get more.

use crate::gpu::{Buffer, Device, GpuError, MemoryKind};
use crate::scene::records::Light;
use ash::vk;
use std::sync::Arc;

/// A view's guests.
#[derive(Default)]
pub struct Guests {
    buffers: Vec<Option<Buffer>>,
    before: Vec<Light>,
    /// Number of changes so far.
    pub revision: u32,
}

impl Guests {
    /// Writes a frame's lights; returns their address, 0 where there are none.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn write(&mut self, device: &Arc<Device>, slot: usize, lights: &[Light]) -> Result<u64, GpuError> {
        if self.before != lights {
            self.before = lights.to_vec();
            self.revision = self.revision.wrapping_add(1);
        }
        if lights.is_empty() {
            return Ok(0);
        }
        if self.buffers.len() <= slot {
            self.buffers.resize_with(slot + 1, || None);
        }
        let bytes = size_of_val(lights) as u64;
        let mut buffer = match self.buffers[slot].take() {
            Some(made) if made.size() >= bytes => made,
            _ => {
                let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
                Buffer::new(
                    device,
                    "guest lights",
                    bytes.next_power_of_two(),
                    usage,
                    MemoryKind::Upload,
                )?
            }
        };
        buffer.write(0, lights)?;
        Ok(self.buffers[slot].insert(buffer).address())
    }
}
