//! What can go wrong on the GPU side, each in one sentence that says what to do.

use std::path::PathBuf;

use ash::vk;

/// Every failure of this module. `what` names the operation that failed.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan loader library could be opened.
    #[error("no Vulkan loader was found ({0}); install a Vulkan driver with its loader, or use the cpu backend")]
    NoLoader(String),
    /// The loader works but lists no device.
    #[error("Vulkan lists no device; install a Vulkan driver for this GPU, or use the cpu backend")]
    NoDevice,
    /// The user's choice matches none of the devices.
    #[error("no Vulkan device matches '{wanted}'; choose one of: {available}")]
    NoSuchDevice {
        /// The choice as given.
        wanted: String,
        /// Index and name of each device.
        available: String,
    },
    /// The device (or every device, when chosen automatically) lacks something that is needed.
    #[error("{device} lacks {missing}; update its driver, choose another device, or use another backend")]
    MissingFeature {
        /// The device's name.
        device: String,
        /// The features by their Vulkan names, comma separated.
        missing: String,
    },
    /// The device stopped responding or was removed.
    #[error("the GPU was lost during {what}; restart the program, and update the driver if it happens again")]
    DeviceLost {
        /// The operation that noticed it.
        what: String,
    },
    /// GPU memory is used up.
    #[error("out of GPU memory during {what}; lower the resolution or close other programs that use the GPU")]
    OutOfDeviceMemory {
        /// The operation that needed it.
        what: String,
    },
    /// Main memory is used up.
    #[error("out of main memory during {what}; close other programs or choose a smaller map")]
    OutOfHostMemory {
        /// The operation that needed it.
        what: String,
    },
    /// The window system took the surface away.
    #[error("the window's surface was lost during {what}; close and reopen the window")]
    SurfaceLost {
        /// The operation that noticed it.
        what: String,
    },
    /// The device cannot do what was asked for (an image format, a size).
    #[error("the device cannot provide {0}; choose other settings or another device")]
    Unsupported(String),
    /// The caller broke a rule of this module's interface.
    #[error("invalid use of the GPU layer: {0}; please report this as a bug")]
    InvalidInput(String),
    /// A file of this module's (pipeline cache, shader) could not be read or written.
    #[error("cannot access '{}' ({source}); check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A shader does not compile, or the compiled form is missing or damaged.
    #[error("shader '{name}' cannot be used: {log}; correct its source, or run compile_shaders to build it anew")]
    Shader {
        /// Stem of the shader.
        name: String,
        /// The compiler's message.
        log: String,
    },
    /// Any other Vulkan error.
    #[error("Vulkan failed during {what} ({result}); update the driver, or try another device")]
    Vulkan {
        /// The operation that failed.
        what: String,
        /// Vulkan's own code.
        result: vk::Result,
    },
}

impl GpuError {
    /// Names the Vulkan error `result` of the operation `what`.
    pub fn from_vulkan(what: &str, result: vk::Result) -> Self {
        let what = what.to_owned();
        match result {
            vk::Result::ERROR_DEVICE_LOST => Self::DeviceLost { what },
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_POOL_MEMORY => {
                Self::OutOfDeviceMemory { what }
            }
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => Self::OutOfHostMemory { what },
            vk::Result::ERROR_SURFACE_LOST_KHR => Self::SurfaceLost { what },
            vk::Result::ERROR_FORMAT_NOT_SUPPORTED => Self::Unsupported(what),
            result => Self::Vulkan { what, result },
        }
    }

    /// Names the allocator's error while allocating for `what`.
    pub(super) fn from_allocation(what: &str, error: &gpu_allocator::AllocationError) -> Self {
        use gpu_allocator::AllocationError;
        let what = format!("the allocation of {what}");
        match error {
            AllocationError::OutOfMemory => Self::OutOfDeviceMemory { what },
            AllocationError::FailedToMap(_) => Self::OutOfHostMemory { what },
            other => Self::Unsupported(format!("memory for {what} ({other})")),
        }
    }
}

/// Attaches the name of the operation to a Vulkan result.
pub(super) trait Context<T> {
    /// Turns the error into a [`GpuError`] naming the operation `what`.
    fn context(self, what: &str) -> Result<T, GpuError>;
}

impl<T> Context<T> for Result<T, vk::Result> {
    fn context(self, what: &str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::from_vulkan(what, result))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_operation_and_the_remedy() {
        let error = GpuError::from_vulkan("the build of the world", vk::Result::ERROR_DEVICE_LOST);
        assert!(matches!(error, GpuError::DeviceLost { .. }));
        let text = error.to_string();
        assert!(
            text.contains("the build of the world") && text.contains("restart"),
            "{text}"
        );
        let error = GpuError::from_vulkan("a copy", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        assert!(matches!(error, GpuError::OutOfDeviceMemory { .. }));
    }
}
