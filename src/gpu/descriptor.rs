//! Descriptor set layouts from tables of bindings.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{Device, GpuError};

/// What a binding holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `image2D`; the image is in layout GENERAL.
    StorageImage,
    /// `buffer` block.
    StorageBuffer,
    /// `uniform` block.
    UniformBuffer,
    /// `sampler2D`.
    Texture,
    /// `accelerationStructureEXT`.
    AccelerationStructure,
}

/// One binding of a descriptor set, visible to compute shaders.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Number in the shader.
    pub index: u32,
    /// What it holds.
    pub kind: BindingKind,
    /// Number of array elements, 1 for none. The most there can be if `variable`.
    pub count: u32,
    /// The real number of elements is chosen when sets are made. Only for the binding with the highest index.
    pub variable: bool,
}

impl Binding {
    /// A single descriptor.
    pub const fn one(index: u32, kind: BindingKind) -> Self {
        Self {
            index,
            kind,
            count: 1,
            variable: false,
        }
    }

    /// An array whose elements need not all be written.
    pub const fn array(index: u32, kind: BindingKind, count: u32) -> Self {
        Self {
            index,
            kind,
            count,
            variable: false,
        }
    }

    /// An array of up to `most` elements, sized when sets are made, whose elements need not all be written.
    pub const fn variable(index: u32, kind: BindingKind, most: u32) -> Self {
        Self {
            index,
            kind,
            count: most,
            variable: true,
        }
    }
}

impl BindingKind {
    pub(super) fn descriptor_type(self) -> vk::DescriptorType {
        match self {
            Self::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
            Self::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
            Self::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
            Self::Texture => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }
}

/// The layout of a descriptor set.
pub struct DescriptorLayout {
    device: Arc<Device>,
    raw: vk::DescriptorSetLayout,
    bindings: Vec<Binding>,
}

impl DescriptorLayout {
    /// Makes a layout of `bindings`.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if a variable binding is not the one with the highest index, or two have one index.
    pub fn new(device: &Arc<Device>, name: &str, bindings: &[Binding]) -> Result<Arc<Self>, GpuError> {
        let highest = bindings.iter().map(|binding| binding.index).max();
        if bindings
            .iter()
            .any(|binding| binding.variable && Some(binding.index) != highest)
        {
            return Err(GpuError::InvalidInput(format!(
                "in '{name}' a binding other than the last is variable"
            )));
        }
        let repeated = |i: usize| bindings[..i].iter().any(|other| other.index == bindings[i].index);
        if (0..bindings.len()).any(repeated) {
            return Err(GpuError::InvalidInput(format!(
                "in '{name}' two bindings have the same index"
            )));
        }
        let raw_bindings: Vec<_> = bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.index)
                    .descriptor_type(binding.kind.descriptor_type())
                    .descriptor_count(binding.count)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let flags: Vec<_> = bindings
            .iter()
            .map(|binding| {
                let mut flags = vk::DescriptorBindingFlags::empty();
                if binding.variable {
                    flags |= vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT;
                }
                if binding.variable || binding.count > 1 {
                    flags |= vk::DescriptorBindingFlags::PARTIALLY_BOUND;
                }
                flags
            })
            .collect();
        let mut flags_info = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .bindings(&raw_bindings)
            .push_next(&mut flags_info);
        // SAFETY: `info` and all that it points to live through the call.
        let raw = unsafe { device.raw().create_descriptor_set_layout(&info, None) }
            .context(&format!("the creation of the descriptor layout '{name}'"))?;
        device.set_name(raw, name);
        Ok(Arc::new(Self {
            device: device.clone(),
            raw,
            bindings: bindings.to_vec(),
        }))
    }

    pub(super) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    pub(super) fn bindings(&self) -> &[Binding] {
        &self.bindings
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::DescriptorSetLayout {
        self.raw
    }

    pub(super) fn binding(&self, index: u32) -> Option<&Binding> {
        self.bindings.iter().find(|binding| binding.index == index)
    }
}

impl Drop for DescriptorLayout {
    fn drop(&mut self) {
        // SAFETY: sets and pipelines made with it hold an `Arc` of it.
        unsafe { self.device.raw().destroy_descriptor_set_layout(self.raw, None) };
    }
}
