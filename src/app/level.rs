//! A map that is being played: who walks in it, and the frames that show it.

use super::input::Input;
use super::painter::Painting;
use super::screen::Screen;
use super::walk::{Step, enter, walk};
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::game::movement::Command;
use crate::game::play::{Event, Play};
use crate::gpu::{Device, PipelineCache};
use crate::output::stats::FrameStats;
use crate::render::backend::Backend;
use crate::render::frame::FrameInput;
use crate::render::gpu_renderer::film;
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::clusters::{LightRows, cluster_at};
use crate::scene::entity_geometry::EntityState;
use crate::scene::records::BspNode;
use std::sync::Arc;
use std::time::Duration;

/// Share of the way to the wanted exposure per second.
pub const EXPOSURE_RATE: f32 = 2.0;

/// A map, the player and its frames.
pub struct Level {
    pub map: String,
    pub realtime: Realtime,
    pub play: Play,
    pub camera: Camera,
    /// What was missing or damaged.
    pub warnings: Vec<String>,
    /// What its loading took.
    pub loading_times: [(&'static str, Duration); 3],
    nodes: Vec<BspNode>,
    rows: LightRows,
    /// Time of the scene, seconds.
    pub time: f64,
    /// Frames shown.
    pub frame: u32,
    /// Samples in the accumulation; 0 when something moved.
    pub accumulated: u32,
    /// Relative standard error of the accumulated image where it was last looked at.
    pub error: Option<f32>,
    /// Samples at which it is looked at next.
    next_look: u32,
    last_shown: Option<(Camera, Settings, Vec<EntityState>)>,
}

/// What a frame is to show.
pub struct View {
    pub camera: Camera,
    pub clock: Clock,
    pub entities: Vec<EntityState>,
    /// Average the frames as long as they show the same.
    pub accumulate: bool,
    /// Time of the user since the frame before, seconds.
    pub seconds: f32,
}

/// What walking has come to.
pub struct Walked {
    pub command: Command,
    pub events: Vec<Event>,
    pub view: View,
    /// Scene time that went by, seconds.
    pub seconds: f32,
    pub frozen: bool,
}

impl Level {
    /// A level of a loaded scene. `pipelines` is called before the shaders are prepared.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(
        scene: &Scene,
        device: &Arc<Device>,
        backend: Backend,
        cache: &PipelineCache,
        size: (u32, u32),
        fov: f32,
        pipelines: &dyn Fn(),
    ) -> Result<Self, RenderError> {
        let on_gpu = Arc::new(SceneGpu::new(device, scene, backend, BvhQuality::Balanced)?);
        pipelines();
        let realtime = Realtime::new(on_gpu, size, Some(cache))?;
        let (play, camera) = enter(scene, fov);
        Ok(Self {
            map: scene.name.clone(),
            realtime,
            play,
            camera,
            warnings: scene.warnings.clone(),
            loading_times: Default::default(),
            nodes: scene.bsp_nodes.clone(),
            rows: scene.rows.clone(),
            time: 0.0,
            frame: 0,
            accumulated: 0,
            error: None,
            next_look: 1,
            last_shown: None,
        })
    }

    /// Lets the player walk for some time.
    pub fn walk(&mut self, input: &mut Input, cvars: &Cvars, real_seconds: f32) -> Walked {
        let accumulate = cvars.number("rt_accumulate") != 0.0;
        let frozen = accumulate || cvars.number("rt_refine") != 0.0 || cvars.number("rt_pause") != 0.0;
        let scale = if frozen { 1.0 } else { cvars.number("timescale") };
        let seconds = real_seconds * scale as f32;
        if !frozen {
            self.time += f64::from(seconds);
        }
        let step = Step {
            seconds,
            real_seconds,
            clock: Clock::from_seconds(self.time),
            frozen,
        };
        self.camera.fov = cvars.number("cg_fov") as f32;
        let (command, events) = walk(&mut self.play, &mut self.camera, input, cvars, &step);
        Walked {
            command,
            events,
            view: View {
                camera: self.camera,
                clock: step.clock,
                entities: self.play.states(),
                accumulate: accumulate || cvars.number("rt_refine") != 0.0,
                seconds: real_seconds,
            },
            seconds,
            frozen,
        }
    }

    /// Renders a frame and shows it with the overlay. Returns whether the window could show it, and the statistics of an earlier frame.
    ///
    /// # Errors
    /// [`RenderError`] of the device or the window.
    pub fn show(
        &mut self,
        view: &View,
        cvars: &Cvars,
        size: (u32, u32),
        screen: &mut Screen,
        painting: &Painting,
    ) -> Result<(bool, Option<FrameStats>), RenderError> {
        let resized = self.realtime.view.gbuffer.size != size;
        self.realtime.resize(size)?;
        let now = Settings {
            clock: view.clock,
            ..settings(cvars)
        };
        let same = self.last_shown.as_ref().is_some_and(|(camera, settings, entities)| {
            (camera, settings, entities) == (&view.camera, &now, &view.entities)
        });
        if view.accumulate && same && !resized {
            self.accumulated += 1;
        } else {
            self.accumulated = 0;
            self.error = None;
            self.next_look = 8;
            self.last_shown = Some((view.camera, now, view.entities.clone()));
        }
        let input = FrameInput {
            camera: view.camera,
            settings: if self.accumulated > 0 {
                now.at_sample(self.frame)
            } else {
                now
            },
            lights: &[],
            polygons: &[],
            entities: &view.entities,
            sample_index: self.frame,
            accumulated: self.accumulated,
            exposure_blend: (EXPOSURE_RATE * view.seconds).min(1.0),
            reuse: self.accumulated == 0,
            output: true,
        };
        let mut shown = false;
        let ended = self.realtime.frame(&input, |frame| {
            shown = screen.show(frame, painting)?;
            Ok(())
        })?;
        self.frame = self.frame.wrapping_add(1);
        if self.accumulated >= self.next_look {
            // Each look waits for the GPU and reads the image: twice as rarely each time.
            self.next_look = self.accumulated * 2;
            self.realtime.finish()?;
            self.error = relative_error(&film(&self.realtime.view, self.accumulated)?);
        }
        Ok((shown, ended))
    }

    /// Begins anew as a view that has shown nothing yet: frames come out the same for the same input.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn forget(&mut self) -> Result<(), RenderError> {
        self.realtime.forget()?;
        (self.frame, self.accumulated, self.last_shown) = (0, 0, None);
        Ok(())
    }

    /// PVS cluster of an eye, and how many lights its surfaces consider.
    pub fn lights_at(&self, camera: &Camera) -> Option<(u32, usize)> {
        let cluster = cluster_at(&self.nodes, camera.eye.into())?;
        Some((cluster, self.rows.pvs.lights(cluster).count()))
    }
}

/// Standard error of an image's mean over its pixels, relative to it: the root of the mean variance over the mean.
fn relative_error(film: &crate::render::film::Film) -> Option<f32> {
    let n = film.mean.len() as f64;
    let mean = film.mean.iter().flatten().map(|c| f64::from(*c)).sum::<f64>() / (3.0 * n);
    let variance = film.variance.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    (mean > 0.0).then(|| (variance.sqrt() / mean) as f32)
}
