//! Buffers of `bench rays`: rays, hit records and shadow-ray targets.

use crate::gpu::{
    Access, Barrier, Binding, BindingKind, Buffer, DescriptorLayout, DescriptorSets, Device, GpuError, MemoryKind,
    UploadBatch, Write,
};
use crate::scene::Scene;
use crate::scene::records::LIGHT_TRIANGLE;
use ash::vk;
use std::sync::Arc;

/// Triangles that shadow rays end on.
pub const TARGETS: usize = 128;
/// Bytes of a ray: origin, limit, direction, padding.
const RAY_BYTES: u64 = 32;
/// Bytes of a hit record.
const HIT_BYTES: u64 = 16;
/// Bytes of staging memory for the few uploads.
const STAGING: u64 = 1 << 20;

/// A hit record: bits of t, triangle (`NONE` for a miss), instance, packed barycentrics.
pub type HitRecord = [u32; 4];

/// A buffer of rays and what they hit.
struct Stream {
    rays: Buffer,
    hits: Buffer,
}

impl Stream {
    fn new(device: &Arc<Device>, count: u64) -> Result<Self, GpuError> {
        let buffer = |name, size| {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(device, name, size, usage, MemoryKind::DeviceLocal)
        };
        Ok(Self {
            rays: buffer("bench rays", count * RAY_BYTES)?,
            hits: buffer("bench hits", count * HIT_BYTES)?,
        })
    }
}

/// All buffers of a run, and the descriptor sets over them.
pub struct RayBuffers {
    device: Arc<Device>,
    primary: Stream,
    secondary: Stream,
    _targets: Buffer,
    readback: Buffer,
    pub layout: Arc<DescriptorLayout>,
    sets: DescriptorSets,
}

impl RayBuffers {
    /// Buffers for `count` rays of a scene.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, scene: &Scene, count: u64) -> Result<Self, GpuError> {
        let (primary, secondary) = (Stream::new(device, count)?, Stream::new(device, count)?);
        let targets = device_buffer(device, "bench targets", &shadow_targets(scene))?;
        let readback = Buffer::new(
            device,
            "bench read-back",
            count * HIT_BYTES,
            vk::BufferUsageFlags::empty(),
            MemoryKind::Readback,
        )?;
        let bindings: Vec<_> = (0..5).map(|i| Binding::one(i, BindingKind::StorageBuffer)).collect();
        let layout = DescriptorLayout::new(device, "bench rays", &bindings)?;
        let sets = DescriptorSets::new(&layout, 2, 1)?;
        for (index, stream) in [&primary, &secondary].into_iter().enumerate() {
            let buffers = [&stream.rays, &stream.hits, &primary.rays, &primary.hits, &targets];
            let writes: Vec<_> = (0..)
                .zip(buffers)
                .map(|(i, buffer)| Write::storage_buffer(i, buffer))
                .collect();
            sets.write(index, &writes)?;
        }
        Ok(Self {
            device: device.clone(),
            primary,
            secondary,
            _targets: targets,
            readback,
            layout,
            sets,
        })
    }

    /// The set whose rays are the primary ones, or those made from their hits.
    pub fn set(&self, secondary: bool) -> vk::DescriptorSet {
        self.sets.raw(usize::from(secondary))
    }

    /// The hit records of the last dispatch over a set.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn hits(&self, secondary: bool) -> Result<Vec<HitRecord>, GpuError> {
        let stream = if secondary { &self.secondary } else { &self.primary };
        self.device.submit_once("bench read-back", |cmd| {
            cmd.barrier(&Barrier::between(Access::ComputeWrite, Access::TransferRead));
            cmd.copy_buffer(&stream.hits, 0, &self.readback, 0, stream.hits.size())
        })?;
        self.readback.read()
    }
}

/// A buffer in GPU memory that holds `data`.
///
/// # Errors
/// [`GpuError`] of the device.
pub fn device_buffer<T: bytemuck::NoUninit>(device: &Arc<Device>, name: &str, data: &[T]) -> Result<Buffer, GpuError> {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let buffer = Buffer::new(device, name, size_of_val(data) as u64, usage, MemoryKind::DeviceLocal)?;
    let mut batch = UploadBatch::new(device, STAGING)?;
    batch.buffer(&buffer, 0, data)?;
    batch.finish()?;
    Ok(buffer)
}

/// The triangles that shadow rays end on, as (vertex, 0) (edge, 0) (edge, 0): emitters evenly over the light table, and
/// where there are too few of them the largest triangles of the world.
fn shadow_targets(scene: &Scene) -> Vec<[[f32; 4]; 3]> {
    let word = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
    let emitters: Vec<_> = scene
        .lights
        .lights
        .iter()
        .filter(|light| light.kind == LIGHT_TRIANGLE)
        .map(|light| [word(light.p0), word(light.p1), word(light.p2)])
        .collect();
    if emitters.len() >= TARGETS {
        return (0..TARGETS).map(|i| emitters[i * emitters.len() / TARGETS]).collect();
    }
    let geometry = &scene.geometry;
    let world = geometry
        .meshes
        .first()
        .map_or(0..0, |m| m.first_triangle..m.first_triangle + m.triangle_count);
    let mut large: Vec<_> = world
        .map(|t| {
            let [a, b, c] = geometry.corners(t);
            let (e1, e2) = (b - a, c - a);
            (
                e1.cross(e2).length(),
                [word(a.into()), word(e1.into()), word(e2.into())],
            )
        })
        .collect();
    large.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fill = large.into_iter().map(|(_, corners)| corners);
    emitters.into_iter().chain(fill).take(TARGETS).collect()
}
