//! The opened device: queue, memory allocator, limits, and debug names.

use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings, MemoryLocation};

use super::error::Context;
use super::select::select;
use super::{DeviceReport, DeviceRequest, GpuError, Instance, OptionalFeatures, RayQueryUse, ResourceId, Surface};

/// Who the device is.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// The device's name.
    pub name: String,
    /// Driver name and version in the driver's own words.
    pub driver: String,
    /// Discrete, integrated, virtual or CPU.
    pub device_type: vk::PhysicalDeviceType,
    /// Vulkan version as `major.minor.patch`.
    pub api_version: String,
    /// Optional features that are enabled.
    pub enabled: OptionalFeatures,
}

/// The device's limits that matter to us. Sizes and alignments in bytes.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most invocations in one compute work group (at least 128).
    pub max_work_group_invocations: u32,
    /// Most work groups of one dispatch, per axis.
    pub max_work_group_count: [u32; 3],
    /// Shared memory of one work group.
    pub max_shared_memory: u32,
    /// Push constants of one pipeline (at least 128).
    pub max_push_constants: u32,
    /// Largest width and height of an image, texels.
    pub max_image_dimension: u32,
    /// Most textures that one stage can see in all its sets together.
    pub max_sampled_images_per_stage: u32,
    /// Highest anisotropy of a sampler.
    pub max_anisotropy: f32,
    /// Invocations of one subgroup.
    pub subgroup_size: u32,
    /// Alignment of storage buffer offsets in descriptors.
    pub min_storage_offset_alignment: u64,
    /// Nanoseconds per timestamp tick.
    pub timestamp_period_ns: f32,
    /// Meaningful low bits of a timestamp; 0 when the queue has none.
    pub timestamp_valid_bits: u32,
    /// Alignment of scratch addresses for acceleration structure builds; 1 without ray query.
    pub scratch_alignment: u64,
    /// Most instances of a top-level acceleration structure; 0 without ray query.
    pub max_instances: u64,
}

/// An opened Vulkan device with one queue for compute, and for presentation when a surface was given.
///
/// All objects made from it hold an `Arc` of it. Waits for the GPU and is destroyed on drop, unless adopted.
pub struct Device {
    raw: ash::Device,
    allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    queue: Arc<Mutex<vk::Queue>>,
    queue_family: u32,
    physical: vk::PhysicalDevice,
    info: DeviceInfo,
    limits: Limits,
    acceleration: Option<khr::acceleration_structure::Device>,
    swapchain: Option<khr::swapchain::Device>,
    debug: Option<ext::debug_utils::Device>,
    next_id: AtomicU64,
    owned: bool,
    // Last, so that it is dropped after everything that uses it.
    instance: Arc<Instance>,
}

/// What both ways of getting a device (opening and adopting) bring together.
pub(super) struct Parts {
    pub instance: Arc<Instance>,
    pub report: DeviceReport,
    pub raw: ash::Device,
    pub queue: Arc<Mutex<vk::Queue>>,
    pub queue_family: u32,
    pub enabled: OptionalFeatures,
    pub swapchain: bool,
    pub owned: bool,
}

impl Device {
    /// Opens the device that `request` asks for and enables what exists of the features we use.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`], [`GpuError::NoSuchDevice`], [`GpuError::MissingFeature`] naming what is missing, or
    /// Vulkan's own errors.
    pub fn new(instance: &Arc<Instance>, request: &DeviceRequest<'_>) -> Result<Arc<Self>, GpuError> {
        let reports = instance.devices()?;
        let family_of = |report: &DeviceReport| find_queue_family(instance, report, request.surface);
        let report = select(&reports, &request.choice, request.ray_query, |report| {
            family_of(report).is_some()
        })?;
        let queue_family = family_of(report).ok_or_else(|| GpuError::MissingFeature {
            device: format!("the Vulkan device '{}'", report.name),
            missing: "a queue that can compute and present".into(),
        })?;
        let mut enabled = report.optional;
        enabled.ray_query &= request.ray_query != RayQueryUse::Never;
        let swapchain = request.surface.is_some();
        let raw = open(instance, report, queue_family, &enabled, swapchain)?;
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        Self::from_parts(Parts {
            instance: instance.clone(),
            report: report.clone(),
            raw,
            queue: Arc::new(Mutex::new(queue)),
            queue_family,
            enabled,
            swapchain,
            owned: true,
        })
    }

    pub(super) fn from_parts(parts: Parts) -> Result<Arc<Self>, GpuError> {
        let Parts {
            instance,
            report,
            raw,
            queue,
            queue_family,
            enabled,
            swapchain,
            owned,
        } = parts;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw().clone(),
            device: raw.clone(),
            physical_device: report.raw,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: true,
            allocation_sizes: AllocationSizes::new(64 << 20, 32 << 20).with_max_device_memblock_size(256 << 20),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(error) => {
                if owned {
                    // SAFETY: nothing was made from the device yet.
                    unsafe { raw.destroy_device(None) };
                }
                return Err(GpuError::from_allocation("the memory allocator", &error));
            }
        };
        let limits = query_limits(&instance, report.raw, queue_family, enabled.ray_query);
        let device = Self {
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            queue,
            queue_family,
            physical: report.raw,
            limits,
            acceleration: enabled
                .ray_query
                .then(|| khr::acceleration_structure::Device::new(instance.raw(), &raw)),
            swapchain: swapchain.then(|| khr::swapchain::Device::new(instance.raw(), &raw)),
            debug: instance
                .has_debug_utils()
                .then(|| ext::debug_utils::Device::new(instance.raw(), &raw)),
            next_id: AtomicU64::new(1),
            info: DeviceInfo {
                name: report.name,
                driver: report.driver,
                device_type: report.device_type,
                api_version: report.api_version,
                enabled,
            },
            owned,
            raw,
            instance,
        };
        Ok(Arc::new(device))
    }

    /// The device's functions.
    pub fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// The instance that the device belongs to.
    pub fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// Vulkan's handle of the physical device.
    pub fn physical(&self) -> vk::PhysicalDevice {
        self.physical
    }

    /// The queue, locked for submission. Hold the lock only while calling Vulkan with it.
    pub fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Index of the queue's family.
    pub fn queue_family(&self) -> u32 {
        self.queue_family
    }

    /// Name, driver and type.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// The limits that matter to us.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Are acceleration structures and ray queries enabled?
    pub fn has_ray_query(&self) -> bool {
        self.acceleration.is_some()
    }

    /// Waits until the GPU has done all that was submitted.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] and out of memory.
    pub fn wait_idle(&self) -> Result<(), GpuError> {
        let _queue = self.queue();
        // SAFETY: the lock keeps other threads from submitting meanwhile, as Vulkan demands.
        unsafe { self.raw.device_wait_idle() }.context("the wait for the GPU")
    }

    /// Gives a Vulkan object the name that debuggers and validation messages show.
    pub fn set_name(&self, handle: impl vk::Handle, name: &str) {
        let (Some(debug), Ok(name)) = (&self.debug, std::ffi::CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        // SAFETY: the handle is alive, since its owner calls this. A name that does not stick is no error.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    pub(super) fn debug(&self) -> Option<&ext::debug_utils::Device> {
        self.debug.as_ref()
    }

    pub(super) fn acceleration(&self) -> Result<&khr::acceleration_structure::Device, GpuError> {
        self.acceleration.as_ref().ok_or_else(|| GpuError::MissingFeature {
            device: format!("the Vulkan device '{}' as opened", self.info.name),
            missing: "VK_KHR_acceleration_structure".into(),
        })
    }

    pub(super) fn swapchain(&self) -> Result<&khr::swapchain::Device, GpuError> {
        self.swapchain.as_ref().ok_or_else(|| GpuError::MissingFeature {
            device: format!("the Vulkan device '{}' as opened", self.info.name),
            missing: "VK_KHR_swapchain".into(),
        })
    }

    /// An identity for a resource, never used twice on this device.
    pub fn new_resource_id(&self) -> ResourceId {
        ResourceId::new(self.next_id.fetch_add(1, Ordering::Relaxed))
    }

    /// The memory allocator, for libraries that bring their own objects. Whoever keeps it keeps the device, too, and longer.
    pub fn allocator(&self) -> Arc<Mutex<Allocator>> {
        Arc::clone(&self.allocator)
    }

    pub(super) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, GpuError> {
        let request = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        allocator
            .allocate(&request)
            .map_err(|error| GpuError::from_allocation(name, &error))
    }

    pub(super) fn free(&self, allocation: Allocation) {
        let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = allocator.free(allocation) {
            tracing::warn!("GPU memory could not be freed: {error}");
        }
    }

    /// Bytes of GPU memory in use.
    pub fn memory_allocated(&self) -> u64 {
        let allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        allocator.generate_report().total_allocated_bytes
    }

    /// Bytes of GPU memory taken from the driver so far.
    pub fn memory_reserved(&self) -> u64 {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner).capacity()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if let Err(error) = self.wait_idle() {
            tracing::warn!("{error}");
        }
        // SAFETY: all objects hold an `Arc` of this device, so none is left; the allocator is dropped exactly once,
        // before the device whose memory it frees.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            if self.owned {
                self.raw.destroy_device(None);
            }
        }
    }
}

/// A family with compute, preferably graphics as well; one that can present to `surface` if there is one.
fn find_queue_family(instance: &Instance, report: &DeviceReport, surface: Option<&Surface>) -> Option<u32> {
    // SAFETY: the physical device belongs to the instance.
    let families = unsafe { instance.raw().get_physical_device_queue_family_properties(report.raw) };
    let usable = |index: u32, family: &vk::QueueFamilyProperties| {
        family.queue_flags.contains(vk::QueueFlags::COMPUTE)
            && surface.is_none_or(|surface| {
                report.has_extension(khr::swapchain::NAME) && surface.can_present(report.raw, index)
            })
    };
    (0u32..)
        .zip(&families)
        .filter(|(index, family)| usable(*index, family))
        .max_by_key(|(index, family)| {
            (
                family.queue_flags.contains(vk::QueueFlags::GRAPHICS),
                std::cmp::Reverse(*index),
            )
        })
        .map(|(index, _)| index)
}

fn open(
    instance: &Instance,
    report: &DeviceReport,
    queue_family: u32,
    enabled: &OptionalFeatures,
    swapchain: bool,
) -> Result<ash::Device, GpuError> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(queue_family)
        .queue_priorities(&priorities)];
    let extensions: Vec<_> = report
        .wanted_extensions(enabled.ray_query, swapchain)
        .iter()
        .map(|name| name.as_ptr())
        .collect();
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .buffer_device_address(true)
        .scalar_block_layout(true)
        .shader_sampled_image_array_non_uniform_indexing(true)
        .runtime_descriptor_array(true)
        .descriptor_binding_partially_bound(true)
        .descriptor_binding_variable_descriptor_count(true)
        .shader_float16(enabled.shader_float16);
    let mut acceleration = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
    let mut ray_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let v10 = vk::PhysicalDeviceFeatures::default()
        .shader_int64(enabled.shader_int64)
        .shader_storage_image_extended_formats(enabled.storage_image_extended_formats)
        .sampler_anisotropy(enabled.sampler_anisotropy);
    let mut features = vk::PhysicalDeviceFeatures2::default().features(v10).push_next(&mut v12);
    if enabled.ray_query {
        features = features.push_next(&mut acceleration).push_next(&mut ray_query);
    }
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .push_next(&mut features);
    // SAFETY: everything enabled was reported as present; `info` lives through the call.
    unsafe { instance.raw().create_device(report.raw, &info, None) }.map_err(|result| match result {
        vk::Result::ERROR_FEATURE_NOT_PRESENT | vk::Result::ERROR_EXTENSION_NOT_PRESENT => GpuError::MissingFeature {
            device: format!("the Vulkan device '{}'", report.name),
            missing: "a feature that its driver claims to have".into(),
        },
        result => GpuError::from_vulkan(&format!("the opening of '{}'", report.name), result),
    })
}

fn query_limits(instance: &Instance, physical: vk::PhysicalDevice, queue_family: u32, ray_query: bool) -> Limits {
    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut acceleration = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut v11);
    if ray_query {
        properties = properties.push_next(&mut acceleration);
    }
    // SAFETY: the device is of version 1.2 and has the extension of the structure chained.
    let families = unsafe {
        instance
            .raw()
            .get_physical_device_properties2(physical, &mut properties);
        instance.raw().get_physical_device_queue_family_properties(physical)
    };
    let limits = properties.properties.limits;
    Limits {
        max_work_group_invocations: limits.max_compute_work_group_invocations,
        max_work_group_count: limits.max_compute_work_group_count,
        max_shared_memory: limits.max_compute_shared_memory_size,
        max_push_constants: limits.max_push_constants_size,
        max_image_dimension: limits.max_image_dimension2_d,
        max_sampled_images_per_stage: limits
            .max_per_stage_descriptor_sampled_images
            .min(limits.max_per_stage_descriptor_samplers),
        max_anisotropy: limits.max_sampler_anisotropy,
        subgroup_size: v11.subgroup_size,
        min_storage_offset_alignment: limits.min_storage_buffer_offset_alignment,
        timestamp_period_ns: limits.timestamp_period,
        timestamp_valid_bits: families
            .get(queue_family as usize)
            .map_or(0, |family| family.timestamp_valid_bits),
        scratch_alignment: u64::from(acceleration.min_acceleration_structure_scratch_offset_alignment).max(1),
        max_instances: acceleration.max_instance_count,
    }
}
