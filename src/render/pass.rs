//! What all passes share: a pipeline, and recording it with its hazards, label and timing row under one name.

use super::backend::Backend;
use super::frame_constants::Push;
use super::gbuffer::GBuffer;
use super::scene_gpu::SceneGpu;
use crate::gpu::{
    Buffer, Commands, ComputePipeline, ComputePipelineDesc, DescriptorLayout, DescriptorSets, Device, GpuError,
    PipelineCache, Timestamps, Tracker, Use, shader_table,
};
use std::sync::Arc;

/// What is needed to make passes.
pub struct PassContext<'a> {
    pub device: &'a Arc<Device>,
    pub backend: Backend,
    /// Layouts of set 0 (scene) and set 1 (view).
    pub layouts: [&'a Arc<DescriptorLayout>; 2],
    pub cache: Option<&'a PipelineCache>,
}

/// A frame being recorded.
pub struct Recorder<'a> {
    pub cmd: &'a Commands<'a>,
    pub tracker: &'a mut Tracker,
    pub timestamps: Option<&'a Timestamps>,
    pub scene: &'a SceneGpu,
    /// Set 0.
    pub scene_sets: &'a DescriptorSets,
    pub gbuffer: &'a GBuffer,
    pub push: Push,
}

/// A compute pass over the image.
pub struct Pass {
    name: &'static str,
    pipeline: ComputePipeline,
}

/// Edge of the square work groups that cover an image.
const GROUP: u32 = 8;

/// Work groups that cover an image.
pub fn groups_over(size: (u32, u32)) -> [u32; 3] {
    [size.0.div_ceil(GROUP), size.1.div_ceil(GROUP), 1]
}

impl Pass {
    /// Makes the pass `name` from the shader of the same stem; `traced` shaders have one compiled form per backend.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>, name: &'static str, traced: bool) -> Result<Self, GpuError> {
        Self::specialized(context, name, traced, &[])
    }

    /// The same with values of specialization constants by their number.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn specialized(
        context: &PassContext<'_>,
        name: &'static str,
        traced: bool,
        specialization: &[(u32, u32)],
    ) -> Result<Self, GpuError> {
        let form = if traced {
            format!("{name}_{}", context.backend)
        } else {
            name.to_owned()
        };
        let spirv = shader_table::load_spirv(&form)?;
        let pipeline = ComputePipeline::new(
            context.device,
            &ComputePipelineDesc {
                name: &form,
                spirv: &spirv,
                layouts: &context.layouts,
                push_constant_bytes: size_of::<Push>() as u32,
                specialization,
                cache: context.cache,
            },
        )?;
        Ok(Self { name, pipeline })
    }

    /// Records the pass with the given number of work groups.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, uses: &[Use<'_>], groups: [u32; 3]) -> Result<(), GpuError> {
        self.record_as(self.name, r, uses, groups)
    }

    /// The same under another label, for passes that a frame runs several times.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record_as(
        &self,
        label: &'static str,
        r: &mut Recorder<'_>,
        uses: &[Use<'_>],
        groups: [u32; 3],
    ) -> Result<(), GpuError> {
        self.run(label, r, uses, |cmd| self.pipeline.dispatch(cmd, groups))
    }

    /// Records the pass with as many work groups as the first three words of a buffer say when it runs.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record_indirect(&self, r: &mut Recorder<'_>, uses: &[Use<'_>], groups: &Buffer) -> Result<(), GpuError> {
        self.run(self.name, r, uses, |cmd| {
            self.pipeline.dispatch_indirect(cmd, groups);
            Ok(())
        })
    }

    fn run(
        &self,
        label: &'static str,
        r: &mut Recorder<'_>,
        uses: &[Use<'_>],
        dispatch: impl Fn(&Commands<'_>) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        r.tracker.pass(r.cmd, uses)?;
        let sets = [r.scene_sets.raw(0), r.gbuffer.sets.raw(r.gbuffer.parity)];
        let run = |cmd: &Commands<'_>| {
            self.pipeline.bind(cmd, &sets)?;
            self.pipeline.push(cmd, &r.push)?;
            dispatch(cmd)
        };
        match r.timestamps {
            Some(timestamps) => timestamps.scope(r.cmd, label, run),
            None => run(r.cmd),
        }
    }

    /// Records the pass with one thread per pixel.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record_image(&self, r: &mut Recorder<'_>, uses: &[Use<'_>]) -> Result<(), GpuError> {
        self.record(r, uses, groups_over(r.gbuffer.size))
    }
}
