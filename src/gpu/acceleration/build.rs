//! The commands that build and update bottom levels.

use ash::vk;

use super::memory::{Scratch, lay_out};
use crate::gpu::{Commands, Device, GpuError};

/// Triangles in GPU memory: positions as three 32-bit floats, indices of 32 bits.
///
/// The buffers behind the addresses have ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY usage and live through the build.
#[derive(Clone, Copy, Debug)]
pub struct TriangleGeometry {
    /// Address of the first position.
    pub vertices: vk::DeviceAddress,
    /// Bytes from one position to the next; a multiple of 4, 12 when packed.
    pub vertex_stride: u64,
    /// Number of positions; every index is below it.
    pub vertex_count: u32,
    /// Address of the first index.
    pub indices: vk::DeviceAddress,
    /// Number of triangles.
    pub triangle_count: u32,
    /// Rays need not ask the shader about hits. Otherwise each triangle is asked about at most once per ray.
    pub opaque: bool,
}

/// A build with everything that Vulkan wants pointers to.
pub(super) struct Prepared {
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    pub ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    pub flags: vk::BuildAccelerationStructureFlagsKHR,
}

impl Prepared {
    pub fn new(
        geometries: &[TriangleGeometry],
        flags: vk::BuildAccelerationStructureFlagsKHR,
    ) -> Result<Self, GpuError> {
        if let Some(bad) = geometries.iter().find(|g| g.triangle_count > 0 && g.vertex_count == 0) {
            return Err(GpuError::InvalidInput(format!(
                "{} triangles without vertices",
                bad.triangle_count
            )));
        }
        Ok(Self {
            geometries: geometries.iter().map(raw_geometry).collect(),
            ranges: geometries
                .iter()
                .map(|geometry| {
                    vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(geometry.triangle_count)
                })
                .collect(),
            flags,
        })
    }

    fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
            .flags(self.flags)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(&self.geometries)
    }

    pub fn sizes(&self, device: &Device) -> Result<vk::AccelerationStructureBuildSizesInfoKHR<'static>, GpuError> {
        let counts: Vec<u32> = self.ranges.iter().map(|range| range.primitive_count).collect();
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: there is one count per geometry.
        unsafe {
            device.acceleration()?.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &self.info(),
                &counts,
                &mut sizes,
            );
        }
        Ok(sizes)
    }
}

/// One build or update to record.
pub(super) struct Build<'a> {
    pub target: vk::AccelerationStructureKHR,
    pub prepared: &'a Prepared,
    /// Bytes of scratch memory that the driver asked for.
    pub scratch: u64,
    /// Move the boxes of the tree that is there instead of building one.
    pub update: bool,
}

/// Records builds and updates in one command; each has its own part of the scratch memory.
pub(super) fn record_builds(cmd: &Commands<'_>, builds: &[Build<'_>], scratch: &Scratch) -> Result<(), GpuError> {
    let device = cmd.device();
    let sizes = builds.iter().map(|build| build.scratch);
    let (offsets, total) = lay_out(sizes, device.limits().scratch_alignment);
    if total > scratch.size() {
        return Err(GpuError::InvalidInput(format!(
            "{total} bytes of scratch needed, {} there",
            scratch.size()
        )));
    }
    if builds.is_empty() {
        return Ok(());
    }
    let infos: Vec<_> = builds
        .iter()
        .zip(&offsets)
        .map(|(build, offset)| {
            let mut info = build
                .prepared
                .info()
                .dst_acceleration_structure(build.target)
                .scratch_data(vk::DeviceOrHostAddressKHR {
                    device_address: scratch.address() + offset,
                });
            if build.update {
                info = info
                    .mode(vk::BuildAccelerationStructureModeKHR::UPDATE)
                    .src_acceleration_structure(build.target);
            }
            info
        })
        .collect();
    let ranges: Vec<_> = builds.iter().map(|build| build.prepared.ranges.as_slice()).collect();
    // SAFETY: storage and scratch have the sizes that the driver named; the inputs are the caller's.
    unsafe {
        device
            .acceleration()?
            .cmd_build_acceleration_structures(cmd.raw(), &infos, &ranges)
    };
    Ok(())
}

fn raw_geometry(geometry: &TriangleGeometry) -> vk::AccelerationStructureGeometryKHR<'static> {
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(vk::DeviceOrHostAddressConstKHR {
            device_address: geometry.vertices,
        })
        .vertex_stride(geometry.vertex_stride)
        .max_vertex(geometry.vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(vk::DeviceOrHostAddressConstKHR {
            device_address: geometry.indices,
        });
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        .flags(if geometry.opaque {
            vk::GeometryFlagsKHR::OPAQUE
        } else {
            // Alpha tests that add up (transmittance) must not count a triangle twice.
            vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION
        })
}
