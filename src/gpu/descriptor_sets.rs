//! Descriptor sets whose writes are checked against their layout.

use std::sync::Arc;

use ash::vk;

use super::acceleration::TopLevel;
use super::error::Context;
use super::{BindingKind, Buffer, DescriptorLayout, Device, GpuError, Image, Sampler};

/// A texture with its sampler. The image is in layout SHADER_READ_ONLY_OPTIMAL when used.
#[derive(Clone, Copy)]
pub struct SampledTexture<'a> {
    /// The image.
    pub image: &'a Image,
    /// How it is filtered.
    pub sampler: &'a Sampler,
}

enum Content<'a> {
    StorageImage(&'a Image, u32),
    Buffer(BindingKind, &'a Buffer),
    Textures(&'a [SampledTexture<'a>]),
    TextureGeneral(SampledTexture<'a>),
    AccelerationStructure(&'a TopLevel),
}

/// One write to a descriptor set.
pub struct Write<'a> {
    binding: u32,
    first: u32,
    content: Content<'a>,
}

impl<'a> Write<'a> {
    /// Level 0 of a storage image.
    pub fn storage_image(binding: u32, image: &'a Image) -> Self {
        Self::storage_image_at(binding, 0, image, 0)
    }

    /// A level of a storage image into element `element` of an array.
    pub fn storage_image_at(binding: u32, element: u32, image: &'a Image, mip: u32) -> Self {
        Self {
            binding,
            first: element,
            content: Content::StorageImage(image, mip),
        }
    }

    /// A whole storage buffer.
    pub fn storage_buffer(binding: u32, buffer: &'a Buffer) -> Self {
        Self {
            binding,
            first: 0,
            content: Content::Buffer(BindingKind::StorageBuffer, buffer),
        }
    }

    /// A whole uniform buffer.
    pub fn uniform_buffer(binding: u32, buffer: &'a Buffer) -> Self {
        Self {
            binding,
            first: 0,
            content: Content::Buffer(BindingKind::UniformBuffer, buffer),
        }
    }

    /// Textures into consecutive elements from `first` on.
    pub fn textures(binding: u32, first: u32, textures: &'a [SampledTexture<'a>]) -> Self {
        Self {
            binding,
            first,
            content: Content::Textures(textures),
        }
    }

    /// A texture that stays in layout GENERAL because passes also write it.
    pub fn texture_general(binding: u32, image: &'a Image, sampler: &'a Sampler) -> Self {
        Self {
            binding,
            first: 0,
            content: Content::TextureGeneral(SampledTexture { image, sampler }),
        }
    }

    /// A top-level acceleration structure.
    pub fn acceleration_structure(binding: u32, top: &'a TopLevel) -> Self {
        Self {
            binding,
            first: 0,
            content: Content::AccelerationStructure(top),
        }
    }

    fn kind(&self) -> BindingKind {
        match self.content {
            Content::StorageImage(..) => BindingKind::StorageImage,
            Content::Buffer(kind, _) => kind,
            Content::Textures(_) | Content::TextureGeneral(_) => BindingKind::Texture,
            Content::AccelerationStructure(_) => BindingKind::AccelerationStructure,
        }
    }

    fn count(&self) -> u32 {
        match self.content {
            Content::Textures(textures) => textures.len() as u32,
            _ => 1,
        }
    }
}

/// Several sets of one layout (one per frame in flight, or per parity), with the pool they come from.
pub struct DescriptorSets {
    device: Arc<Device>,
    layout: Arc<DescriptorLayout>,
    pool: vk::DescriptorPool,
    sets: Vec<vk::DescriptorSet>,
    variable_count: u32,
}

impl DescriptorSets {
    /// Makes `sets` sets; the variable binding, if there is one, has `variable_count` elements.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if `variable_count` exceeds the binding's limit, out of memory.
    pub fn new(layout: &Arc<DescriptorLayout>, sets: u32, variable_count: u32) -> Result<Self, GpuError> {
        let what = "the creation of descriptor sets";
        let device = layout.device();
        let variable = layout.bindings().iter().find(|binding| binding.variable);
        if let Some(binding) = variable
            && variable_count > binding.count
        {
            return Err(GpuError::InvalidInput(format!(
                "{variable_count} descriptors of at most {}",
                binding.count
            )));
        }
        let sets = sets.max(1);
        let sizes: Vec<_> = layout
            .bindings()
            .iter()
            .map(|binding| {
                let count = if binding.variable {
                    variable_count.max(1)
                } else {
                    binding.count
                };
                vk::DescriptorPoolSize {
                    ty: binding.kind.descriptor_type(),
                    descriptor_count: count.saturating_mul(sets),
                }
            })
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets)
            .pool_sizes(&sizes);
        // SAFETY: `info` is complete. From here on `Drop` cleans up if a later step fails.
        let pool = unsafe { device.raw().create_descriptor_pool(&info, None) }.context(what)?;
        let mut made = Self {
            device: device.clone(),
            layout: layout.clone(),
            pool,
            sets: Vec::new(),
            variable_count,
        };
        let layouts = vec![layout.raw(); sets as usize];
        let counts = vec![variable_count; sets as usize];
        let mut count_info = vk::DescriptorSetVariableDescriptorCountAllocateInfo::default().descriptor_counts(&counts);
        let mut info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&layouts);
        if variable.is_some() {
            info = info.push_next(&mut count_info);
        }
        // SAFETY: `info` and all that it points to live through the call.
        made.sets = unsafe { device.raw().allocate_descriptor_sets(&info) }.context(what)?;
        Ok(made)
    }

    /// Vulkan's handle of set `index`, taken modulo the number of sets.
    pub fn raw(&self, index: usize) -> vk::DescriptorSet {
        self.sets[index % self.sets.len()]
    }

    /// Number of sets.
    pub fn len(&self) -> usize {
        self.sets.len()
    }

    /// Never true; there is at least one set.
    pub fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    /// Writes to set `index` (modulo the number of sets). The GPU must not be using that set, and what is written must
    /// outlive its use.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] for a binding that is not in the layout, of another kind, or beyond its end.
    pub fn write(&self, index: usize, writes: &[Write<'_>]) -> Result<(), GpuError> {
        // Vulkan takes pointers, so everything pointed to is gathered first and does not move afterwards.
        let mut images = Vec::with_capacity(writes.len());
        let mut buffers = Vec::with_capacity(writes.len());
        let mut structures = Vec::with_capacity(writes.len());
        for write in writes {
            self.check(write)?;
            images.push(image_infos(write)?);
            buffers.push(match write.content {
                Content::Buffer(_, buffer) => {
                    vec![
                        vk::DescriptorBufferInfo::default()
                            .buffer(buffer.raw())
                            .range(vk::WHOLE_SIZE),
                    ]
                }
                _ => Vec::new(),
            });
            structures.push(match write.content {
                Content::AccelerationStructure(top) => vec![top.raw()],
                _ => Vec::new(),
            });
        }
        let mut extensions: Vec<_> = structures
            .iter()
            .map(|structures| {
                vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(structures)
            })
            .collect();
        let mut raw_writes = Vec::with_capacity(writes.len());
        for (((write, images), buffers), extension) in writes.iter().zip(&images).zip(&buffers).zip(&mut extensions) {
            if write.count() == 0 {
                continue;
            }
            let mut raw = vk::WriteDescriptorSet::default()
                .dst_set(self.raw(index))
                .dst_binding(write.binding)
                .dst_array_element(write.first)
                .descriptor_type(write.kind().descriptor_type())
                .image_info(images)
                .buffer_info(buffers);
            if write.kind() == BindingKind::AccelerationStructure {
                raw = raw.push_next(extension);
            }
            raw.descriptor_count = write.count();
            raw_writes.push(raw);
        }
        // SAFETY: the writes fit the layout (checked), and what they point to lives through the call.
        unsafe { self.device.raw().update_descriptor_sets(&raw_writes, &[]) };
        Ok(())
    }

    fn check(&self, write: &Write<'_>) -> Result<(), GpuError> {
        let binding = self.layout.binding(write.binding).ok_or_else(|| {
            GpuError::InvalidInput(format!("a write to binding {}, which is not there", write.binding))
        })?;
        if binding.kind != write.kind() {
            return Err(GpuError::InvalidInput(format!(
                "a write of {:?} to binding {}, which holds {:?}",
                write.kind(),
                write.binding,
                binding.kind
            )));
        }
        let count = if binding.variable {
            self.variable_count
        } else {
            binding.count
        };
        if write.first.checked_add(write.count()).is_none_or(|end| end > count) {
            return Err(GpuError::InvalidInput(format!(
                "a write beyond the {count} of binding {}",
                write.binding
            )));
        }
        Ok(())
    }
}

impl Drop for DescriptorSets {
    fn drop(&mut self) {
        // SAFETY: the owner retires sets only when the GPU is done with them.
        unsafe { self.device.raw().destroy_descriptor_pool(self.pool, None) };
    }
}

fn image_infos(write: &Write<'_>) -> Result<Vec<vk::DescriptorImageInfo>, GpuError> {
    let sampled = |texture: &SampledTexture<'_>, layout| {
        vk::DescriptorImageInfo::default()
            .image_view(texture.image.view())
            .sampler(texture.sampler.raw())
            .image_layout(layout)
    };
    Ok(match &write.content {
        Content::StorageImage(image, mip) => {
            let view = image
                .mip_view(*mip)
                .ok_or_else(|| GpuError::InvalidInput(format!("mip level {mip} has no view for storage")))?;
            vec![
                vk::DescriptorImageInfo::default()
                    .image_view(view)
                    .image_layout(vk::ImageLayout::GENERAL),
            ]
        }
        Content::Textures(textures) => textures
            .iter()
            .map(|texture| sampled(texture, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL))
            .collect(),
        Content::TextureGeneral(texture) => vec![sampled(texture, vk::ImageLayout::GENERAL)],
        Content::Buffer(..) | Content::AccelerationStructure(_) => Vec::new(),
    })
}
