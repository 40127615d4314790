//! Showing rendered images in a window.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{Access, Commands, Device, GpuError, Image, ImageDesc, SubmitSync, Surface};

/// Longest wait for the window system to hand out an image; hidden windows may never get one.
const ACQUIRE_TIMEOUT_NS: u64 = 1_000_000_000;

/// When a finished image replaces the one on screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PresentMode {
    /// At the display's refresh, without tearing. Always there.
    #[default]
    Vsync,
    /// As soon as possible; like `Vsync` where the system offers nothing faster.
    Immediate,
}

/// An image to render to, from [`Swapchain::acquire`]. It must be submitted with [`Self::sync`] and presented.
#[derive(Clone, Copy, Debug)]
#[must_use = "an acquired image must be presented"]
pub struct Acquired {
    /// Position among the swapchain's images.
    pub index: u32,
    available: vk::Semaphore,
    rendered: vk::Semaphore,
}

impl Acquired {
    /// What the submission that draws to the image waits for and signals.
    pub fn sync(&self) -> SubmitSync {
        // These are the stages at which the image is first touched (see `Swapchain::record_blit`).
        let stages = vk::PipelineStageFlags::TRANSFER | vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
        SubmitSync {
            wait: Some((self.available, stages)),
            signal: Some(self.rendered),
        }
    }
}

/// The images of a window. Made anew by itself when the window changes; waits for the GPU on drop.
pub struct Swapchain {
    device: Arc<Device>,
    surface: Arc<Surface>,
    raw: vk::SwapchainKHR,
    images: Vec<Image>,
    /// One per frame in flight.
    available: Vec<vk::Semaphore>,
    /// One per image, since only the return of an image says that its presentation has used the semaphore.
    rendered: Vec<vk::Semaphore>,
    format: vk::SurfaceFormatKHR,
    extent: vk::Extent2D,
    wanted_extent: vk::Extent2D,
    mode: PresentMode,
    frames: usize,
    stale: bool,
    renewed: bool,
}

impl Swapchain {
    /// Makes the images of `surface`. `width` and `height` (pixels) count only where the window system leaves the
    /// choice to us; `frames` is the number of frames in flight.
    ///
    /// # Errors
    /// [`GpuError::MissingFeature`] if the device was opened without a surface, [`GpuError::Unsupported`] if the
    /// surface cannot be copied to, Vulkan's own.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        width: u32,
        height: u32,
        mode: PresentMode,
        frames: usize,
    ) -> Result<Self, GpuError> {
        device.swapchain()?;
        let mut swapchain = Self {
            device: device.clone(),
            surface: surface.clone(),
            raw: vk::SwapchainKHR::null(),
            images: Vec::new(),
            available: Vec::new(),
            rendered: Vec::new(),
            format: choose_format(&surface.formats(device.physical())?)?,
            extent: vk::Extent2D::default(),
            wanted_extent: vk::Extent2D { width, height },
            mode,
            frames: frames.max(1),
            stale: true,
            renewed: false,
        };
        swapchain.recreate()?;
        Ok(swapchain)
    }

    /// Tells the window's new size in pixels; 0 by 0 for a minimised window.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.wanted_extent = vk::Extent2D { width, height };
        self.stale = true;
    }

    /// Changes when images are shown.
    pub fn set_mode(&mut self, mode: PresentMode) {
        self.stale |= self.mode != mode;
        self.mode = mode;
    }

    /// Whether the images were made anew since the last call: what was made from the old ones is of no use any more.
    pub fn take_renewed(&mut self) -> bool {
        std::mem::take(&mut self.renewed)
    }

    /// Size of the images in pixels.
    pub fn extent(&self) -> vk::Extent2D {
        self.extent
    }

    /// Format of the images.
    pub fn format(&self) -> vk::Format {
        self.format.format
    }

    /// The image of an acquisition, for drawing an overlay.
    pub fn image(&self, acquired: &Acquired) -> Option<&Image> {
        self.images.get(acquired.index as usize)
    }

    /// Gets the next image; `slot` is [`super::Frame::slot`] of the frame that will draw to it. `None` when there is
    /// nothing to draw to now (minimised, hidden, or just changing): skip the frame and try again later.
    ///
    /// # Errors
    /// Device or surface loss, out of memory.
    pub fn acquire(&mut self, slot: usize) -> Result<Option<Acquired>, GpuError> {
        // A window can change again between making the images and getting one, but not for ever.
        for _ in 0..3 {
            if self.stale && !self.recreate()? {
                return Ok(None);
            }
            let available = self.available[slot % self.frames];
            // SAFETY: the slot's earlier frame is done, so its semaphore is free.
            let result = unsafe {
                let functions = self.device.swapchain()?;
                functions.acquire_next_image(self.raw, ACQUIRE_TIMEOUT_NS, available, vk::Fence::null())
            };
            match result {
                Ok((index, suboptimal)) => {
                    self.stale = suboptimal;
                    let (Some(image), Some(&rendered)) =
                        (self.images.get(index as usize), self.rendered.get(index as usize))
                    else {
                        return Err(GpuError::Unsupported("a window image within the range it named".into()));
                    };
                    // What was shown before is not needed.
                    image.set_layouts(0..1, vk::ImageLayout::UNDEFINED);
                    return Ok(Some(Acquired {
                        index,
                        available,
                        rendered,
                    }));
                }
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.stale = true,
                Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
                Err(result) => return Err(GpuError::from_vulkan("the wait for a window image", result)),
            }
        }
        Ok(None)
    }

    /// Records scaling `source` (in the layout of [`Access::TransferRead`]) onto the acquired image, and leaves that
    /// ready for `after`: [`Access::Present`], or [`Access::ColorWrite`] for an overlay.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for an acquisition of an earlier swapchain.
    pub fn record_blit(
        &self,
        cmd: &Commands<'_>,
        source: &Image,
        acquired: &Acquired,
        after: Access,
    ) -> Result<(), GpuError> {
        let target = self
            .image(acquired)
            .ok_or_else(|| GpuError::InvalidInput("a window image that is no longer there".into()))?;
        // The first stage is the one at which the submission waits for the image.
        cmd.transition(target, Access::TransferWrite, Access::TransferWrite);
        cmd.blit(source, 0, target, 0)?;
        cmd.transition(target, Access::TransferWrite, after);
        Ok(())
    }

    /// Shows the image once the submission with its [`Acquired::sync`] has run. It must be in the layout of
    /// [`Access::Present`].
    ///
    /// # Errors
    /// Device or surface loss, out of memory. A window that has changed is no error.
    pub fn present(&mut self, acquired: Acquired) -> Result<(), GpuError> {
        let (waits, swapchains, indices) = ([acquired.rendered], [self.raw], [acquired.index]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&swapchains)
            .image_indices(&indices);
        let queue = self.device.queue();
        // SAFETY: the queue is locked; the image was acquired and its submission signals the semaphore.
        match unsafe { self.device.swapchain()?.queue_present(*queue, &info) } {
            Ok(suboptimal) => self.stale |= suboptimal,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.stale = true,
            Err(result) => return Err(GpuError::from_vulkan("the presentation", result)),
        }
        Ok(())
    }

    /// Makes the images anew for the window as it is now. False if it has no area; the old images are kept then.
    fn recreate(&mut self) -> Result<bool, GpuError> {
        let what = "the creation of the window images";
        let physical = self.device.physical();
        let capabilities = self.surface.capabilities(physical)?;
        let extent = choose_extent(&capabilities, self.wanted_extent);
        if extent.width == 0 || extent.height == 0 {
            return Ok(false);
        }
        if !capabilities
            .supported_usage_flags
            .contains(vk::ImageUsageFlags::TRANSFER_DST)
        {
            return Err(GpuError::Unsupported("window images that can be copied to".into()));
        }
        // Nobody may use the old images and semaphores any more.
        self.device.wait_idle()?;
        let optional = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let usage = vk::ImageUsageFlags::TRANSFER_DST | (capabilities.supported_usage_flags & optional);
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.raw())
            .min_image_count(choose_image_count(
                capabilities.min_image_count,
                capabilities.max_image_count,
            ))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(choose_alpha(capabilities.supported_composite_alpha))
            .present_mode(choose_mode(self.mode, &self.surface.present_modes(physical)?))
            .clipped(true)
            .old_swapchain(self.raw);
        let functions = self.device.swapchain()?;
        // SAFETY: all choices are from what the surface offers.
        let raw = unsafe { functions.create_swapchain(&info, None) };
        // The old one is retired even if that failed.
        self.destroy_images();
        self.raw = raw.context(what)?;
        // SAFETY: the swapchain is alive.
        let images = unsafe { self.device.swapchain()?.get_swapchain_images(self.raw) }.context(what)?;
        let desc = ImageDesc {
            name: "window image",
            format: self.format.format,
            width: extent.width,
            height: extent.height,
            mips: 1,
            usage,
        };
        for image in images {
            // SAFETY: the image belongs to the swapchain, which is destroyed after it.
            let image = unsafe { Image::from_raw(&self.device, image, &desc, vk::ImageLayout::UNDEFINED) }?;
            self.images.push(image);
        }
        self.available = self.semaphores(self.frames)?;
        self.rendered = self.semaphores(self.images.len())?;
        self.extent = extent;
        self.stale = false;
        self.renewed = true;
        Ok(true)
    }

    fn semaphores(&self, count: usize) -> Result<Vec<vk::Semaphore>, GpuError> {
        let info = vk::SemaphoreCreateInfo::default();
        let mut made = Vec::with_capacity(count);
        for _ in 0..count {
            // SAFETY: `info` is complete.
            match unsafe { self.device.raw().create_semaphore(&info, None) } {
                Ok(semaphore) => made.push(semaphore),
                Err(result) => {
                    self.destroy_semaphores(&mut made);
                    return Err(GpuError::from_vulkan("the creation of semaphores", result));
                }
            }
        }
        Ok(made)
    }

    fn destroy_semaphores(&self, semaphores: &mut Vec<vk::Semaphore>) {
        for semaphore in semaphores.drain(..) {
            // SAFETY: the device was waited for, or the semaphore was never used.
            unsafe { self.device.raw().destroy_semaphore(semaphore, None) };
        }
    }

    /// Only after waiting for the device.
    fn destroy_images(&mut self) {
        self.images.clear();
        let (mut available, mut rendered) = (std::mem::take(&mut self.available), std::mem::take(&mut self.rendered));
        self.destroy_semaphores(&mut available);
        self.destroy_semaphores(&mut rendered);
        if let Ok(functions) = self.device.swapchain() {
            // SAFETY: the device was waited for; a null handle is ignored.
            unsafe { functions.destroy_swapchain(self.raw, None) };
        }
        self.raw = vk::SwapchainKHR::null();
        // Until the images are made again there is nothing to acquire.
        self.stale = true;
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        if let Err(error) = self.device.wait_idle() {
            tracing::warn!("{error}");
        }
        self.destroy_images();
    }
}

/// We encode to sRGB ourselves, so the image must store values as they are.
fn choose_format(formats: &[vk::SurfaceFormatKHR]) -> Result<vk::SurfaceFormatKHR, GpuError> {
    let preferred = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
    let find = |wanted: vk::Format| {
        let fits = |f: &&vk::SurfaceFormatKHR| f.format == wanted && f.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR;
        formats.iter().find(fits).copied()
    };
    // "Undefined" as the only entry means that every format will do.
    let anything = vk::SurfaceFormatKHR {
        format: preferred[0],
        color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR,
    };
    match formats {
        [] => Err(GpuError::Unsupported("a format for this window".into())),
        [only] if only.format == vk::Format::UNDEFINED => Ok(anything),
        [first, ..] => Ok(preferred.into_iter().find_map(find).unwrap_or(*first)),
    }
}

fn choose_mode(wanted: PresentMode, available: &[vk::PresentModeKHR]) -> vk::PresentModeKHR {
    let preferred: &[vk::PresentModeKHR] = match wanted {
        PresentMode::Vsync => &[],
        PresentMode::Immediate => &[vk::PresentModeKHR::MAILBOX, vk::PresentModeKHR::IMMEDIATE],
    };
    let found = preferred.iter().copied().find(|mode| available.contains(mode));
    found.unwrap_or(vk::PresentModeKHR::FIFO)
}

/// One more than the least, so that we need not wait for the display; `max` 0 means no limit.
fn choose_image_count(min: u32, max: u32) -> u32 {
    let wanted = min.saturating_add(1);
    if max == 0 { wanted } else { wanted.min(max) }
}

fn choose_extent(capabilities: &vk::SurfaceCapabilitiesKHR, wanted: vk::Extent2D) -> vk::Extent2D {
    if wanted.width == 0 || wanted.height == 0 {
        return vk::Extent2D::default();
    }
    // This value says that the window takes the size of its images.
    if capabilities.current_extent.width != u32::MAX {
        return capabilities.current_extent;
    }
    let (min, max) = (capabilities.min_image_extent, capabilities.max_image_extent);
    // Not `clamp`, which panics when a driver names limits the wrong way round.
    vk::Extent2D {
        width: wanted.width.min(max.width).max(min.width),
        height: wanted.height.min(max.height).max(min.height),
    }
}

fn choose_alpha(supported: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    use vk::CompositeAlphaFlagsKHR as F;
    let preferred = [F::OPAQUE, F::INHERIT, F::PRE_MULTIPLIED, F::POST_MULTIPLIED];
    preferred
        .into_iter()
        .find(|flag| supported.contains(*flag))
        .unwrap_or(F::OPAQUE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_limit_on_images_is_no_limit() {
        assert_eq!(choose_image_count(2, 0), 3);
        assert_eq!(choose_image_count(2, 2), 2);
        assert_eq!(choose_image_count(2, 8), 3);
    }

    #[test]
    fn formats_without_encoding_are_preferred() {
        let format = |format| vk::SurfaceFormatKHR {
            format,
            color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR,
        };
        let srgb = format(vk::Format::B8G8R8A8_SRGB);
        let plain = format(vk::Format::R8G8B8A8_UNORM);
        assert_eq!(choose_format(&[srgb, plain]).unwrap(), plain);
        assert_eq!(choose_format(&[srgb]).unwrap(), srgb);
        assert_eq!(
            choose_format(&[format(vk::Format::UNDEFINED)]).unwrap().format,
            vk::Format::B8G8R8A8_UNORM
        );
        assert!(choose_format(&[]).is_err());
    }

    #[test]
    fn fifo_is_the_fall_back() {
        let all = [
            vk::PresentModeKHR::FIFO,
            vk::PresentModeKHR::IMMEDIATE,
            vk::PresentModeKHR::MAILBOX,
        ];
        assert_eq!(choose_mode(PresentMode::Immediate, &all), vk::PresentModeKHR::MAILBOX);
        assert_eq!(
            choose_mode(PresentMode::Immediate, &all[..2]),
            vk::PresentModeKHR::IMMEDIATE
        );
        assert_eq!(choose_mode(PresentMode::Immediate, &all[..1]), vk::PresentModeKHR::FIFO);
        assert_eq!(choose_mode(PresentMode::Vsync, &all), vk::PresentModeKHR::FIFO);
    }

    #[test]
    fn the_window_decides_the_size_if_it_wants() {
        let size = |width, height| vk::Extent2D { width, height };
        let fixed = vk::SurfaceCapabilitiesKHR {
            current_extent: size(0, 0),
            ..Default::default()
        };
        assert_eq!(choose_extent(&fixed, size(640, 480)), size(0, 0));
        let fixed = vk::SurfaceCapabilitiesKHR {
            current_extent: size(30, 20),
            ..Default::default()
        };
        assert_eq!(choose_extent(&fixed, size(640, 480)), size(30, 20));
        assert_eq!(choose_extent(&fixed, size(0, 0)), size(0, 0), "minimised");
        let free = vk::SurfaceCapabilitiesKHR {
            current_extent: size(u32::MAX, u32::MAX),
            min_image_extent: size(10, 10),
            max_image_extent: size(500, 500),
            ..Default::default()
        };
        assert_eq!(choose_extent(&free, size(640, 2)), size(500, 10));
        assert_eq!(choose_extent(&free, size(0, 480)), size(0, 0), "minimised");
    }
}
