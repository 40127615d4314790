//! Recording: a command buffer with safe wrappers for what we record, and one-shot submission.

use std::ffi::CString;
use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::image::{subresource_layer, subresources};
use super::{Access, Barrier, Buffer, Device, GpuError, Image};

/// A command buffer being recorded.
///
/// What is recorded must stay alive until the GPU has run it: see [`super::Frame::retire`].
pub struct Commands<'d> {
    device: &'d Arc<Device>,
    raw: vk::CommandBuffer,
}

impl<'d> Commands<'d> {
    /// Wraps a command buffer that someone else began, for recording into another engine's frame.
    ///
    /// # Safety
    /// `raw` belongs to `device`, is in the recording state and outside of a render pass.
    pub unsafe fn from_raw(device: &'d Arc<Device>, raw: vk::CommandBuffer) -> Self {
        Self { device, raw }
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::CommandBuffer {
        self.raw
    }

    /// The device recorded for.
    pub fn device(&self) -> &'d Arc<Device> {
        self.device
    }

    /// Runs `record` inside a region that debuggers show under `name`.
    pub fn labelled<R>(&self, name: &str, record: impl FnOnce(&Self) -> R) -> R {
        self.begin_label(name);
        let result = record(self);
        self.end_label();
        result
    }

    pub(super) fn begin_label(&self, name: &str) {
        if let (Some(debug), Ok(name)) = (self.device.debug(), CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the command buffer is being recorded.
            unsafe { debug.cmd_begin_debug_utils_label(self.raw, &label) };
        }
    }

    pub(super) fn end_label(&self) {
        if let Some(debug) = self.device.debug() {
            // SAFETY: the command buffer is being recorded, and every end follows its begin.
            unsafe { debug.cmd_end_debug_utils_label(self.raw) };
        }
    }

    /// Records a global memory barrier.
    pub fn barrier(&self, barrier: &Barrier) {
        self.barrier_with_images(barrier, &[]);
    }

    pub(super) fn barrier_with_images(&self, barrier: &Barrier, images: &[vk::ImageMemoryBarrier<'_>]) {
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(barrier.src_access)
            .dst_access_mask(barrier.dst_access)];
        // Vulkan 1.2 does not allow empty stage masks.
        let stage = |stage: vk::PipelineStageFlags, none| if stage.is_empty() { none } else { stage };
        // SAFETY: the command buffer is being recorded; stages and accesses belong together (see `Access::scope`).
        unsafe {
            self.device.raw().cmd_pipeline_barrier(
                self.raw,
                stage(barrier.src_stage, vk::PipelineStageFlags::TOP_OF_PIPE),
                stage(barrier.dst_stage, vk::PipelineStageFlags::BOTTOM_OF_PIPE),
                vk::DependencyFlags::empty(),
                &memory,
                &[],
                images,
            );
        }
    }

    /// Moves all levels of an image to the layout that `after` needs, after its use as `before`. For images outside of
    /// a [`super::Tracker`]; content in undefined levels stays undefined.
    pub fn transition(&self, image: &Image, before: Access, after: Access) {
        let barrier = Barrier::between(before, after);
        self.barrier_with_images(
            &barrier,
            &layout_changes(image, 0..image.mips(), &barrier, after.layout()),
        );
    }

    /// Like [`Self::transition`] for one level.
    pub fn transition_mip(&self, image: &Image, mip: u32, before: Access, after: Access) {
        let barrier = Barrier::between(before, after);
        self.barrier_with_images(&barrier, &layout_changes(image, mip..mip + 1, &barrier, after.layout()));
    }

    /// Copies `size` bytes between buffers.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if either range exceeds its buffer.
    pub fn copy_buffer(
        &self,
        source: &Buffer,
        source_offset: u64,
        target: &Buffer,
        target_offset: u64,
        size: u64,
    ) -> Result<(), GpuError> {
        check_range(source, source_offset, size)?;
        check_range(target, target_offset, size)?;
        if size == 0 {
            return Ok(());
        }
        let region = vk::BufferCopy {
            src_offset: source_offset,
            dst_offset: target_offset,
            size,
        };
        // SAFETY: both ranges were checked, and all our buffers have transfer usage.
        unsafe {
            self.device
                .raw()
                .cmd_copy_buffer(self.raw, source.raw(), target.raw(), &[region])
        };
        Ok(())
    }

    /// Fills the whole buffer with a 32-bit value; its last bytes stay as they are if its size is no multiple of 4.
    pub fn fill_buffer(&self, target: &Buffer, value: u32) {
        let size = target.size() & !3;
        if size > 0 {
            // SAFETY: the range lies within the buffer and is a multiple of 4.
            unsafe {
                self.device
                    .raw()
                    .cmd_fill_buffer(self.raw, target.raw(), 0, size, value)
            };
        }
    }

    /// Fills all levels of an image with a colour. The image is in the layout of [`Access::TransferWrite`].
    pub fn clear_image(&self, image: &Image, colour: [f32; 4]) {
        let value = vk::ClearColorValue { float32: colour };
        let range = [subresources(0, image.mips())];
        let layout = Access::TransferWrite.layout();
        // SAFETY: the image has transfer usage.
        unsafe {
            self.device
                .raw()
                .cmd_clear_color_image(self.raw, image.raw(), layout, &value, &range)
        };
    }

    /// Copies a level to a buffer without gaps. The image is in the layout of [`Access::TransferRead`].
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if the level is not there or the buffer is too small.
    pub fn copy_image_to_buffer(&self, image: &Image, mip: u32, target: &Buffer, offset: u64) -> Result<(), GpuError> {
        if mip >= image.mips() {
            return Err(GpuError::InvalidInput(format!("mip level {mip} of {}", image.mips())));
        }
        check_range(target, offset, image.mip_bytes(mip)?)?;
        let extent = image.mip_extent(mip);
        let region = vk::BufferImageCopy::default()
            .buffer_offset(offset)
            .image_subresource(subresource_layer(mip))
            .image_extent(vk::Extent3D {
                width: extent.width,
                height: extent.height,
                depth: 1,
            });
        // SAFETY: level and range were checked; the caller has transitioned the image.
        unsafe {
            let layout = Access::TransferRead.layout();
            self.device
                .raw()
                .cmd_copy_image_to_buffer(self.raw, image.raw(), layout, target.raw(), &[region]);
        }
        Ok(())
    }

    /// Scales level `source_mip` of one image onto level `target_mip` of another (or the same), with linear filtering.
    /// The levels are in the layouts of [`Access::TransferRead`] and [`Access::TransferWrite`].
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if a level is not there.
    pub fn blit(&self, source: &Image, source_mip: u32, target: &Image, target_mip: u32) -> Result<(), GpuError> {
        if source_mip >= source.mips() || target_mip >= target.mips() {
            return Err(GpuError::InvalidInput("a blit of a mip level that is not there".into()));
        }
        let corners = |image: &Image, mip| {
            let extent = image.mip_extent(mip);
            [
                vk::Offset3D::default(),
                vk::Offset3D {
                    x: extent.width as i32,
                    y: extent.height as i32,
                    z: 1,
                },
            ]
        };
        let region = vk::ImageBlit::default()
            .src_subresource(subresource_layer(source_mip))
            .src_offsets(corners(source, source_mip))
            .dst_subresource(subresource_layer(target_mip))
            .dst_offsets(corners(target, target_mip));
        // SAFETY: the levels exist; the caller has transitioned them.
        unsafe {
            self.device.raw().cmd_blit_image(
                self.raw,
                source.raw(),
                Access::TransferRead.layout(),
                target.raw(),
                Access::TransferWrite.layout(),
                &[region],
                vk::Filter::LINEAR,
            );
        }
        Ok(())
    }
}

/// The layout changes that bring `mips` of `image` to `layout`, which is noted in the image at once.
pub(super) fn layout_changes(
    image: &Image,
    mips: std::ops::Range<u32>,
    barrier: &Barrier,
    layout: vk::ImageLayout,
) -> Vec<vk::ImageMemoryBarrier<'static>> {
    let changes = mips
        .clone()
        .filter(|&mip| image.layout(mip) != layout)
        .map(|mip| {
            vk::ImageMemoryBarrier::default()
                .image(image.raw())
                .subresource_range(subresources(mip, 1))
                .old_layout(image.layout(mip))
                .new_layout(layout)
                .src_access_mask(barrier.src_access)
                .dst_access_mask(barrier.dst_access)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        })
        .collect();
    image.set_layouts(mips, layout);
    changes
}

fn check_range(buffer: &Buffer, offset: u64, size: u64) -> Result<(), GpuError> {
    match offset.checked_add(size) {
        Some(end) if end <= buffer.size() => Ok(()),
        _ => Err(GpuError::InvalidInput(format!(
            "{size} bytes at {offset} exceed a buffer of {} bytes",
            buffer.size()
        ))),
    }
}

/// A command pool with a fence, destroyed on drop.
struct OneShot<'d> {
    device: &'d Device,
    pool: vk::CommandPool,
    fence: vk::Fence,
}

impl Drop for OneShot<'_> {
    fn drop(&mut self) {
        // SAFETY: nothing of the pool is running any more (see `submit_once`); null handles are ignored.
        unsafe {
            self.device.raw().destroy_fence(self.fence, None);
            self.device.raw().destroy_command_pool(self.pool, None);
        }
    }
}

impl Device {
    /// Records commands, submits them and waits until the GPU has run them. All that they wrote is visible afterwards,
    /// to the CPU and to whatever is submitted later. `name` appears in debuggers and errors.
    ///
    /// # Errors
    /// What `record` returns, out of memory, device loss.
    pub fn submit_once<R>(
        self: &Arc<Self>,
        name: &str,
        record: impl FnOnce(&Commands<'_>) -> Result<R, GpuError>,
    ) -> Result<R, GpuError> {
        let mut once = OneShot {
            device: self,
            pool: vk::CommandPool::null(),
            fence: vk::Fence::null(),
        };
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(self.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the structures are complete; `once` destroys what was made, also on error.
        let raw = unsafe {
            once.pool = self.raw().create_command_pool(&pool_info, None).context(name)?;
            once.fence = self
                .raw()
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .context(name)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(once.pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            self.raw().allocate_command_buffers(&info).context(name)?[0]
        };
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is fresh.
        unsafe { self.raw().begin_command_buffer(raw, &begin) }.context(name)?;
        let commands = Commands { device: self, raw };
        let result = commands.labelled(name, record)?;
        // Whoever comes next, on the GPU or the CPU, sees everything without knowing what was done here.
        commands.barrier(&Barrier {
            src_stage: vk::PipelineStageFlags::ALL_COMMANDS,
            src_access: vk::AccessFlags::MEMORY_WRITE,
            dst_stage: vk::PipelineStageFlags::ALL_COMMANDS | vk::PipelineStageFlags::HOST,
            dst_access: vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE,
        });
        // SAFETY: recording has begun.
        unsafe { self.raw().end_command_buffer(raw) }.context(name)?;
        let buffers = [raw];
        let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
        {
            let queue = self.queue();
            // SAFETY: the queue is locked; the command buffer has been ended.
            unsafe { self.raw().queue_submit(*queue, &submit, once.fence) }.context(name)?;
        }
        // SAFETY: the fence was given to the submission above.
        unsafe { self.raw().wait_for_fences(&[once.fence], true, u64::MAX) }.context(name)?;
        Ok(result)
    }
}
