//! Paints the overlay onto window images.

use crate::gpu::{Access, Commands, Device, GpuError, Image};
use ash::vk;
use egui_ash_renderer::{Options, RenderMode, Renderer, RendererError, allocator::GpuAllocator};
use std::collections::HashMap;
use std::mem::ManuallyDrop;
use std::sync::Arc;

/// What is to be painted.
#[derive(Default)]
pub struct Painting {
    pub textures: egui::TexturesDelta,
    pub primitives: Vec<egui::ClippedPrimitive>,
    /// Pixels a point.
    pub scale: f32,
}

/// Paints with the device's graphics pipeline. Waits for the GPU on drop.
pub struct Painter {
    renderer: ManuallyDrop<Renderer<GpuAllocator>>,
    pass: vk::RenderPass,
    pool: vk::CommandPool,
    /// By the view of the window image; for images of one swapchain.
    framebuffers: HashMap<vk::ImageView, vk::Framebuffer>,
    device: Arc<Device>,
}

/// One sentence of the library's error.
fn failed(error: RendererError) -> GpuError {
    match error {
        RendererError::Vulkan(result) => GpuError::from_vulkan("the painting of the overlay", result),
        other => GpuError::Unsupported(format!("an overlay ({other})")),
    }
}

impl Painter {
    /// For window images of a format.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(device: &Arc<Device>, format: vk::Format, frames_in_flight: usize) -> Result<Self, GpuError> {
        let pass = render_pass(device, format)?;
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the structure is complete.
        let pool = unsafe { device.raw().create_command_pool(&pool_info, None) };
        let renderer = pool
            .map_err(|e| GpuError::from_vulkan("the creation of the overlay", e))
            .and_then(|pool| {
                let options = Options {
                    in_flight_frames: frames_in_flight,
                    srgb_framebuffer: false,
                    ..Options::default()
                };
                let mode = RenderMode::RenderPass(pass);
                let made = Renderer::with_gpu_allocator(device.allocator(), device.raw().clone(), mode, options);
                made.map(|renderer| (pool, renderer)).map_err(|e| {
                    // SAFETY: nothing was made from the pool.
                    unsafe { device.raw().destroy_command_pool(pool, None) };
                    failed(e)
                })
            });
        match renderer {
            Ok((pool, renderer)) => Ok(Self {
                renderer: ManuallyDrop::new(renderer),
                pass,
                pool,
                framebuffers: HashMap::new(),
                device: device.clone(),
            }),
            Err(e) => {
                // SAFETY: nothing uses the pass.
                unsafe { device.raw().destroy_render_pass(pass, None) };
                Err(e)
            }
        }
    }

    /// Forgets the window images, which are about to go. Only when the GPU is done with them.
    pub fn forget_images(&mut self) {
        for (_, framebuffer) in self.framebuffers.drain() {
            // SAFETY: the caller has waited.
            unsafe { self.device.raw().destroy_framebuffer(framebuffer, None) };
        }
    }

    /// Takes over what has changed in the overlay's textures; waits for the GPU where anything has.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn update(&mut self, textures: &egui::TexturesDelta) -> Result<(), GpuError> {
        if textures.is_empty() {
            return Ok(());
        }
        // Frames in flight may still show what is replaced.
        self.device.wait_idle()?;
        for id in &textures.free {
            self.renderer.free_texture(*id).map_err(failed)?;
        }
        let queue = self.device.queue();
        for (id, deltas) in &textures.set {
            for delta in deltas {
                self.renderer
                    .set_texture(*queue, self.pool, *id, delta)
                    .map_err(failed)?;
            }
        }
        Ok(())
    }

    /// Records the overlay over a window image, which is in the layout of [`Access::ColorWrite`] and is left in that of
    /// [`Access::Present`].
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&mut self, cmd: &Commands<'_>, target: &Image, painting: &Painting) -> Result<(), GpuError> {
        let extent = vk::Extent2D {
            width: target.width(),
            height: target.height(),
        };
        let framebuffer = self.framebuffer(target.view(), extent)?;
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass)
            .framebuffer(framebuffer)
            .render_area(extent.into());
        // SAFETY: the framebuffer is of this pass and image; the commands are being recorded.
        unsafe {
            let raw = self.device.raw();
            raw.cmd_begin_render_pass(cmd.raw(), &begin, vk::SubpassContents::INLINE);
            let drawn = self
                .renderer
                .cmd_draw(cmd.raw(), extent, painting.scale, &painting.primitives);
            raw.cmd_end_render_pass(cmd.raw());
            drawn.map_err(failed)?;
        }
        cmd.transition(target, Access::ColorWrite, Access::Present);
        Ok(())
    }

    fn framebuffer(&mut self, view: vk::ImageView, extent: vk::Extent2D) -> Result<vk::Framebuffer, GpuError> {
        if let Some(made) = self.framebuffers.get(&view) {
            return Ok(*made);
        }
        let views = [view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(self.pass)
            .attachments(&views)
            .width(extent.width)
            .height(extent.height)
            .layers(1);
        // SAFETY: the view lives until `forget_images`.
        let made = unsafe { self.device.raw().create_framebuffer(&info, None) }
            .map_err(|e| GpuError::from_vulkan("the creation of the overlay", e))?;
        self.framebuffers.insert(view, made);
        Ok(made)
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        if let Err(error) = self.device.wait_idle() {
            tracing::debug!("{error}");
        }
        self.forget_images();
        // SAFETY: the GPU is done; the renderer is dropped once, before the device that it was made from.
        unsafe {
            ManuallyDrop::drop(&mut self.renderer);
            self.device.raw().destroy_command_pool(self.pool, None);
            self.device.raw().destroy_render_pass(self.pass, None);
        }
    }
}

/// A pass that keeps what the image shows.
fn render_pass(device: &Arc<Device>, format: vk::Format) -> Result<vk::RenderPass, GpuError> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let attachments = [vk::AttachmentDescription::default()
        .format(format)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::LOAD)
        .store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(layout)
        .final_layout(layout)];
    let colours = [vk::AttachmentReference::default().attachment(0).layout(layout)];
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&colours)];
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses);
    // SAFETY: the structures are complete.
    unsafe { device.raw().create_render_pass(&info, None) }
        .map_err(|e| GpuError::from_vulkan("the creation of the overlay", e))
}
