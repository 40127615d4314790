//! Texture samplers.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{Device, GpuError};

/// How a texture is filtered and continued beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplerDesc {
    /// Filter within a mip level.
    pub filter: vk::Filter,
    /// Filter between mip levels.
    pub mipmap_mode: vk::SamplerMipmapMode,
    /// What lies beyond the edges, in both directions.
    pub address_mode: vk::SamplerAddressMode,
    /// Anisotropy wanted; limited to what the device has. 1 or less is none.
    pub anisotropy: f32,
}

impl Default for SamplerDesc {
    fn default() -> Self {
        Self {
            filter: vk::Filter::LINEAR,
            mipmap_mode: vk::SamplerMipmapMode::LINEAR,
            address_mode: vk::SamplerAddressMode::REPEAT,
            anisotropy: 1.0,
        }
    }
}

/// A sampler, destroyed on drop.
pub struct Sampler {
    device: Arc<Device>,
    raw: vk::Sampler,
}

impl Sampler {
    /// Makes a sampler.
    ///
    /// # Errors
    /// Vulkan's own.
    pub fn new(device: &Arc<Device>, name: &str, desc: &SamplerDesc) -> Result<Self, GpuError> {
        let anisotropy = desc.anisotropy.min(device.limits().max_anisotropy);
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(desc.filter)
            .min_filter(desc.filter)
            .mipmap_mode(desc.mipmap_mode)
            .address_mode_u(desc.address_mode)
            .address_mode_v(desc.address_mode)
            .address_mode_w(desc.address_mode)
            .anisotropy_enable(anisotropy > 1.0 && device.info().enabled.sampler_anisotropy)
            .max_anisotropy(anisotropy.max(1.0))
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: anisotropy is only enabled where the feature is.
        let raw = unsafe { device.raw().create_sampler(&info, None) }
            .context(&format!("the creation of the sampler '{name}'"))?;
        device.set_name(raw, name);
        Ok(Self {
            device: device.clone(),
            raw,
        })
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Sampler {
        self.raw
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: the owner retires samplers only when the GPU is done with them.
        unsafe { self.device.raw().destroy_sampler(self.raw, None) };
    }
}
