//! A window's surface.

use std::sync::Arc;

use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::error::Context;
use super::{GpuError, Instance};

/// A window that keeps its handles valid while it lives.
trait WindowHandles: HasDisplayHandle + HasWindowHandle + Send + Sync {}

impl<W: HasDisplayHandle + HasWindowHandle + Send + Sync> WindowHandles for W {}

/// The part of a window that Vulkan presents to. Keeps the window alive; destroyed on drop.
pub struct Surface {
    raw: vk::SurfaceKHR,
    instance: Arc<Instance>,
    // After the surface is destroyed, since the surface refers to it.
    _window: Arc<dyn WindowHandles>,
}

impl Surface {
    /// Makes the surface of `window`. The instance must have been made with the window's display.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for an instance without a display, Vulkan's own.
    pub fn new<W>(instance: &Arc<Instance>, window: &Arc<W>) -> Result<Self, GpuError>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        if instance.surface_functions().is_none() {
            return Err(GpuError::InvalidInput(
                "a window needs an instance that was made for its display".into(),
            ));
        }
        let unavailable = |error| GpuError::InvalidInput(format!("the window gives no handle ({error})"));
        let display = window.display_handle().map_err(unavailable)?.as_raw();
        let handle = window.window_handle().map_err(unavailable)?.as_raw();
        // SAFETY: the window is kept alive beyond the surface, and the instance likewise.
        let raw = unsafe { ash_window::create_surface(instance.entry(), instance.raw(), display, handle, None) }
            .context("the creation of the window's surface")?;
        Ok(Self {
            raw,
            instance: instance.clone(),
            _window: window.clone(),
        })
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::SurfaceKHR {
        self.raw
    }

    /// Can this queue family of a device present to the surface? Errors count as no.
    pub(super) fn can_present(&self, device: vk::PhysicalDevice, queue_family: u32) -> bool {
        self.instance.surface_functions().is_some_and(|functions| {
            // SAFETY: device and surface belong to the same instance.
            unsafe { functions.get_physical_device_surface_support(device, queue_family, self.raw) }.unwrap_or(false)
        })
    }

    pub(super) fn capabilities(&self, device: vk::PhysicalDevice) -> Result<vk::SurfaceCapabilitiesKHR, GpuError> {
        // SAFETY: device and surface belong to the same instance.
        unsafe {
            self.functions()?
                .get_physical_device_surface_capabilities(device, self.raw)
        }
        .context("the query of the window's surface")
    }

    pub(super) fn formats(&self, device: vk::PhysicalDevice) -> Result<Vec<vk::SurfaceFormatKHR>, GpuError> {
        // SAFETY: as above.
        unsafe { self.functions()?.get_physical_device_surface_formats(device, self.raw) }
            .context("the query of the window's formats")
    }

    pub(super) fn present_modes(&self, device: vk::PhysicalDevice) -> Result<Vec<vk::PresentModeKHR>, GpuError> {
        // SAFETY: as above.
        unsafe {
            self.functions()?
                .get_physical_device_surface_present_modes(device, self.raw)
        }
        .context("the query of the window's present modes")
    }

    fn functions(&self) -> Result<&ash::khr::surface::Instance, GpuError> {
        self.instance
            .surface_functions()
            .ok_or_else(|| GpuError::InvalidInput("the instance has no window system".into()))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        if let Some(functions) = self.instance.surface_functions() {
            // SAFETY: swapchains hold an `Arc` of the surface, so none is left.
            unsafe { functions.destroy_surface(self.raw, None) };
        }
    }
}
