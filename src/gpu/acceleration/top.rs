//! Top levels: trees over instances of bottom levels, rebuilt every frame.

use std::sync::Arc;

use ash::vk;

use super::bottom::BottomLevel;
use super::memory::{Scratch, Storage};
use crate::gpu::{Buffer, Commands, Device, GpuError, MemoryKind, ResourceId};

/// One instance of a bottom level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopInstance {
    /// Object to world, three rows of a 3x4 matrix.
    pub transform: [[f32; 4]; 3],
    /// What the shader sees as the instance's custom index; below 2^24.
    pub custom_index: u32,
    /// A ray sees the instance if its mask and this have a bit in common.
    pub mask: u8,
    /// Overrides of opacity and culling.
    pub flags: vk::GeometryInstanceFlagsKHR,
    /// Address of the bottom level; 0 makes the instance invisible.
    pub bottom: vk::DeviceAddress,
}

impl TopInstance {
    /// An instance where it was modelled, seen by all rays.
    pub fn new(bottom: &BottomLevel, custom_index: u32) -> Self {
        Self {
            transform: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
            custom_index,
            mask: 0xff,
            flags: vk::GeometryInstanceFlagsKHR::empty(),
            bottom: bottom.address(),
        }
    }

    fn to_raw(self) -> Result<RawInstance, GpuError> {
        if self.custom_index >> 24 != 0 {
            return Err(GpuError::InvalidInput(format!(
                "the instance index {} needs over 24 bits",
                self.custom_index
            )));
        }
        Ok(RawInstance {
            transform: self.transform,
            index_and_mask: self.custom_index | u32::from(self.mask) << 24,
            // The low 24 bits are for shader binding tables, of which ray queries have none.
            flags: self.flags.as_raw() << 24,
            bottom: self.bottom,
        })
    }
}

/// An instance as Vulkan lays it out.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct RawInstance {
    transform: [[f32; 4]; 3],
    index_and_mask: u32,
    flags: u32,
    bottom: u64,
}

/// The memory for up to `capacity` instances.
struct Memory {
    storage: Storage,
    scratch: Scratch,
    capacity: u32,
}

/// A top level, destroyed on drop.
pub struct TopLevel {
    device: Arc<Device>,
    name: String,
    memory: Memory,
    /// Instance data, one buffer per frame in flight.
    instances: Vec<Option<Buffer>>,
    /// Memory that was outgrown, with the number of the build that replaced it.
    outgrown: Vec<(u64, Memory)>,
    builds: u64,
    id: ResourceId,
}

impl TopLevel {
    /// Makes room for `capacity` instances (more when needed) and `frames` frames in flight. It must be built before
    /// it is traced.
    ///
    /// # Errors
    /// [`GpuError::MissingFeature`] without ray query, out of memory.
    pub fn new(device: &Arc<Device>, name: &str, capacity: u32, frames: usize) -> Result<Self, GpuError> {
        Ok(Self {
            memory: Memory::new(device, name, capacity)?,
            device: device.clone(),
            name: name.to_owned(),
            instances: (0..frames.max(1)).map(|_| None).collect(),
            outgrown: Vec::new(),
            builds: 0,
            id: device.new_resource_id(),
        })
    }

    /// Records a build over `instances`, at most once per frame; `slot` is [`crate::gpu::Frame::slot`]. Returns true
    /// if it now has another handle, so that descriptors must be written anew.
    ///
    /// The caller declares [`crate::gpu::Access::BuildWrite`] of it and [`crate::gpu::Access::BuildRead`] of bottom
    /// levels that are refitted in the same frame.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for too many instances or too large a custom index, out of memory.
    pub fn record_build(
        &mut self,
        cmd: &Commands<'_>,
        instances: &[TopInstance],
        slot: usize,
    ) -> Result<bool, GpuError> {
        let count = u32::try_from(instances.len()).unwrap_or(u32::MAX);
        if u64::from(count) > self.device.limits().max_instances {
            return Err(GpuError::InvalidInput(format!(
                "{count} instances are more than the device can have"
            )));
        }
        let raw = instances
            .iter()
            .map(|instance| instance.to_raw())
            .collect::<Result<Vec<_>, _>>()?;
        self.builds += 1;
        let frames = self.instances.len() as u64;
        // A frame in flight builds at most once, so after that many builds nobody uses the old memory.
        self.outgrown.retain(|(build, _)| build + frames > self.builds);
        let grown = count > self.memory.capacity;
        if grown {
            let memory = Memory::new(&self.device, &self.name, count.saturating_add(count / 2))?;
            self.outgrown
                .push((self.builds, std::mem::replace(&mut self.memory, memory)));
        }
        let address = self.write_instances(&raw, slot)?;
        let geometry = [instance_geometry(address)];
        let info = build_info(&geometry)
            .dst_acceleration_structure(self.memory.storage.raw())
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: self.memory.scratch.address(),
            });
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
        // SAFETY: the memory was made for at least this many instances; their data were just written.
        unsafe {
            self.device
                .acceleration()?
                .cmd_build_acceleration_structures(cmd.raw(), &[info], &[&range])
        };
        Ok(grown)
    }

    /// Copies the instances to this slot's buffer, which grows when needed. Nobody uses it: the slot's frame is done.
    fn write_instances(&mut self, raw: &[RawInstance], slot: usize) -> Result<vk::DeviceAddress, GpuError> {
        let size = size_of_val(raw) as u64;
        let slots = self.instances.len();
        let buffer = &mut self.instances[slot % slots];
        let buffer = match buffer {
            Some(buffer) if buffer.size() >= size => buffer,
            _ => {
                let capacity = size.max(u64::from(self.memory.capacity) * size_of::<RawInstance>() as u64);
                let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
                let name = format!("{} instances", self.name);
                buffer.insert(Buffer::new(&self.device, &name, capacity, usage, MemoryKind::Upload)?)
            }
        };
        buffer.write(0, raw)?;
        Ok(buffer.address())
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::AccelerationStructureKHR {
        self.memory.storage.raw()
    }

    /// Identity for hazard tracking.
    pub fn id(&self) -> ResourceId {
        self.id
    }

    /// Bytes of GPU memory, scratch included.
    pub fn size(&self) -> u64 {
        self.memory.storage.size() + self.memory.scratch.size()
    }
}

impl Memory {
    fn new(device: &Arc<Device>, name: &str, capacity: u32) -> Result<Self, GpuError> {
        let capacity = capacity
            .max(1)
            .min(u32::try_from(device.limits().max_instances).unwrap_or(u32::MAX));
        let geometry = [instance_geometry(0)];
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: there is one count for the one geometry.
        unsafe {
            device.acceleration()?.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &build_info(&geometry),
                &[capacity],
                &mut sizes,
            );
        }
        let ty = vk::AccelerationStructureTypeKHR::TOP_LEVEL;
        Ok(Self {
            storage: Storage::new(device, name, ty, sizes.acceleration_structure_size)?,
            scratch: Scratch::new(device, sizes.build_scratch_size)?,
            capacity,
        })
    }
}

fn build_info<'a>(
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(vk::AccelerationStructureTypeKHR::TOP_LEVEL)
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}

fn instance_geometry(address: vk::DeviceAddress) -> vk::AccelerationStructureGeometryKHR<'static> {
    let instances =
        vk::AccelerationStructureGeometryInstancesDataKHR::default().data(vk::DeviceOrHostAddressConstKHR {
            device_address: address,
        });
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
}
