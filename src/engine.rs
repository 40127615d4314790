//! Chooses what traces: a Vulkan device and its traversal, or the CPU.

use crate::gpu::{Device, DeviceRequest, GpuError, Instance, InstanceOptions, RayQueryUse, Surface, ValidationMode};
use crate::output::stats::RunStats;
use crate::reference::CpuRenderer;
use crate::reference::direct::RayCounts;
use crate::render::backend::Backend;
use crate::render::film::{Aovs, Film};
use crate::render::gpu_renderer::GpuRenderer;
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use crate::scene::camera::{Camera, Shot};
use ash::vk;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

/// What the user asked for (`rt_backend`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackendChoice {
    Auto,
    RayQuery,
    Bvh,
    Cpu,
}

/// Why nothing can trace as asked.
#[derive(Debug, Error)]
pub enum EngineError {
    #[error("rt_backend {backend} cannot be used: {source}")]
    Unusable { backend: &'static str, source: GpuError },
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// A chosen tracer.
pub enum Engine {
    /// The CPU tracer.
    Cpu,
    /// A Vulkan device.
    Vulkan { device: Arc<Device>, backend: Backend },
}

impl BackendChoice {
    /// From the word in `rt_backend`.
    pub fn from_word(word: &str) -> Self {
        match word {
            "rayquery" => Self::RayQuery,
            "bvh" => Self::Bvh,
            "cpu" => Self::Cpu,
            _ => Self::Auto,
        }
    }
}

/// What was chosen, and one line that says so and why.
pub struct Choice {
    pub engine: Engine,
    pub line: String,
}

/// Opens a device for a backend choice other than the CPU.
pub fn open_device(
    choice: BackendChoice,
    device: &str,
    instance: &Arc<Instance>,
    surface: Option<&Surface>,
) -> Result<(Arc<Device>, Backend), GpuError> {
    let request = |ray_query| DeviceRequest {
        // The parser of device names cannot fail: every text is an index, a name or "auto".
        choice: device.parse().unwrap_or_default(),
        ray_query,
        surface,
    };
    match choice {
        BackendChoice::RayQuery => Ok((
            Device::new(instance, &request(RayQueryUse::Required))?,
            Backend::RayQuery,
        )),
        BackendChoice::Bvh => Ok((Device::new(instance, &request(RayQueryUse::Never))?, Backend::Bvh)),
        _ => {
            let device = Device::new(instance, &request(RayQueryUse::IfAvailable))?;
            // A CPU's ray queries are many times slower than our own traversal there.
            let cpu = device.info().device_type == vk::PhysicalDeviceType::CPU;
            let backend = if device.has_ray_query() && !cpu {
                Backend::RayQuery
            } else {
                Backend::Bvh
            };
            Ok((device, backend))
        }
    }
}

/// The line that tells a device and backend, and why the backend.
pub fn describe(device: &Device, backend: Backend, choice: BackendChoice) -> String {
    let info = device.info();
    let why = match (choice, backend) {
        (BackendChoice::RayQuery | BackendChoice::Bvh, _) => "as asked",
        (_, Backend::RayQuery) => "it has ray queries",
        (_, Backend::Bvh) if info.device_type == vk::PhysicalDeviceType::CPU => {
            "own traversal is faster than ray queries on a CPU"
        }
        _ => "it has no ray queries",
    };
    format!("tracing on {} ({}) with {backend}: {why}", info.name, info.driver)
}

impl Engine {
    /// Whether it is a CPU that traces, by itself or behind a Vulkan driver.
    pub fn on_cpu(&self) -> bool {
        match self {
            Self::Cpu => true,
            Self::Vulkan { device, .. } => device.info().device_type == vk::PhysicalDeviceType::CPU,
        }
    }

    /// Chooses by the rules of `rt_backend`.
    ///
    /// # Errors
    /// [`EngineError`] where the backend or device asked for by name cannot be used. With `auto` and no device named, the
    /// CPU tracer stands in, and the line says why.
    pub fn choose(
        choice: BackendChoice,
        device: Option<&str>,
        validation: ValidationMode,
    ) -> Result<Choice, EngineError> {
        if choice == BackendChoice::Cpu {
            return Ok(Choice {
                engine: Self::Cpu,
                line: "tracing on the CPU: as asked".to_owned(),
            });
        }
        let opened = Instance::new(&InstanceOptions {
            validation,
            display: None,
        })
        .and_then(|instance| open_device(choice, device.unwrap_or("auto"), &instance, None));
        match opened {
            Ok((device, backend)) => Ok(Choice {
                line: describe(&device, backend, choice),
                engine: Self::Vulkan { device, backend },
            }),
            Err(e) if choice == BackendChoice::Auto && device.is_none() => Ok(Choice {
                engine: Self::Cpu,
                line: format!(
                    "tracing on the CPU, because no Vulkan device can be used: {e}. For a GPU path install a Vulkan 1.2 \
                     driver (or Mesa's lavapipe)"
                ),
            }),
            Err(source) => Err(EngineError::Unusable {
                backend: match choice {
                    BackendChoice::RayQuery => "rayquery",
                    BackendChoice::Bvh => "bvh",
                    _ => "auto",
                },
                source,
            }),
        }
    }

    /// Prepares a scene for tracing.
    ///
    /// # Errors
    /// [`EngineError::Render`] where the device cannot hold it.
    pub fn prepare<'a>(&self, scene: &'a Scene) -> Result<Prepared<'a>, EngineError> {
        Ok(match self {
            Self::Cpu => Prepared::Cpu(CpuRenderer::new(scene)),
            Self::Vulkan { device, backend } => {
                Prepared::Gpu(Arc::new(SceneGpu::new(device, scene, *backend, BvhQuality::Balanced)?))
            }
        })
    }

    /// Fills in what statistics say of device, backend and driver.
    pub fn label(&self, stats: &mut RunStats) {
        match self {
            Self::Cpu => {
                stats.device = "CPU".to_owned();
                stats.backend = "cpu".to_owned();
                stats.driver = String::new();
            }
            Self::Vulkan { device, backend } => {
                stats.device = device.info().name.clone();
                stats.backend = backend.name().to_owned();
                stats.driver = device.info().driver.clone();
            }
        }
    }
}

/// A scene ready to be traced.
pub enum Prepared<'a> {
    Cpu(CpuRenderer<'a>),
    Gpu(Arc<SceneGpu>),
}

/// An accumulation as it was asked for.
pub struct Job<'a> {
    pub camera: Shot,
    pub size: (u32, u32),
    pub settings: &'a Settings,
    /// Numbers of the samples.
    pub range: Range<u32>,
}

impl Prepared<'_> {
    /// Mean of independent samples. `progress` is called with the share done, 0..1.
    ///
    /// # Errors
    /// [`EngineError::Render`] of the device.
    pub fn accumulate(&self, job: Job<'_>, progress: &(dyn Fn(f32) + Sync)) -> Result<(Film, RayCounts), EngineError> {
        match self {
            Self::Cpu(cpu) => Ok(cpu.accumulate(job.camera, job.size, job.settings, job.range, progress)),
            Self::Gpu(scene) => {
                let gpu = GpuRenderer::new(scene)?;
                Ok(gpu.accumulate(job.camera, job.size, job.settings, job.range, progress)?)
            }
        }
    }

    /// Geometry through pixel centres.
    ///
    /// # Errors
    /// [`EngineError::Render`] of the device.
    pub fn aovs(&self, camera: &Camera, size: (u32, u32), settings: &Settings) -> Result<Aovs, EngineError> {
        match self {
            Self::Cpu(cpu) => Ok(cpu.aovs(camera, size, settings)),
            Self::Gpu(scene) => Ok(GpuRenderer::new(scene)?.aovs(camera, size, settings)?),
        }
    }
}
