//! Two-dimensional images, their memory, their views, and the layout that each mip level is in.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::error::Context;
use super::format::texel_size;
use super::{Access, Buffer, Device, GpuError, MemoryKind, ResourceId};

/// What an image is to be like.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// Name for debuggers and messages.
    pub name: &'a str,
    /// Texel format.
    pub format: vk::Format,
    /// Width of level 0, texels.
    pub width: u32,
    /// Height of level 0, texels.
    pub height: u32,
    /// Mip levels; 0 means all down to 1x1.
    pub mips: u32,
    /// Uses beside copying from and to, which is always possible.
    pub usage: vk::ImageUsageFlags,
}

/// An image with its own memory (freed on drop) or, from a swapchain, someone else's.
pub struct Image {
    device: Arc<Device>,
    raw: vk::Image,
    view: vk::ImageView,
    mip_views: Vec<vk::ImageView>,
    allocation: Option<Allocation>,
    format: vk::Format,
    width: u32,
    height: u32,
    mips: u32,
    layouts: Mutex<Vec<vk::ImageLayout>>,
    id: ResourceId,
    owned: bool,
}

impl Image {
    /// Makes an image with undefined content.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for an empty size, [`GpuError::Unsupported`] when the device cannot do the format,
    /// size or usage, out of memory.
    pub fn new(device: &Arc<Device>, desc: &ImageDesc<'_>) -> Result<Self, GpuError> {
        let ImageDesc {
            name,
            format,
            width,
            height,
            ..
        } = *desc;
        if width == 0 || height == 0 {
            return Err(GpuError::InvalidInput(format!(
                "the image '{name}' has size {width}x{height}"
            )));
        }
        let full_chain = 32 - width.max(height).leading_zeros();
        let mips = if desc.mips == 0 {
            full_chain
        } else {
            desc.mips.min(full_chain)
        };
        let usage = desc.usage | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        check_support(device, desc, mips, usage)?;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(mips)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the device was asked and supports the image. `Drop` cleans up if a later step fails.
        let raw = unsafe { device.raw().create_image(&info, None) }
            .context(&format!("the creation of the image '{name}'"))?;
        let mut image = Self::bare(device, raw, format, width, height, mips, true);
        device.set_name(raw, name);
        // SAFETY: `raw` was just created.
        let requirements = unsafe { device.raw().get_image_memory_requirements(raw) };
        let allocation = device.allocate(name, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation fits the requirements and lives until after the image is destroyed.
        let bound = unsafe {
            device
                .raw()
                .bind_image_memory(raw, allocation.memory(), allocation.offset())
        };
        image.allocation = Some(allocation);
        bound.context(&format!("the binding of memory to the image '{name}'"))?;
        image.create_views(name, usage.contains(vk::ImageUsageFlags::STORAGE))?;
        Ok(image)
    }

    /// Wraps an image that belongs to someone else (a swapchain, another engine); only its view is ours.
    ///
    /// # Safety
    /// `raw` is an image of `device` as described by `desc` (whose `usage` allows a view), is in `layout`, and outlives
    /// the returned value.
    ///
    /// # Errors
    /// Vulkan's own, for the view.
    pub unsafe fn from_raw(
        device: &Arc<Device>,
        raw: vk::Image,
        desc: &ImageDesc<'_>,
        layout: vk::ImageLayout,
    ) -> Result<Self, GpuError> {
        let mips = desc.mips.max(1);
        let mut image = Self::bare(device, raw, desc.format, desc.width, desc.height, mips, false);
        image.set_layouts(0..mips, layout);
        image.create_views(desc.name, false)?;
        Ok(image)
    }

    fn bare(
        device: &Arc<Device>,
        raw: vk::Image,
        format: vk::Format,
        width: u32,
        height: u32,
        mips: u32,
        owned: bool,
    ) -> Self {
        Self {
            device: device.clone(),
            raw,
            view: vk::ImageView::null(),
            mip_views: Vec::new(),
            allocation: None,
            format,
            width,
            height,
            mips,
            layouts: Mutex::new(vec![vk::ImageLayout::UNDEFINED; mips as usize]),
            id: device.new_resource_id(),
            owned,
        }
    }

    fn create_views(&mut self, name: &str, per_mip: bool) -> Result<(), GpuError> {
        self.view = self.create_view(name, 0, self.mips)?;
        // Storage images are written one level at a time; with a single level the whole view serves.
        if per_mip && self.mips > 1 {
            for mip in 0..self.mips {
                let view = self.create_view(&format!("{name} mip {mip}"), mip, 1)?;
                self.mip_views.push(view);
            }
        }
        Ok(())
    }

    fn create_view(&self, name: &str, first_mip: u32, mips: u32) -> Result<vk::ImageView, GpuError> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(self.format)
            .subresource_range(subresources(first_mip, mips));
        // SAFETY: the image is alive and has these levels.
        let view = unsafe { self.device.raw().create_image_view(&info, None) }
            .context(&format!("the creation of a view of the image '{name}'"))?;
        self.device.set_name(view, name);
        Ok(view)
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Image {
        self.raw
    }

    /// The view of all levels.
    pub fn view(&self) -> vk::ImageView {
        self.view
    }

    /// The view of one level, for storage; `None` beyond the last or where storage use was not asked for.
    pub fn mip_view(&self, mip: u32) -> Option<vk::ImageView> {
        if self.mips == 1 && mip == 0 {
            return Some(self.view);
        }
        self.mip_views.get(mip as usize).copied()
    }

    /// Texel format.
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// Width of level 0, texels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of level 0, texels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Number of mip levels.
    pub fn mips(&self) -> u32 {
        self.mips
    }

    /// Width and height of a level, texels.
    pub fn mip_extent(&self, mip: u32) -> vk::Extent2D {
        let size = |full: u32| full.checked_shr(mip).unwrap_or(0).max(1);
        vk::Extent2D {
            width: size(self.width),
            height: size(self.height),
        }
    }

    /// Bytes of a level when its texels lie without gaps.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for formats whose texel size we do not know.
    pub fn mip_bytes(&self, mip: u32) -> Result<u64, GpuError> {
        let extent = self.mip_extent(mip);
        Ok(u64::from(extent.width) * u64::from(extent.height) * texel_size(self.format)?)
    }

    /// Identity for hazard tracking.
    pub fn id(&self) -> ResourceId {
        self.id
    }

    /// The device that it lives on.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The layout that a level will be in when the commands recorded so far have run.
    pub fn layout(&self, mip: u32) -> vk::ImageLayout {
        let layouts = self.layouts.lock().unwrap_or_else(PoisonError::into_inner);
        layouts.get(mip as usize).copied().unwrap_or_default()
    }

    /// Notes that recorded commands leave these levels in `layout` (a render pass of someone else's, for instance).
    pub fn set_layouts(&self, mips: std::ops::Range<u32>, layout: vk::ImageLayout) {
        let mut layouts = self.layouts.lock().unwrap_or_else(PoisonError::into_inner);
        for mip in mips {
            if let Some(slot) = layouts.get_mut(mip as usize) {
                *slot = layout;
            }
        }
    }

    /// Copies a level to the CPU and waits for it; the image is left in layout GENERAL. For tests and screenshots.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for a level that is not there, out of memory, device loss.
    pub fn read_back(&self, mip: u32) -> Result<Vec<u8>, GpuError> {
        let size = self.mip_bytes(mip)?;
        let target = Buffer::new(
            &self.device,
            "image readback",
            size,
            vk::BufferUsageFlags::empty(),
            MemoryKind::Readback,
        )?;
        self.device.submit_once("image readback", |cmd| {
            cmd.transition(self, Access::ComputeReadWrite, Access::TransferRead);
            cmd.copy_image_to_buffer(self, mip, &target, 0)?;
            cmd.transition(self, Access::TransferRead, Access::ComputeReadWrite);
            Ok(())
        })?;
        target.read()
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: the owner retires images only when the GPU is done with them; null handles are ignored.
        unsafe {
            for view in self.mip_views.drain(..) {
                self.device.raw().destroy_image_view(view, None);
            }
            self.device.raw().destroy_image_view(self.view, None);
            if self.owned {
                self.device.raw().destroy_image(self.raw, None);
            }
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}

/// The colour levels `first_mip .. first_mip + mips` of an image without layers.
pub(super) fn subresources(first_mip: u32, mips: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: first_mip,
        level_count: mips,
        base_array_layer: 0,
        layer_count: 1,
    }
}

/// One colour level of an image without layers, as copies name it.
pub(super) fn subresource_layer(mip: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: mip,
        base_array_layer: 0,
        layer_count: 1,
    }
}

fn check_support(device: &Device, desc: &ImageDesc<'_>, mips: u32, usage: vk::ImageUsageFlags) -> Result<(), GpuError> {
    let what = || {
        format!(
            "the image '{}' ({:?}, {}x{}, {mips} mip levels, for {usage:?})",
            desc.name, desc.format, desc.width, desc.height
        )
    };
    // SAFETY: the physical device belongs to the instance.
    let limits = unsafe {
        device.instance().raw().get_physical_device_image_format_properties(
            device.physical(),
            desc.format,
            vk::ImageType::TYPE_2D,
            vk::ImageTiling::OPTIMAL,
            usage,
            vk::ImageCreateFlags::empty(),
        )
    }
    .map_err(|result| match result {
        vk::Result::ERROR_FORMAT_NOT_SUPPORTED => GpuError::Unsupported(what()),
        result => GpuError::from_vulkan(&what(), result),
    })?;
    let fits = desc.width <= limits.max_extent.width
        && desc.height <= limits.max_extent.height
        && mips <= limits.max_mip_levels;
    if fits {
        Ok(())
    } else {
        Err(GpuError::Unsupported(what()))
    }
}
