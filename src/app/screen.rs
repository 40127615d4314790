//! The window's device and images, and how a frame gets onto them.

use super::painter::{Painter, Painting};
use crate::engine::{BackendChoice, Engine, describe, open_device};
use crate::gpu::{
    Access, Commands, Device, Frame, FrameRing, GpuError, Instance, InstanceOptions, PipelineCache, PresentMode,
    SubmitSync, Surface, Swapchain, Use, ValidationMode,
};
use crate::render::backend::Backend;
use crate::render::realtime::{FRAMES_IN_FLIGHT, Shown};
use ash::vk;
use std::path::Path;
use std::sync::Arc;
use winit::raw_window_handle::HasDisplayHandle;
use winit::window::Window;

/// Colour of the window where there is no map.
const NOTHING: [f32; 4] = [0.012, 0.012, 0.016, 1.0];

/// What can be drawn to. Fields are dropped in this order.
pub struct Screen {
    target: Target,
    /// Of frames without a map.
    ring: FrameRing,
    pub cache: Arc<PipelineCache>,
    pub device: Arc<Device>,
    pub backend: Backend,
    /// Names device and backend, and why they were chosen.
    pub line: String,
    window: Arc<Window>,
}

/// How the screen is opened.
pub struct ScreenOptions<'a> {
    pub backend: BackendChoice,
    pub device: &'a str,
    pub mode: PresentMode,
    /// File of the driver's compiled pipelines.
    pub pipelines: &'a Path,
}

impl Screen {
    /// Opens the device for a window.
    ///
    /// # Errors
    /// [`GpuError`] where there is none that can show and trace.
    pub fn new(window: &Arc<Window>, options: &ScreenOptions<'_>) -> Result<Self, GpuError> {
        let display = window
            .display_handle()
            .map_err(|e| GpuError::Unsupported(format!("a window ({e})")))?
            .as_raw();
        let instance = Instance::new(&InstanceOptions {
            validation: ValidationMode::Off,
            display: Some(display),
        })?;
        let surface = Arc::new(Surface::new(&instance, window)?);
        let (device, backend) = open_device(options.backend, options.device, &instance, Some(&surface))?;
        let size = window.inner_size();
        let swapchain = Swapchain::new(
            &device,
            &surface,
            size.width,
            size.height,
            options.mode,
            FRAMES_IN_FLIGHT,
        )?;
        Ok(Self {
            target: Target {
                painter: Painter::new(&device, swapchain.format(), FRAMES_IN_FLIGHT)?,
                swapchain,
            },
            ring: FrameRing::new(&device, FRAMES_IN_FLIGHT, 1)?,
            cache: Arc::new(PipelineCache::load(
                &device,
                Some(options.pipelines).filter(|p| p.exists()),
            )?),
            line: describe(&device, backend, options.backend),
            device,
            backend,
            window: window.clone(),
        })
    }

    /// Device and backend, as statistics name them.
    pub fn engine(&self) -> Engine {
        Engine::Vulkan {
            device: self.device.clone(),
            backend: self.backend,
        }
    }

    /// Whether a CPU stands in for a GPU.
    pub fn on_cpu(&self) -> bool {
        self.device.info().device_type == vk::PhysicalDeviceType::CPU
    }

    /// The window has another size, pixels.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.target.swapchain.resize(width, height);
    }

    /// Waits for the display's refresh, or no longer.
    pub fn set_mode(&mut self, mode: PresentMode) {
        self.target.swapchain.set_mode(mode);
    }

    /// Whether there is anything to draw to.
    pub fn has_area(&self) -> bool {
        let size = self.window.inner_size();
        size.width > 0 && size.height > 0
    }

    /// Submits a map's frame with the overlay over it, and shows it. False where the window cannot show anything now.
    ///
    /// # Errors
    /// [`GpuError`] of the device or the window.
    pub fn show(&mut self, shown: Shown<'_, '_>, painting: &Painting) -> Result<bool, GpuError> {
        let Shown { frame, tracker, image } = shown;
        tracker.pass(&frame.commands(), &[Use::image(image, Access::TransferRead)])?;
        self.target.present(frame, painting, |swapchain, cmd, acquired| {
            swapchain.record_blit(cmd, image, acquired, Access::ColorWrite)
        })
    }

    /// Shows the overlay over nothing. False where the window cannot show anything now.
    ///
    /// # Errors
    /// [`GpuError`] of the device or the window.
    pub fn show_nothing(&mut self, painting: &Painting) -> Result<bool, GpuError> {
        let frame = self.ring.begin()?;
        self.target.present(frame, painting, |swapchain, cmd, acquired| {
            if let Some(target) = swapchain.image(acquired) {
                cmd.transition(target, Access::TransferWrite, Access::TransferWrite);
                cmd.clear_image(target, NOTHING);
                cmd.transition(target, Access::TransferWrite, Access::ColorWrite);
            }
            Ok(())
        })
    }

    /// Takes over the overlay's textures, before it is shown.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn update(&mut self, painting: &Painting) -> Result<(), GpuError> {
        self.target.painter.update(&painting.textures)
    }
}

/// Window images and what paints onto them.
struct Target {
    painter: Painter,
    swapchain: Swapchain,
}

impl Target {
    fn present(
        &mut self,
        frame: Frame<'_>,
        painting: &Painting,
        draw: impl FnOnce(&Swapchain, &Commands<'_>, &crate::gpu::Acquired) -> Result<(), GpuError>,
    ) -> Result<bool, GpuError> {
        let acquired = self.swapchain.acquire(frame.slot())?;
        if self.swapchain.take_renewed() {
            // Waited for when the old images went.
            self.painter.forget_images();
        }
        let Some(acquired) = acquired else {
            frame.submit(SubmitSync::default())?;
            return Ok(false);
        };
        let cmd = frame.commands();
        draw(&self.swapchain, &cmd, &acquired)?;
        if let Some(target) = self.swapchain.image(&acquired) {
            self.painter.record(&cmd, target, painting)?;
        }
        frame.submit(acquired.sync())?;
        self.swapchain.present(acquired)?;
        Ok(true)
    }
}
