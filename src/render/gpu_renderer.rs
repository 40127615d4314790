//! Still images by a Vulkan device: the counterpart of [`crate::reference::CpuRenderer`].

use super::film::{Aovs, Film};
use super::frame::{FrameInput, FrameRenderer};
use super::scene_gpu::{RenderError, SceneGpu};
use super::settings::{Secondary, Settings};
use super::view_state::ViewState;
use crate::gpu::{Commands, GpuError, Image};
use crate::reference::direct::RayCounts;
use crate::scene::camera::{Camera, Shot};
use crate::scene::records::NONE;
use ash::vk;
use half::f16;
use std::ops::Range;

/// Makes accumulated images and AOVs of a scene on the GPU.
pub struct GpuRenderer<'a> {
    pub scene: &'a SceneGpu,
    pub frames: FrameRenderer,
}

/// What an image of four channels holds, in single or half precision, row by row.
///
/// # Errors
/// [`GpuError`] of the copy.
pub fn floats(image: &Image) -> Result<Vec<[f32; 4]>, GpuError> {
    let bytes = image.read_back(0)?;
    if image.format() == vk::Format::R16G16B16A16_SFLOAT {
        let halves = |pixel: &[u8]| bytemuck::pod_read_unaligned::<[u16; 4]>(pixel).map(|h| f16::from_bits(h).to_f32());
        return Ok(bytes.chunks_exact(8).map(halves).collect());
    }
    Ok(bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
}

fn words(image: &Image) -> Result<Vec<[u32; 4]>, GpuError> {
    Ok(image
        .read_back(0)?
        .chunks_exact(16)
        .map(bytemuck::pod_read_unaligned)
        .collect())
}

/// Unit vector of octahedral 2 x 16 signed normalised bits.
fn unpack_normal(bits: u32) -> [f32; 3] {
    let part = |b: u32| (f32::from(b as u16 as i16) / 32767.0).max(-1.0);
    let (x, y) = (part(bits & 0xffff), part(bits >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f32, b: f32| (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    glam::Vec3::new(x, y, z).normalize().into()
}

impl<'a> GpuRenderer<'a> {
    /// Makes the pipelines.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(scene: &'a SceneGpu) -> Result<Self, RenderError> {
        Ok(Self {
            frames: FrameRenderer::new(scene, None)?,
            scene,
        })
    }

    /// A view of this scene.
    ///
    /// # Errors
    /// [`RenderError`], out of memory above all.
    pub fn view(&self, size: (u32, u32)) -> Result<ViewState, RenderError> {
        Ok(ViewState::new(&self.scene.device, &self.frames.view_layout, size, 1)?)
    }

    /// Renders one frame of a view and waits for it.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn frame(&self, view: &mut ViewState, input: &FrameInput) -> Result<(), RenderError> {
        let device = &self.scene.device;
        let record = |cmd: &Commands<'_>| {
            let recorded = self.frames.record(cmd, None, self.scene, view, 0, input);
            recorded.map_err(|e| match e {
                RenderError::Gpu(e) => e,
                other => GpuError::InvalidInput(other.to_string()),
            })
        };
        Ok(device.submit_once("frame", record)?)
    }

    /// Takes sample `index` into a view's accumulation of which it is number `accumulated`, counted from 1.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn accumulate_one(
        &self,
        view: &mut ViewState,
        camera: &Camera,
        settings: &Settings,
        index: u32,
        accumulated: u32,
    ) -> Result<(), RenderError> {
        let input = FrameInput {
            camera: *camera,
            settings: *settings,
            lights: &[],
            polygons: &[],
            entities: &[],
            sample_index: index,
            accumulated,
            exposure_blend: 1.0,
            reuse: false,
            output: false,
        };
        self.frame(view, &input)
    }

    /// Mean of independent samples `range` of every pixel. `progress` is called with the share done, 0..1.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn accumulate(
        &self,
        camera: impl Into<Shot>,
        size: (u32, u32),
        settings: &Settings,
        range: Range<u32>,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<(Film, RayCounts), RenderError> {
        let camera = camera.into();
        let mut view = self.view(size)?;
        let count = range.len() as u32;
        for (n, index) in range.enumerate() {
            let now = camera.at(settings.shutter_share(index));
            self.accumulate_one(&mut view, &now, &settings.at_sample(index), index, n as u32 + 1)?;
            progress((n + 1) as f32 / count as f32);
        }
        let (mut counts, _) = view.take_counts(0)?;
        counts.primary = u64::from(size.0) * u64::from(size.1) * u64::from(count);
        Ok((film(&view, count)?, counts))
    }

    /// Geometry through pixel centres.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn aovs(&self, camera: &Camera, size: (u32, u32), settings: &Settings) -> Result<Aovs, RenderError> {
        let mut view = self.view(size)?;
        let still = Settings {
            antialiasing: false,
            aperture: 0.0,
            random_lights: 1,
            choose_layers: false,
            secondary: Secondary::Off,
            ..*settings
        };
        self.accumulate_one(&mut view, camera, &still, 0, 1)?;
        let g = &view.gbuffer;
        let (albedo, position) = (floats(g.albedo())?, floats(g.position())?);
        let (surface, object) = (words(g.surface())?, words(g.object())?);
        let motion = floats(g.motion())?;
        let rgb = |p: &[f32; 4]| [p[0], p[1], p[2]];
        let number = |n: u32| if n == NONE { -1.0 } else { n as f32 };
        let normal = |bits: u32, hit: bool| if hit { unpack_normal(bits) } else { [0.0; 3] };
        let hit: Vec<bool> = object.iter().map(|o| o[0] != NONE).collect();
        Ok(Aovs {
            width: size.0,
            height: size.1,
            albedo: albedo.iter().map(rgb).collect(),
            normal: surface.iter().zip(&hit).map(|(s, h)| normal(s[0], *h)).collect(),
            geo_normal: surface.iter().zip(&hit).map(|(s, h)| normal(s[1], *h)).collect(),
            position: position.iter().map(rgb).collect(),
            depth: position.iter().map(|p| p[3]).collect(),
            motion: motion.iter().map(|m| [m[0], m[1]]).collect(),
            cluster: object.iter().map(|o| number(o[3])).collect(),
            material: surface.iter().map(|s| number(s[2])).collect(),
        })
    }
}

/// Radiance of the frame that a view shows, for itself.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn radiance(view: &ViewState) -> Result<Vec<[f32; 3]>, RenderError> {
    let g = &view.gbuffer;
    let image = if view.anti_aliased {
        g.taa().now(g.parity)
    } else {
        g.composite()
    };
    Ok(floats(image)?.iter().map(|p| [p[0], p[1], p[2]]).collect())
}

/// How many frames the denoiser's history of each pixel holds.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn history_lengths(view: &ViewState) -> Result<Vec<f32>, RenderError> {
    let g = &view.gbuffer;
    Ok(floats(g.moments().now(g.parity))?.iter().map(|m| m[2]).collect())
}

/// The frame that a view shows, as a film of one sample.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn shown_film(view: &ViewState) -> Result<Film, RenderError> {
    let g = &view.gbuffer;
    let mut film = Film::new(g.size.0, g.size.1);
    film.mean = radiance(view)?;
    film.samples.fill(1.0);
    let (emission, share, layers) = (floats(g.emission())?, floats(g.share())?, floats(g.layers())?);
    let secondary = if view.branches_off {
        floats(g.secondary())?
    } else {
        vec![[0.0; 4]; film.mean.len()]
    };
    for i in 0..film.mean.len() {
        for c in 0..3 {
            // Anti-aliasing mixes neighbours: what a pixel's centre emits may be more than the pixel shows.
            let shown = film.mean[i][c];
            film.transparent[i][c] = (layers[i][c] + secondary[i][c]).min(shown);
            film.emission[i][c] = (emission[i][c] * share[i][c]).min(shown - film.transparent[i][c]);
            film.direct[i][c] = shown - film.transparent[i][c] - film.emission[i][c];
        }
    }
    Ok(film)
}

/// The accumulated image of a view after `count` samples.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn film(view: &ViewState, count: u32) -> Result<Film, RenderError> {
    let g = &view.gbuffer;
    let mut film = Film::new(g.size.0, g.size.1);
    let (sums, lost) = (floats(g.mean())?, floats(g.compensation())?);
    let (direct, emission) = (floats(g.mean_direct())?, floats(g.mean_emission())?);
    let layers = floats(g.mean_layers())?;
    let n = f64::from(count.max(1));
    for i in 0..film.mean.len() {
        film.samples[i] = count as f32;
        for c in 0..3 {
            let mean = (f64::from(sums[i][c]) - f64::from(lost[i][c])) / n;
            // The shares are summed without compensation and drift with the number of samples: they are used as shares.
            let [direct, emission, layers] = [direct[i][c], emission[i][c], layers[i][c]].map(f64::from);
            let sum = direct + emission + layers;
            let scale = if sum > 0.0 { mean / sum } else { 0.0 };
            film.mean[i][c] = mean as f32;
            film.direct[i][c] = (direct * scale) as f32;
            film.emission[i][c] = (emission * scale) as f32;
            film.transparent[i][c] = (layers * scale) as f32;
        }
        if count > 1 {
            film.variance[i] = (f64::from(sums[i][3]) / (n * (n - 1.0))) as f32;
        }
    }
    Ok(film)
}
