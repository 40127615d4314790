//! Buffers and their memory.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::error::Context;
use super::{Device, GpuError, ResourceId};

/// Where a buffer lives and who touches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryKind {
    /// GPU memory, not visible to the CPU.
    DeviceLocal,
    /// Written by the CPU, read by the GPU.
    Upload,
    /// Written by the GPU, read by the CPU.
    Readback,
}

/// A buffer with its own memory, freed on drop.
pub struct Buffer {
    device: Arc<Device>,
    raw: vk::Buffer,
    allocation: Option<Allocation>,
    size: u64,
    address: vk::DeviceAddress,
    id: ResourceId,
}

impl Buffer {
    /// Makes a buffer of `size` bytes. It can be copied from and to and has a device address whatever `usage` says.
    /// A size of 0 is allowed; the buffer then still has an address, of memory that nobody may read.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        kind: MemoryKind,
    ) -> Result<Self, GpuError> {
        let usage = usage
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        // Vulkan knows no empty buffers; an empty list of lights or triangles is normal for us.
        let info = vk::BufferCreateInfo::default().size(size.max(16)).usage(usage);
        // SAFETY: `info` is complete. From here on `Drop` cleans up if a later step fails.
        let raw = unsafe { device.raw().create_buffer(&info, None) }
            .context(&format!("the creation of the buffer '{name}'"))?;
        let id = device.new_resource_id();
        let mut buffer = Self {
            device: device.clone(),
            raw,
            allocation: None,
            size,
            address: 0,
            id,
        };
        device.set_name(raw, name);
        // SAFETY: `raw` was just created.
        let mut requirements = unsafe { device.raw().get_buffer_memory_requirements(raw) };
        if usage.contains(vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR) {
            // Instance data must lie at multiples of 16, which Vulkan does not ask of the buffer as such.
            requirements.alignment = requirements.alignment.max(16);
        }
        let location = match kind {
            MemoryKind::DeviceLocal => MemoryLocation::GpuOnly,
            MemoryKind::Upload => MemoryLocation::CpuToGpu,
            MemoryKind::Readback => MemoryLocation::GpuToCpu,
        };
        let allocation = device.allocate(name, requirements, location, true)?;
        // SAFETY: the allocation fits the requirements and lives until after the buffer is destroyed.
        let bound = unsafe {
            device
                .raw()
                .bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        };
        buffer.allocation = Some(allocation);
        bound.context(&format!("the binding of memory to the buffer '{name}'"))?;
        let address_info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: the buffer has memory and SHADER_DEVICE_ADDRESS usage.
        buffer.address = unsafe { device.raw().get_buffer_device_address(&address_info) };
        Ok(buffer)
    }

    /// Makes a [`MemoryKind::Upload`] buffer that holds `data`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn with_data<T: bytemuck::NoUninit>(
        device: &Arc<Device>,
        name: &str,
        data: &[T],
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, GpuError> {
        let mut buffer = Self::new(device, name, size_of_val(data) as u64, usage, MemoryKind::Upload)?;
        buffer.write(0, data)?;
        Ok(buffer)
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// Size in bytes, as asked for.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Address of its first byte for shaders and acceleration structure builds.
    pub fn address(&self) -> vk::DeviceAddress {
        self.address
    }

    /// Identity for hazard tracking.
    pub fn id(&self) -> ResourceId {
        self.id
    }

    /// The device that it lives on.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Its content; `None` if the CPU cannot see it. The caller sees to it that the GPU is done writing it.
    pub fn mapped(&self) -> Option<&[u8]> {
        self.allocation.as_ref()?.mapped_slice()?.get(..self.size as usize)
    }

    /// Its content for writing; `None` if the CPU cannot see it. The caller sees to it that the GPU does not use it.
    pub fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.allocation
            .as_mut()?
            .mapped_slice_mut()?
            .get_mut(..self.size as usize)
    }

    /// Copies `data` to byte `offset`. The caller sees to it that the GPU does not use that part.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if the buffer is not visible to the CPU or too small.
    pub fn write<T: bytemuck::NoUninit>(&mut self, offset: u64, data: &[T]) -> Result<(), GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let size = self.size;
        let target = self
            .mapped_mut()
            .ok_or_else(|| GpuError::InvalidInput("a write to a buffer that the CPU cannot see".into()))?;
        let range = usize::try_from(offset)
            .ok()
            .and_then(|start| Some(start..start.checked_add(bytes.len())?));
        let target = range.and_then(|range| target.get_mut(range)).ok_or_else(|| {
            GpuError::InvalidInput(format!(
                "{} bytes at {offset} exceed a buffer of {size} bytes",
                bytes.len()
            ))
        })?;
        target.copy_from_slice(bytes);
        Ok(())
    }

    /// Copies the content out, as many whole `T` as fit. The caller sees to it that the GPU is done writing.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if the buffer is not visible to the CPU.
    pub fn read<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(&self) -> Result<Vec<T>, GpuError> {
        let bytes = self
            .mapped()
            .ok_or_else(|| GpuError::InvalidInput("a read from a buffer that the CPU cannot see".into()))?;
        if size_of::<T>() == 0 {
            return Ok(Vec::new());
        }
        let mut values = vec![T::zeroed(); bytes.len() / size_of::<T>()];
        let target: &mut [u8] = bytemuck::cast_slice_mut(&mut values);
        let length = target.len();
        target.copy_from_slice(&bytes[..length]);
        Ok(values)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the owner retires buffers only when the GPU is done with them.
        unsafe { self.device.raw().destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
