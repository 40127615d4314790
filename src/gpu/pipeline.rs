//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{Buffer, Commands, DescriptorLayout, Device, GpuError, PipelineCache};

/// What a compute pipeline is made from.
#[derive(Clone, Copy)]
pub struct ComputePipelineDesc<'a> {
    /// Name for debuggers and messages: the stem of the shader.
    pub name: &'a str,
    /// The shader, with entry point `main`.
    pub spirv: &'a [u32],
    /// Layouts of sets 0, 1, …
    pub layouts: &'a [&'a Arc<DescriptorLayout>],
    /// Bytes of push constants; a multiple of 4, at most 128 unless the device has more.
    pub push_constant_bytes: u32,
    /// Specialization constants as (id, value bits).
    pub specialization: &'a [(u32, u32)],
    /// Where to look for and keep the driver's compiled form.
    pub cache: Option<&'a PipelineCache>,
}

/// A compute pipeline with its layout, destroyed on drop.
pub struct ComputePipeline {
    device: Arc<Device>,
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    push_constant_bytes: u32,
    set_count: usize,
    _set_layouts: Vec<Arc<DescriptorLayout>>,
}

impl ComputePipeline {
    /// Makes a pipeline.
    ///
    /// # Errors
    /// [`GpuError::Shader`] for something that is no SPIR-V, [`GpuError::InvalidInput`] for a bad push constant size,
    /// Vulkan's own.
    pub fn new(device: &Arc<Device>, desc: &ComputePipelineDesc<'_>) -> Result<Self, GpuError> {
        let what = format!("the creation of the pipeline '{}'", desc.name);
        check_spirv(desc.name, desc.spirv)?;
        if !desc.push_constant_bytes.is_multiple_of(4) || desc.push_constant_bytes > device.limits().max_push_constants
        {
            return Err(GpuError::InvalidInput(format!(
                "{} bytes of push constants of '{}'; at most {} and a multiple of 4",
                desc.push_constant_bytes,
                desc.name,
                device.limits().max_push_constants
            )));
        }
        let mut pipeline = Self {
            device: device.clone(),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            push_constant_bytes: desc.push_constant_bytes,
            set_count: desc.layouts.len(),
            _set_layouts: desc.layouts.iter().map(|&layout| layout.clone()).collect(),
        };
        let set_layouts: Vec<_> = desc.layouts.iter().map(|layout| layout.raw()).collect();
        let ranges = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::COMPUTE,
            offset: 0,
            size: desc.push_constant_bytes,
        }];
        let ranges = if desc.push_constant_bytes == 0 {
            &[][..]
        } else {
            &ranges[..]
        };
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(ranges);
        // SAFETY: `info` is complete; `Drop` destroys what was made, also on error.
        pipeline.layout = unsafe { device.raw().create_pipeline_layout(&info, None) }.context(&what)?;
        pipeline.raw = create(device, desc, pipeline.layout, &what)?;
        device.set_name(pipeline.raw, desc.name);
        Ok(pipeline)
    }

    /// Makes this the pipeline of the dispatches that follow, with sets 0, 1, … as given.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if the number of sets is not that of the layouts.
    pub fn bind(&self, cmd: &Commands<'_>, sets: &[vk::DescriptorSet]) -> Result<(), GpuError> {
        if sets.len() != self.set_count {
            return Err(GpuError::InvalidInput(format!(
                "{} descriptor sets instead of {}",
                sets.len(),
                self.set_count
            )));
        }
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the command buffer is being recorded; the sets' number was checked, their layout is the caller's.
        unsafe {
            self.device.raw().cmd_bind_pipeline(cmd.raw(), point, self.raw);
            if !sets.is_empty() {
                self.device
                    .raw()
                    .cmd_bind_descriptor_sets(cmd.raw(), point, self.layout, 0, sets, &[]);
            }
        }
        Ok(())
    }

    /// Sets the push constants, all of them.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if `constants` has another size than the pipeline's.
    pub fn push<T: bytemuck::NoUninit>(&self, cmd: &Commands<'_>, constants: &T) -> Result<(), GpuError> {
        let bytes = bytemuck::bytes_of(constants);
        if bytes.len() != self.push_constant_bytes as usize {
            return Err(GpuError::InvalidInput(format!(
                "{} bytes of push constants instead of {}",
                bytes.len(),
                self.push_constant_bytes
            )));
        }
        if !bytes.is_empty() {
            // SAFETY: the range is the pipeline's.
            unsafe {
                let stage = vk::ShaderStageFlags::COMPUTE;
                self.device
                    .raw()
                    .cmd_push_constants(cmd.raw(), self.layout, stage, 0, bytes);
            }
        }
        Ok(())
    }

    /// Runs `groups` work groups per axis.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] beyond the device's limit.
    pub fn dispatch(&self, cmd: &Commands<'_>, groups: [u32; 3]) -> Result<(), GpuError> {
        let most = self.device.limits().max_work_group_count;
        if groups.iter().zip(&most).any(|(groups, most)| groups > most) {
            return Err(GpuError::InvalidInput(format!(
                "{groups:?} work groups, of at most {most:?}"
            )));
        }
        // SAFETY: the counts are within the limits; binding the right things is the caller's.
        unsafe {
            self.device
                .raw()
                .cmd_dispatch(cmd.raw(), groups[0], groups[1], groups[2])
        };
        Ok(())
    }

    /// Runs as many work groups as the first three words of a buffer say.
    pub fn dispatch_indirect(&self, cmd: &Commands<'_>, groups: &Buffer) {
        // SAFETY: all our buffers have indirect usage and this one holds the three words; binding the right things is the
        // caller's.
        unsafe { self.device.raw().cmd_dispatch_indirect(cmd.raw(), groups.raw(), 0) };
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Pipeline {
        self.raw
    }

    /// Vulkan's handle of the layout.
    pub fn layout(&self) -> vk::PipelineLayout {
        self.layout
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner retires pipelines only when the GPU is done with them; null handles are ignored.
        unsafe {
            self.device.raw().destroy_pipeline(self.raw, None);
            self.device.raw().destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// The words of a SPIR-V file's bytes. `name` appears in the error.
///
/// # Errors
/// [`GpuError::Shader`] if it is no SPIR-V.
pub fn spirv_words(name: &str, bytes: &[u8]) -> Result<Vec<u32>, GpuError> {
    let (words, rest) = bytes.as_chunks::<4>();
    let words: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    if !rest.is_empty() {
        return Err(no_spirv(name));
    }
    check_spirv(name, &words)?;
    Ok(words)
}

fn check_spirv(name: &str, words: &[u32]) -> Result<(), GpuError> {
    const MAGIC: u32 = 0x0723_0203;
    const HEADER_WORDS: usize = 5;
    if words.len() > HEADER_WORDS && words[0] == MAGIC {
        Ok(())
    } else {
        Err(no_spirv(name))
    }
}

fn no_spirv(name: &str) -> GpuError {
    GpuError::Shader {
        name: name.into(),
        log: "it is no SPIR-V".into(),
    }
}

fn create(
    device: &Device,
    desc: &ComputePipelineDesc<'_>,
    layout: vk::PipelineLayout,
    what: &str,
) -> Result<vk::Pipeline, GpuError> {
    let values: Vec<u32> = desc.specialization.iter().map(|&(_, value)| value).collect();
    let entries: Vec<_> = (0u32..)
        .zip(desc.specialization)
        .map(|(index, &(constant_id, _))| vk::SpecializationMapEntry {
            constant_id,
            offset: index * 4,
            size: 4,
        })
        .collect();
    let specialization = vk::SpecializationInfo::default()
        .map_entries(&entries)
        .data(bytemuck::cast_slice(&values));
    let module_info = vk::ShaderModuleCreateInfo::default().code(desc.spirv);
    // SAFETY: the shader begins as SPIR-V does; beyond that its validity rests on whoever compiled it.
    let module = unsafe { device.raw().create_shader_module(&module_info, None) }.context(what)?;
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&specialization);
    let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
    let cache = desc.cache.map_or(vk::PipelineCache::null(), PipelineCache::raw);
    // SAFETY: everything pointed to lives through the call; the module is no longer needed after it.
    let created = unsafe {
        let created = device.raw().create_compute_pipelines(cache, &info, None);
        device.raw().destroy_shader_module(module, None);
        created
    };
    match created {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((_, result)) => Err(GpuError::from_vulkan(what, result)),
    }
}
