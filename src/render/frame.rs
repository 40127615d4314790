//! The frame, pass by pass.

use super::atrous::Atrous;
use super::composite::Composite;
use super::deform::Deform;
use super::direct::Direct;
use super::exposure::Exposure;
use super::focus::Focus;
use super::frame_constants::{FrameConstants, NO_SUCH_LIGHT, Push};
use super::gbuffer::GBuffer;
use super::gradient::Gradient;
use super::gradient_atrous::GradientAtrous;
use super::moving::Moving;
use super::pass::{PassContext, Recorder};
use super::primary::Primary;
use super::resample::Resample;
use super::reuse::Reuse;
use super::scene_gpu::{RenderError, SceneGpu};
use super::secondary::Secondary;
use super::settings::Settings;
use super::taa::Taa;
use super::temporal::{Channel, Temporal};
use super::tone_map::ToneMap;
use super::view_state::ViewState;
use crate::gpu::{Commands, DescriptorLayout, GpuError, PipelineCache, Timestamps};
use crate::scene::camera::Camera;
use crate::scene::entity_geometry::EntityState;
use crate::scene::guests::guests;
use crate::scene::polygons::Polygon;
use crate::scene::records::{Light, NONE};
use std::sync::Arc;
use std::time::Instant;

/// In frames that are shown as they come, a branch of less than this share of what the eye sees is followed in proportion to
/// it.
const LEAST_BRANCH_SHARE: f32 = 0.25;

/// What a frame shows and how.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput<'a> {
    pub camera: Camera,
    pub settings: Settings,
    /// Lights that are in this frame beside the map's: [`crate::scene::guests`]. World space; any number of spheres, others are
    /// left out.
    pub lights: &'a [Light],
    /// Polygons that are in this frame: [`crate::scene::polygons`].
    pub polygons: &'a [Polygon],
    /// Entities that are not as the map has them: doors on their way, items that were taken.
    pub entities: &'a [EntityState],
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

impl FrameInput<'_> {
    /// Whether the frame is denoised: averaged frames never are.
    pub fn denoises(&self) -> bool {
        self.settings.denoiser && self.settings.illumination && self.accumulated == 0
    }

    /// Whether light samples are reused.
    pub fn reuses(&self) -> bool {
        self.reuse && self.settings.reuses() && (self.settings.reuse_denoised || !self.denoises())
    }

    /// Whether the frame is blended with those before to smooth edges.
    pub fn anti_aliases(&self) -> bool {
        self.settings.taa && self.accumulated == 0
    }
}

/// All passes, for one backend. Makes frames of any scene and view.
pub struct FrameRenderer {
    deform: Deform,
    primary: Primary,
    focus: Focus,
    direct: Direct,
    secondary: Secondary,
    resample: Resample,
    reuse: Reuse,
    gradient: Gradient,
    gradient_atrous: GradientAtrous,
    temporal: Temporal,
    atrous: Atrous,
    composite: Composite,
    taa: Taa,
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
        let begin = Instant::now();
        // Drivers take their time for large shaders, and take it on as many threads as ask.
        let made = std::thread::scope(|scope| {
            let deform = scope.spawn(|| Deform::new(&context));
            let primary = scope.spawn(|| Primary::new(&context));
            let focus = scope.spawn(|| Focus::new(&context));
            let direct = scope.spawn(|| Direct::new(&context));
            let secondary = scope.spawn(|| Secondary::new(&context));
            let resample = scope.spawn(|| Resample::new(&context));
            let reuse = scope.spawn(|| Reuse::new(&context));
            let gradient = scope.spawn(|| Gradient::new(&context));
            let gradient_atrous = scope.spawn(|| GradientAtrous::new(&context));
            let temporal = scope.spawn(|| Temporal::new(&context));
            let atrous = scope.spawn(|| Atrous::new(&context));
            let composite = scope.spawn(|| Composite::new(&context));
            let taa = scope.spawn(|| Taa::new(&context));
            let exposure = scope.spawn(|| Exposure::new(&context));
            let tone_map = scope.spawn(|| ToneMap::new(&context));
            Ok(Self {
                deform: joined(deform)?,
                primary: joined(primary)?,
                focus: joined(focus)?,
                direct: joined(direct)?,
                secondary: joined(secondary)?,
                resample: joined(resample)?,
                reuse: joined(reuse)?,
                gradient: joined(gradient)?,
                gradient_atrous: joined(gradient_atrous)?,
                temporal: joined(temporal)?,
                atrous: joined(atrous)?,
                composite: joined(composite)?,
                taa: joined(taa)?,
                exposure: joined(exposure)?,
                tone_map: joined(tone_map)?,
                view_layout: view_layout.clone(),
            })
        });
        tracing::info!("pipelines in {:.2} s", begin.elapsed().as_secs_f64());
        made
    }

    /// Records one frame of a view. `slot` names the frame in flight whose constants and counters may be written.
    ///
    /// # Errors
    /// [`RenderError`] where the input does not fit the scene, or of the device.
    pub fn record(
        &self,
        cmd: &Commands<'_>,
        timestamps: Option<&Timestamps>,
        scene: &SceneGpu,
        view: &mut ViewState,
        slot: usize,
        input: &FrameInput<'_>,
    ) -> Result<(), RenderError> {
        view.gbuffer.parity ^= 1;
        view.anti_aliased = input.anti_aliases();
        let constants = frame_constants(scene, view, slot, input)?;
        view.branches_off = constants.branches_off != 0;
        let mut constants = {
            if view.entities.0 != input.entities {
                view.entities = (input.entities.to_vec(), view.entities.1.wrapping_add(1));
            }
            view.polygons.note(input.polygons);
            let revision = scene
                .revision()
                .wrapping_add(view.guests.revision)
                .wrapping_add(view.polygons.revision)
                .wrapping_add(view.entities.1);
            view.history.advance(constants, input, revision, scene.moving)
        };
        let polygons = view
            .polygons
            .record(cmd, &mut view.tracker, scene, slot, input.polygons)?;
        if scene.moving.geometry || view.moving.is_some() || !input.entities.is_empty() {
            let moving = match view.moving.take() {
                Some(made) => made,
                None => Moving::new(scene, view.constants.len())?,
            };
            let moving = view.moving.insert(moving);
            let now = input.settings.moment(&input.camera);
            constants = moving.advance(scene, slot, now, polygons, input.entities, constants)?;
        }
        let reuses = input.reuses();
        if reuses {
            constants = view.reservoirs(&scene.device)?.complete(constants, &input.settings);
        } else if let Some(reservoirs) = &mut view.reservoirs {
            reservoirs.forget();
        }
        if constants.branches_off != 0 {
            constants.secondary_pixels = view.secondary_pixels(&scene.device)?.buffer.address();
        }
        view.constants[slot].write(0, &[constants])?;
        let push = Push {
            frame: view.constants[slot].address(),
            sample_index: input.sample_index,
            accumulated: input.accumulated,
            level: 0,
            padding: 0,
        };
        if scene.dynamic_triangles_count > 0 {
            self.deform.record(&mut Recorder {
                cmd,
                tracker: &mut view.tracker,
                timestamps,
                scene,
                scene_sets: &scene.sets,
                gbuffer: &view.gbuffer,
                push,
            })?;
        }
        if let Some(moving) = &mut view.moving {
            moving.build_top(cmd, &mut view.tracker, slot)?;
        }
        let mut r = Recorder {
            cmd,
            tracker: &mut view.tracker,
            timestamps,
            scene,
            scene_sets: view.moving.as_ref().and_then(Moving::sets).unwrap_or(&scene.sets),
            gbuffer: &view.gbuffer,
            push,
        };
        if input.settings.aperture > 0.0 && input.settings.focus_distance <= 0.0 {
            self.focus.record(&mut r, &view.focus[slot])?;
        }
        let listed = view.secondary_pixels.as_ref().filter(|_| constants.branches_off != 0);
        if let Some(pixels) = listed {
            pixels.clear(&mut r)?;
        }
        self.primary.record(&mut r, &view.focus[slot], listed)?;
        if let Some(pixels) = listed {
            self.secondary
                .record(&mut r, pixels, &view.counters[slot], &view.focus[slot])?;
        }
        let denoises = input.denoises();
        if denoises && listed.is_some() {
            self.temporal.record(&mut r, Channel::Secondary, &view.counters[slot])?;
            self.atrous
                .record_secondary(&mut r, input.settings.secondary_levels())?;
        }
        if denoises && constants.changed != 0 {
            self.gradient.record(&mut r, &view.counters[slot], &view.strata)?;
            self.gradient_atrous.record(&mut r)?;
        }
        let reservoirs = view.reservoirs.as_ref().filter(|_| reuses);
        match reservoirs {
            Some(reservoirs) => {
                self.resample.record(&mut r, &view.counters[slot], reservoirs)?;
                self.reuse
                    .record(&mut r, &view.counters[slot], reservoirs, &view.strata)?;
            }
            None => self.direct.record(&mut r, &view.counters[slot], &view.strata)?,
        }
        if denoises {
            self.temporal.record(&mut r, Channel::Direct, &view.counters[slot])?;
            self.atrous.record(&mut r, input.settings.shown_levels())?;
        }
        self.composite.record(&mut r)?;
        if input.anti_aliases() {
            self.taa.record(&mut r, &view.exposure)?;
        }
        if input.output {
            self.exposure.record(&mut r, &view.exposure)?;
            self.tone_map.record(&mut r, &view.exposure)?;
        }
        Ok(())
    }
}

/// What a thread has made.
fn joined<T>(thread: std::thread::ScopedJoinHandle<'_, T>) -> T {
    match thread.join() {
        Ok(made) => made,
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// Constants of a frame. A fixed focus distance is written to its buffer here: nothing on the GPU changes it.
fn frame_constants(
    scene: &SceneGpu,
    view: &mut ViewState,
    slot: usize,
    input: &FrameInput<'_>,
) -> Result<FrameConstants, GpuError> {
    let s = &input.settings;
    if s.focus_distance > 0.0 {
        view.focus[slot].write(0, &[s.focus_distance])?;
    }
    let size = view.gbuffer.size;
    let guests = guests(input.lights, &input.camera, s.flashlight);
    let guest_lights = view.guests.write(&scene.device, slot, &guests)?;
    let lists = if s.cull_lights == 2 { &scene.tight } else { &scene.pvs };
    let base = scene.constants(&input.camera, size);
    Ok(FrameConstants {
        light_rows: lists.rows.address(),
        light_runs: lists.runs.address(),
        guest_lights,
        guest_count: guests.len() as u32,
        draw_sun: u32::from(s.draw_sun),
        white: u32::from(s.white),
        solo_light: s
            .solo_light
            .map_or(NONE, |n| if n < scene.light_count { n } else { NO_SUCH_LIGHT }),
        light_term: s.light_term as u32,
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
        strata: view.strata.buffer.address(),
        filter_levels: s.shown_levels(),
        secondary_levels: s.secondary_levels(),
        denoised: if input.denoises() { 1 + s.shown_levels() % 2 } else { 0 },
        taa: u32::from(input.anti_aliases()),
        least_alpha: s.least_alpha,
        taa_gamma: s.taa_gamma,
        fireflies: s.fireflies,
        exposure_blend: input.exposure_blend,
        clock: s.clock.0,
        shown_emission: s.shown_emission as u32,
        max_depth: s.max_depth,
        secondary: s.branches() as u32,
        glossy: u32::from(s.reflects()),
        // Averaged frames follow every branch: the mean is the same, and each has less noise.
        branch_share: if input.accumulated == 0 {
            LEAST_BRANCH_SHARE
        } else {
            0.0
        },
        branches_off: u32::from(scene.branches_off && s.branches() != super::settings::Secondary::Off),
        choose_layers: u32::from(s.choose_layers),
        ..base
    })
}
