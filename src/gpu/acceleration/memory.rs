//! The memory behind acceleration structures: their storage and the scratch of builds.

use std::sync::Arc;

use ash::vk;

use crate::gpu::error::Context;
use crate::gpu::{Buffer, Device, GpuError, MemoryKind, ResourceId};

/// An acceleration structure with its storage, destroyed on drop.
pub(super) struct Storage {
    device: Arc<Device>,
    raw: vk::AccelerationStructureKHR,
    address: vk::DeviceAddress,
    buffer: Buffer,
}

impl Storage {
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        ty: vk::AccelerationStructureTypeKHR,
        size: u64,
    ) -> Result<Self, GpuError> {
        let functions = device.acceleration()?;
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        let buffer = Buffer::new(device, name, size, usage, MemoryKind::DeviceLocal)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw())
            .size(size)
            .ty(ty);
        // SAFETY: the buffer is large enough and has the usage; it is kept as long as the structure.
        let raw = unsafe { functions.create_acceleration_structure(&info, None) }
            .context(&format!("the creation of the acceleration structure '{name}'"))?;
        device.set_name(raw, name);
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: the structure is alive.
        let address = unsafe { functions.get_acceleration_structure_device_address(&info) };
        Ok(Self {
            device: device.clone(),
            raw,
            address,
            buffer,
        })
    }

    pub fn raw(&self) -> vk::AccelerationStructureKHR {
        self.raw
    }

    pub fn address(&self) -> vk::DeviceAddress {
        self.address
    }

    pub fn size(&self) -> u64 {
        self.buffer.size()
    }
}

impl Drop for Storage {
    fn drop(&mut self) {
        if let Ok(functions) = self.device.acceleration() {
            // SAFETY: the owner retires structures only when the GPU is done with them.
            unsafe { functions.destroy_acceleration_structure(self.raw, None) };
        }
    }
}

/// Scratch memory of builds and refits that run one after the other.
pub struct Scratch {
    buffer: Buffer,
    alignment: u64,
}

impl Scratch {
    /// Makes scratch memory of `size` usable bytes.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Arc<Device>, size: u64) -> Result<Self, GpuError> {
        let alignment = device.limits().scratch_alignment;
        // The address of the buffer may itself be less aligned than scratch must be.
        let buffer = Buffer::new(
            device,
            "acceleration structure scratch",
            size.saturating_add(alignment),
            vk::BufferUsageFlags::STORAGE_BUFFER,
            MemoryKind::DeviceLocal,
        )?;
        Ok(Self { buffer, alignment })
    }

    /// Usable bytes.
    pub fn size(&self) -> u64 {
        self.buffer.size() - self.alignment
    }

    /// Identity for hazard tracking.
    pub fn id(&self) -> ResourceId {
        self.buffer.id()
    }

    /// The address for a build, aligned as the device asks.
    pub(super) fn address(&self) -> vk::DeviceAddress {
        self.buffer.address().next_multiple_of(self.alignment)
    }
}

/// Consecutive aligned parts of scratch memory: offset of each, and the total.
pub(super) fn lay_out(sizes: impl IntoIterator<Item = u64>, alignment: u64) -> (Vec<u64>, u64) {
    let mut total = 0u64;
    let offsets = sizes
        .into_iter()
        .map(|size| {
            let offset = total.next_multiple_of(alignment.max(1));
            total = offset + size;
            offset
        })
        .collect();
    (offsets, total)
}

#[cfg(test)]
mod tests {
    use super::lay_out;

    #[test]
    fn parts_are_aligned_and_do_not_overlap() {
        assert_eq!(lay_out([100, 1, 128], 128), (vec![0, 128, 256], 384));
        assert_eq!(lay_out([], 128), (vec![], 0));
    }
}
