//! What each Vulkan device can do, and by name what it lacks for each tracing backend.

use std::ffi::{CStr, CString};
use std::fmt;

use ash::{khr, vk};

use super::error::Context;
use super::instance::API_VERSION;
use super::{GpuError, Instance};

/// Features that we use where they exist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OptionalFeatures {
    /// 64-bit integers in shaders.
    pub shader_int64: bool,
    /// 16-bit floats in shader arithmetic.
    pub shader_float16: bool,
    /// Storage images of formats such as rg16f and r32ui beyond the basic ones.
    pub storage_image_extended_formats: bool,
    /// Anisotropic filtering.
    pub sampler_anisotropy: bool,
    /// VK_KHR_ray_query with acceleration structures.
    pub ray_query: bool,
}

/// One Vulkan device as found, before it is opened.
#[derive(Clone, Debug)]
pub struct DeviceReport {
    /// Position in Vulkan's list; what `--device INDEX` means.
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// Driver name and version in the driver's own words.
    pub driver: String,
    /// Discrete, integrated, virtual or CPU.
    pub device_type: vk::PhysicalDeviceType,
    /// Vulkan version as `major.minor.patch`.
    pub api_version: String,
    /// Names of what is missing for our own traversal (`bvh`); empty means usable.
    pub missing_for_bvh: Vec<String>,
    /// Names of what is missing for hardware ray queries (`rayquery`), including all of the above; empty means usable.
    pub missing_for_rayquery: Vec<String>,
    /// What is there beyond the required.
    pub optional: OptionalFeatures,
    pub(super) raw: vk::PhysicalDevice,
    pub(super) extensions: Vec<CString>,
}

impl DeviceReport {
    /// Can the `bvh` backend run on it?
    pub fn supports_bvh(&self) -> bool {
        self.missing_for_bvh.is_empty()
    }

    /// Can the `rayquery` backend run on it?
    pub fn supports_rayquery(&self) -> bool {
        self.missing_for_rayquery.is_empty()
    }

    pub(super) fn has_extension(&self, name: &CStr) -> bool {
        self.extensions.iter().any(|have| have.as_c_str() == name)
    }

    pub(super) fn query(instance: &Instance, index: usize, raw: vk::PhysicalDevice) -> Result<Self, GpuError> {
        let vk_instance = instance.raw();
        // SAFETY: `raw` comes from this instance.
        let properties = unsafe { vk_instance.get_physical_device_properties(raw) };
        let version = properties.api_version;
        let name = text(properties.device_name_as_c_str());
        // SAFETY: as above.
        let extensions = unsafe { vk_instance.enumerate_device_extension_properties(raw) }
            .context(&format!("the listing of the extensions of {name}"))?
            .iter()
            .filter_map(|p| p.extension_name_as_c_str().ok().map(CStr::to_owned))
            .collect();
        let mut report = Self {
            index,
            name,
            driver: String::new(),
            device_type: properties.device_type,
            api_version: format!(
                "{}.{}.{}",
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version)
            ),
            missing_for_bvh: Vec::new(),
            missing_for_rayquery: Vec::new(),
            optional: OptionalFeatures::default(),
            raw,
            extensions,
        };
        if version < API_VERSION {
            // The queries below are themselves part of Vulkan 1.2.
            report.driver = format!("version {:#x}", properties.driver_version);
            report.missing_for_bvh.push("Vulkan 1.2".into());
            report.missing_for_rayquery.push("Vulkan 1.2".into());
        } else {
            report.query_driver(instance);
            report.query_features(instance);
        }
        Ok(report)
    }

    fn query_driver(&mut self, instance: &Instance) {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the device is of version 1.2, which knows these structures.
        unsafe {
            instance
                .raw()
                .get_physical_device_properties2(self.raw, &mut properties)
        };
        let (name, info) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
        self.driver = format!("{name} {info}").trim().to_owned();
    }

    fn query_features(&mut self, instance: &Instance) {
        let ray_extensions = [
            khr::acceleration_structure::NAME,
            khr::ray_query::NAME,
            khr::deferred_host_operations::NAME,
        ];
        let missing_extensions: Vec<String> = ray_extensions
            .iter()
            .filter(|name| !self.has_extension(name))
            .map(|name| name.to_string_lossy().into_owned())
            .collect();
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut acceleration = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut ray_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12);
        if missing_extensions.is_empty() {
            features = features.push_next(&mut acceleration).push_next(&mut ray_query);
        }
        // SAFETY: the device is of version 1.2 and has the extensions of the structures chained.
        unsafe { instance.raw().get_physical_device_features2(self.raw, &mut features) };
        let v10 = features.features;

        let lacking = |list: &[(vk::Bool32, &str)]| -> Vec<String> {
            list.iter()
                .filter(|(have, _)| *have == vk::FALSE)
                .map(|(_, name)| (*name).to_owned())
                .collect()
        };
        self.missing_for_bvh = lacking(&[
            (v12.buffer_device_address, "bufferDeviceAddress"),
            (v12.scalar_block_layout, "scalarBlockLayout"),
            (
                v12.shader_sampled_image_array_non_uniform_indexing,
                "shaderSampledImageArrayNonUniformIndexing",
            ),
            (v12.runtime_descriptor_array, "runtimeDescriptorArray"),
            (
                v12.descriptor_binding_partially_bound,
                "descriptorBindingPartiallyBound",
            ),
            (
                v12.descriptor_binding_variable_descriptor_count,
                "descriptorBindingVariableDescriptorCount",
            ),
        ]);
        // SAFETY: `raw` comes from this instance.
        let families = unsafe { instance.raw().get_physical_device_queue_family_properties(self.raw) };
        if !families
            .iter()
            .any(|family| family.queue_flags.contains(vk::QueueFlags::COMPUTE))
        {
            self.missing_for_bvh.push("a queue that can compute".into());
        }
        let ray_features_missing = if missing_extensions.is_empty() {
            lacking(&[
                (acceleration.acceleration_structure, "accelerationStructure"),
                (ray_query.ray_query, "rayQuery"),
            ])
        } else {
            missing_extensions
        };
        self.missing_for_rayquery = self
            .missing_for_bvh
            .iter()
            .cloned()
            .chain(ray_features_missing)
            .collect();
        self.optional = OptionalFeatures {
            shader_int64: v10.shader_int64 == vk::TRUE,
            shader_float16: v12.shader_float16 == vk::TRUE,
            storage_image_extended_formats: v10.shader_storage_image_extended_formats == vk::TRUE,
            sampler_anisotropy: v10.sampler_anisotropy == vk::TRUE,
            ray_query: self.missing_for_rayquery.is_empty(),
        };
    }

    /// The device extensions to enable. A portability device obliges us to name its subset.
    pub(super) fn wanted_extensions(&self, ray_query: bool, swapchain: bool) -> Vec<&'static CStr> {
        let mut wanted = Vec::new();
        if swapchain {
            wanted.push(khr::swapchain::NAME);
        }
        if ray_query {
            wanted.extend([
                khr::acceleration_structure::NAME,
                khr::ray_query::NAME,
                khr::deferred_host_operations::NAME,
            ]);
        }
        if self.has_extension(khr::portability_subset::NAME) {
            wanted.push(khr::portability_subset::NAME);
        }
        wanted
    }
}

impl fmt::Display for DeviceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} ({:?}, Vulkan {}, {})",
            self.index, self.name, self.device_type, self.api_version, self.driver
        )?;
        for (backend, missing) in [("bvh", &self.missing_for_bvh), ("rayquery", &self.missing_for_rayquery)] {
            if missing.is_empty() {
                write!(f, "; {backend}: yes")?;
            } else {
                write!(f, "; {backend}: no, lacks {}", missing.join(", "))?;
            }
        }
        Ok(())
    }
}

fn text<E>(name: Result<&CStr, E>) -> String {
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
