//! The Vulkan instance: loaded at run time, with the validation layer and window-system extensions on request.

use std::ffi::{CStr, CString, c_char};
use std::sync::Arc;

use ash::{ext, khr, vk};
use raw_window_handle::RawDisplayHandle;

use super::error::Context;
use super::validation::{self, ValidationLog, ValidationMode};
use super::{DeviceReport, GpuError};

/// The Vulkan version that we write against; newer devices are used as if they were of this version.
pub(super) const API_VERSION: u32 = vk::API_VERSION_1_2;

/// How to create an [`Instance`].
#[derive(Clone, Copy, Debug, Default)]
pub struct InstanceOptions {
    /// Load the validation layer?
    pub validation: ValidationMode,
    /// The display whose windows will be presented to; `None` for headless use.
    pub display: Option<RawDisplayHandle>,
}

/// A Vulkan instance. Destroyed on drop unless adopted from outside.
pub struct Instance {
    raw: ash::Instance,
    entry: ash::Entry,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    log: Arc<ValidationLog>,
    surface: Option<khr::surface::Instance>,
    debug_utils: bool,
    owned: bool,
}

impl Instance {
    /// Loads the Vulkan loader and creates an instance.
    ///
    /// # Errors
    /// [`GpuError::NoLoader`] without a loader; [`GpuError::MissingFeature`] when the loader is older than 1.2 or lacks
    /// the window system's extensions or the required validation layer.
    pub fn new(options: &InstanceOptions) -> Result<Arc<Self>, GpuError> {
        // SAFETY: the loader is a trusted system library; `entry` is kept as long as the instance.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| GpuError::NoLoader(error.to_string()))?;
        check_loader_version(&entry)?;

        let available = extension_names(&entry, None)?;
        let has = |name: &CStr| available.iter().any(|have| have.as_c_str() == name);
        let validate = wants_validation(&entry, options.validation)?;
        // The layer may bring extensions that the loader itself does not list.
        let layer_extensions = if validate {
            extension_names(&entry, Some(validation::LAYER))?
        } else {
            Vec::new()
        };
        let layer_has = |name: &CStr| layer_extensions.iter().any(|have| have.as_c_str() == name);

        let mut extensions: Vec<*const c_char> = Vec::new();
        if let Some(display) = options.display {
            let required =
                ash_window::enumerate_required_extensions(display).context("the search for the window system")?;
            for &name in required {
                // SAFETY: ash-window returns static null-terminated names.
                let name = unsafe { CStr::from_ptr(name) };
                if !has(name) {
                    return Err(missing(&format!("the instance extension {}", name.to_string_lossy())));
                }
            }
            extensions.extend_from_slice(required);
        }
        let debug_utils = has(ext::debug_utils::NAME) || layer_has(ext::debug_utils::NAME);
        if debug_utils {
            extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        let mut flags = vk::InstanceCreateFlags::empty();
        if has(khr::portability_enumeration::NAME) {
            extensions.push(khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        let check_synchronisation =
            options.validation == ValidationMode::Required && layer_has(ext::validation_features::NAME);
        if check_synchronisation {
            extensions.push(ext::validation_features::NAME.as_ptr());
        }

        let log = Arc::new(ValidationLog::default());
        let mut messenger_info = validation::messenger_info(&log);
        let enabled_checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut checks = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled_checks);
        let application = vk::ApplicationInfo::default()
            .application_name(c"q3rays")
            .api_version(API_VERSION);
        let layers = if validate {
            vec![validation::LAYER.as_ptr()]
        } else {
            Vec::new()
        };
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_extension_names(&extensions)
            .enabled_layer_names(&layers)
            .flags(flags);
        if validate && debug_utils {
            // Chained here, the messenger also sees the instance's own creation and destruction.
            info = info.push_next(&mut messenger_info);
        }
        if check_synchronisation {
            info = info.push_next(&mut checks);
        }
        // SAFETY: `info` and all that it points to live through the call; `log` outlives the instance (see `Drop`).
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
            result => GpuError::from_vulkan("the creation of the Vulkan instance", result),
        })?;

        let surface = options.display.map(|_| khr::surface::Instance::new(&entry, &raw));
        let mut instance = Self {
            raw,
            entry,
            messenger: None,
            log,
            surface,
            debug_utils,
            owned: true,
        };
        if validate && debug_utils {
            let loader = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            // SAFETY: the log outlives the messenger (see `Drop`).
            let messenger =
                unsafe { loader.create_debug_utils_messenger(&validation::messenger_info(&instance.log), None) }
                    .context("the creation of the debug messenger")?;
            instance.messenger = Some((loader, messenger));
        }
        Ok(Arc::new(instance))
    }

    /// Wraps an instance that belongs to someone else; it is not destroyed on drop.
    ///
    /// # Safety
    /// `raw` was created from `entry` for API version 1.2 or newer and outlives the returned value. `debug_utils` says
    /// whether VK_EXT_debug_utils is enabled on it, `surface` the same of VK_KHR_surface.
    pub unsafe fn adopt(entry: ash::Entry, raw: ash::Instance, debug_utils: bool, surface: bool) -> Arc<Self> {
        let surface = surface.then(|| khr::surface::Instance::new(&entry, &raw));
        let log = Arc::new(ValidationLog::default());
        Arc::new(Self {
            raw,
            entry,
            messenger: None,
            log,
            surface,
            debug_utils,
            owned: false,
        })
    }

    /// The instance's functions.
    pub fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// The loader's functions.
    pub fn entry(&self) -> &ash::Entry {
        &self.entry
    }

    /// What the validation layer has reported; stays empty when it is not loaded.
    pub fn validation_log(&self) -> &Arc<ValidationLog> {
        &self.log
    }

    /// Is the validation layer loaded and reporting to [`Self::validation_log`]?
    pub fn is_validating(&self) -> bool {
        self.messenger.is_some()
    }

    /// All devices with what each can do, in Vulkan's order (whose position is the device's index).
    ///
    /// # Errors
    /// Vulkan's own, when the devices cannot be listed. A list without entries is no error here.
    pub fn devices(&self) -> Result<Vec<DeviceReport>, GpuError> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() }.context("the search for Vulkan devices")?;
        devices
            .into_iter()
            .enumerate()
            .map(|(index, device)| DeviceReport::query(self, index, device))
            .collect()
    }

    pub(super) fn has_debug_utils(&self) -> bool {
        self.debug_utils
    }

    pub(super) fn surface_functions(&self) -> Option<&khr::surface::Instance> {
        self.surface.as_ref()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.owned {
            return;
        }
        // SAFETY: devices and surfaces hold an `Arc` of this instance, so none is left; `self.log` is dropped after.
        unsafe {
            if let Some((loader, messenger)) = self.messenger.take() {
                loader.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn missing(what: &str) -> GpuError {
    GpuError::MissingFeature {
        device: "the Vulkan installation".into(),
        missing: what.into(),
    }
}

fn check_loader_version(entry: &ash::Entry) -> Result<(), GpuError> {
    // SAFETY: the entry is loaded. A loader without this function is of version 1.0.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .context("the query of the Vulkan version")?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < API_VERSION {
        return Err(missing("Vulkan 1.2 (its loader is older)"));
    }
    Ok(())
}

fn extension_names(entry: &ash::Entry, layer: Option<&CStr>) -> Result<Vec<CString>, GpuError> {
    // SAFETY: the entry is loaded.
    let properties = unsafe { entry.enumerate_instance_extension_properties(layer) }
        .context("the listing of the instance's extensions")?;
    Ok(properties
        .iter()
        .filter_map(|p| p.extension_name_as_c_str().ok().map(CStr::to_owned))
        .collect())
}

fn wants_validation(entry: &ash::Entry, mode: ValidationMode) -> Result<bool, GpuError> {
    if mode == ValidationMode::Off {
        return Ok(false);
    }
    // SAFETY: the entry is loaded.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.context("the listing of Vulkan layers")?;
    let present = layers
        .iter()
        .any(|layer| layer.layer_name_as_c_str() == Ok(validation::LAYER));
    match (present, mode) {
        (false, ValidationMode::Required) => Err(missing("the validation layer")),
        (present, _) => Ok(present),
    }
}
