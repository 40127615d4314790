//! The frame, pass by pass.

use super::composite::Composite;
use super::direct::Direct;
use super::exposure::Exposure;
use super::focus::Focus;
use super::frame_constants::{FrameConstants, Push};
use super::gbuffer::GBuffer;
use super::pass::{PassContext, Recorder};
use super::primary::Primary;
use super::resample::Resample;
use super::reuse::Reuse;
use super::scene_gpu::SceneGpu;
use super::settings::Settings;
use super::tone_map::ToneMap;
use super::view_state::ViewState;
use crate::gpu::{Commands, DescriptorLayout, GpuError, PipelineCache, Timestamps};
use crate::scene::camera::Camera;
use std::sync::Arc;

/// What a frame shows and how.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput {
    pub camera: Camera,
    pub settings: Settings,
    /// Number of the sample that every pixel takes.
    pub sample_index: u32,
    /// Samples accumulated with this one; 0 shows this frame alone.
    pub accumulated: u32,
    /// Share of the way to the wanted exposure that this frame goes; 1 takes it at once.
    pub exposure_blend: f32,
    /// Let pixels reuse light samples of the frame before and of each other, where the settings want it. Samples of
    /// different frames then depend on each other: not for frames that are averaged.
    pub reuse: bool,
    /// Produce the display image.
    pub output: bool,
}

/// All passes, for one backend. Makes frames of any scene and view.
pub struct FrameRenderer {
    primary: Primary,
    focus: Focus,
    direct: Direct,
    resample: Resample,
    reuse: Reuse,
    composite: Composite,
    exposure: Exposure,
    tone_map: ToneMap,
    pub view_layout: Arc<DescriptorLayout>,
}

impl FrameRenderer {
    /// Makes the pipelines for scenes of the same device, backend and number of textures as `scene`.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(scene: &SceneGpu, cache: Option<&PipelineCache>) -> Result<Self, GpuError> {
        let view_layout = GBuffer::layout(&scene.device)?;
        let context = PassContext {
            device: &scene.device,
            backend: scene.backend,
            layouts: [&scene.layout, &view_layout],
            cache,
        };
        Ok(Self {
            primary: Primary::new(&context)?,
            focus: Focus::new(&context)?,
            direct: Direct::new(&context)?,
            resample: Resample::new(&context)?,
            reuse: Reuse::new(&context)?,
            composite: Composite::new(&context)?,
            exposure: Exposure::new(&context)?,
            tone_map: ToneMap::new(&context)?,
            view_layout: view_layout.clone(),
        })
    }

    /// Records one frame of a view. `slot` names the frame in flight whose constants and counters may be written.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(
        &self,
        cmd: &Commands<'_>,
        timestamps: Option<&Timestamps>,
        scene: &SceneGpu,
        view: &mut ViewState,
        slot: usize,
        input: &FrameInput,
    ) -> Result<(), GpuError> {
        let mut constants = frame_constants(scene, view, slot, input)?;
        let reuses = input.reuse && input.settings.reuses();
        if reuses {
            constants = view.reservoirs(&scene.device)?.complete(constants, &input.settings);
        } else if let Some(reservoirs) = &mut view.reservoirs {
            reservoirs.forget();
        }
        view.constants[slot].write(0, &[constants])?;
        let mut r = Recorder {
            cmd,
            tracker: &mut view.tracker,
            timestamps,
            scene,
            gbuffer: &view.gbuffer,
            push: Push {
                frame: view.constants[slot].address(),
                sample_index: input.sample_index,
                accumulated: input.accumulated,
            },
        };
        if input.settings.aperture > 0.0 && input.settings.focus_distance <= 0.0 {
            self.focus.record(&mut r, &view.focus[slot])?;
        }
        self.primary.record(&mut r, &view.focus[slot])?;
        match &view.reservoirs {
            Some(reservoirs) if reuses => {
                self.resample.record(&mut r, &view.counters[slot], reservoirs)?;
                self.reuse.record(&mut r, &view.counters[slot], reservoirs)?;
            }
            _ => self.direct.record(&mut r, &view.counters[slot])?,
        }
        self.composite.record(&mut r)?;
        if input.output {
            self.exposure.record(&mut r, &view.exposure)?;
            self.tone_map.record(&mut r, &view.exposure)?;
        }
        Ok(())
    }
}

/// Constants of a frame. A fixed focus distance is written to its buffer here: nothing on the GPU changes it.
fn frame_constants(
    scene: &SceneGpu,
    view: &mut ViewState,
    slot: usize,
    input: &FrameInput,
) -> Result<FrameConstants, GpuError> {
    let s = &input.settings;
    if s.focus_distance > 0.0 {
        view.focus[slot].write(0, &[s.focus_distance])?;
    }
    let size = view.gbuffer.size;
    let lists = if s.cull_lights == 2 { &scene.tight } else { &scene.pvs };
    let base = scene.constants(&input.camera, size);
    Ok(FrameConstants {
        light_rows: lists.rows.address(),
        light_runs: lists.runs.address(),
        counters: view.counters[slot].address(),
        exposure: view.exposure.address(),
        focus: view.focus[slot].address(),
        aperture: s.aperture,
        cone: if s.filter_textures {
            2.0 * base.half_width / size.0 as f32
        } else {
            0.0
        },
        seed: s.seed,
        sequence: s.sequence as u32,
        cull_lights: s.cull_lights,
        random_lights: s.random_lights,
        light_sampling: s.light_sampling as u32,
        light_candidates: s.candidates,
        ambient: s.ambient as u32,
        soft_shadows: u32::from(s.soft_shadows),
        antialiasing: u32::from(s.antialiasing),
        illumination: u32::from(s.illumination),
        tonemap: s.tonemap as u32,
        view: s.view,
        fixed_exposure: s.exposure,
        exposure_blend: input.exposure_blend,
        ..base
    })
}
