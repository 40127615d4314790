//! Using a device that another engine has opened.

use std::sync::{Arc, Mutex};

use ash::vk;

use super::device::Parts;
use super::{Device, GpuError, Instance, OptionalFeatures};

/// The handles of a device that belongs to someone else.
pub struct AdoptedHandles {
    /// The instance, see [`Instance::adopt`].
    pub instance: Arc<Instance>,
    /// The physical device that `device` was made from.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// A queue with compute. The owner shares this lock and holds it whenever it submits to the queue itself.
    pub queue: Arc<Mutex<vk::Queue>>,
    /// The queue's family.
    pub queue_family: u32,
    /// The optional features that were enabled when the device was created.
    pub enabled: OptionalFeatures,
    /// Was VK_KHR_swapchain enabled?
    pub swapchain: bool,
}

impl Device {
    /// Wraps a device that belongs to another engine; neither it nor its instance is destroyed on drop.
    ///
    /// # Safety
    /// The handles belong together and outlive everything made from the returned device. The device was created with
    /// the features that [`super::DeviceReport`] lists as needed for the `bvh` backend, and, if
    /// `handles.enabled.ray_query`, with VK_KHR_acceleration_structure and VK_KHR_ray_query and their features.
    ///
    /// # Errors
    /// [`GpuError::MissingFeature`] if the physical device lacks what was promised.
    pub unsafe fn adopt(handles: AdoptedHandles) -> Result<Arc<Self>, GpuError> {
        let AdoptedHandles {
            instance,
            physical_device,
            device,
            queue,
            queue_family,
            enabled,
            swapchain,
        } = handles;
        let report = super::DeviceReport::query(&instance, 0, physical_device)?;
        let missing = if enabled.ray_query {
            &report.missing_for_rayquery
        } else {
            &report.missing_for_bvh
        };
        if !missing.is_empty() {
            return Err(GpuError::MissingFeature {
                device: format!("the adopted Vulkan device '{}'", report.name),
                missing: missing.join(", "),
            });
        }
        Self::from_parts(Parts {
            instance,
            report,
            raw: device,
            queue,
            queue_family,
            enabled,
            swapchain,
            owned: false,
        })
    }
}
