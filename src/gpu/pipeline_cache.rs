//! The driver's compiled pipelines, kept in a file between runs.

use std::path::Path;
use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{Device, GpuError};

/// First bytes of our file: what follows is the checksum (8 bytes) of the driver's data, then the data. Drivers check
/// their own header but may crash on data that were cut short, hence the checksum.
const MAGIC: &[u8; 8] = b"q3rpipe1";
const PREFIX: usize = MAGIC.len() + 8;

/// A pipeline cache, destroyed on drop.
pub struct PipelineCache {
    device: Arc<Device>,
    raw: vk::PipelineCache,
}

impl PipelineCache {
    /// Makes a cache, filled from the file `path` if that is there and was written by the same device and driver.
    /// A damaged or foreign file is ignored with a warning.
    ///
    /// # Errors
    /// Out of memory.
    pub fn load(device: &Arc<Device>, path: Option<&Path>) -> Result<Self, GpuError> {
        let data = path.and_then(|path| {
            let file = std::fs::read(path).ok()?;
            let data = unwrap_file(&file).filter(|data| is_for_device(device, data));
            if data.is_none() {
                tracing::warn!(
                    "the pipeline cache '{}' is of another device or damaged; ignored",
                    path.display()
                );
            }
            data.map(<[u8]>::to_vec)
        });
        let data = data.unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: the data are as the driver wrote them (checksum) and for this driver (header).
        let raw =
            unsafe { device.raw().create_pipeline_cache(&info, None) }.context("the creation of the pipeline cache")?;
        Ok(Self {
            device: device.clone(),
            raw,
        })
    }

    /// Writes the cache to `path`, replacing the file in one step.
    ///
    /// # Errors
    /// [`GpuError::Io`], out of memory.
    pub fn save(&self, path: &Path) -> Result<(), GpuError> {
        // SAFETY: the cache is alive.
        let data = unsafe { self.device.raw().get_pipeline_cache_data(self.raw) }
            .context("the reading of the pipeline cache")?;
        let mut file = Vec::with_capacity(PREFIX + data.len());
        file.extend_from_slice(MAGIC);
        file.extend_from_slice(&checksum(&data).to_le_bytes());
        file.extend_from_slice(&data);
        // Unique per process, so that two programs that end together do not write into each other's file.
        let part = path.with_extension(format!("part{}", std::process::id()));
        let written = std::fs::write(&part, &file).and_then(|()| std::fs::rename(&part, path));
        written.map_err(|source| {
            // Best effort: the error that matters is the one reported.
            let _ = std::fs::remove_file(&part);
            GpuError::Io {
                path: path.into(),
                source,
            }
        })
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::PipelineCache {
        self.raw
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        // SAFETY: the cache is only used while pipelines are being made.
        unsafe { self.device.raw().destroy_pipeline_cache(self.raw, None) };
    }
}

/// The driver's data in our file, if it is whole.
fn unwrap_file(file: &[u8]) -> Option<&[u8]> {
    let (sum, data) = file.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
    (u64::from_le_bytes(*sum) == checksum(data)).then_some(data)
}

/// Does the driver's header (length, version, vendor, device, UUID) name this device?
fn is_for_device(device: &Device, data: &[u8]) -> bool {
    const HEADER: usize = 32;
    let word = |at: usize| {
        data.get(at..at + 4)
            .and_then(|b| b.try_into().ok())
            .map(u32::from_le_bytes)
    };
    // SAFETY: the physical device belongs to the instance.
    let properties = unsafe {
        device
            .instance()
            .raw()
            .get_physical_device_properties(device.physical())
    };
    word(0).is_some_and(|length| length as usize >= HEADER)
        && word(4) == Some(vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32)
        && word(8) == Some(properties.vendor_id)
        && word(12) == Some(properties.device_id)
        && data.get(16..HEADER) == Some(&properties.pipeline_cache_uuid[..])
}

/// FNV-1a, 64 bits: guards against damage, not against malice.
fn checksum(data: &[u8]) -> u64 {
    data.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_files_are_refused() {
        let mut file = MAGIC.to_vec();
        file.extend_from_slice(&checksum(b"data").to_le_bytes());
        file.extend_from_slice(b"data");
        assert_eq!(unwrap_file(&file), Some(&b"data"[..]));
        assert_eq!(unwrap_file(&file[..file.len() - 1]), None);
        assert_eq!(unwrap_file(b"q3rpipe1"), None);
        assert_eq!(unwrap_file(b""), None);
    }
}
