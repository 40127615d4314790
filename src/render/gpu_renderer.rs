//! Still images by a Vulkan device: the counterpart of [`crate::reference::CpuRenderer`].

use super::film::{Aovs, Film};
use super::frame::{FrameInput, FrameRenderer};
use super::scene_gpu::{RenderError, SceneGpu};
use super::settings::Settings;
use super::view_state::ViewState;
use crate::gpu::{GpuError, Image};
use crate::reference::direct::RayCounts;
use crate::scene::camera::Camera;
use crate::scene::records::NONE;
use std::ops::Range;

/// Makes accumulated images and AOVs of a scene on the GPU.
pub struct GpuRenderer<'a> {
    pub scene: &'a SceneGpu,
    pub frames: FrameRenderer,
}

fn floats(image: &Image) -> Result<Vec<[f32; 4]>, GpuError> {
    Ok(image
        .read_back(0)?
        .chunks_exact(16)
        .map(bytemuck::pod_read_unaligned)
        .collect())
}

fn words(image: &Image) -> Result<Vec<[u32; 4]>, GpuError> {
    Ok(image
        .read_back(0)?
        .chunks_exact(16)
        .map(bytemuck::pod_read_unaligned)
        .collect())
}

fn halves(image: &Image) -> Result<Vec<[f32; 4]>, GpuError> {
    Ok(image
        .read_back(0)?
        .chunks_exact(8)
        .map(|texel| std::array::from_fn(|c| half_to_f32(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]]))))
        .collect())
}

/// IEEE 754 binary16 to binary32.
fn half_to_f32(h: u16) -> f32 {
    let sign = if h >> 15 == 1 { -1.0 } else { 1.0 };
    let exponent = i32::from(h >> 10 & 31);
    let mantissa = f32::from(h & 1023);
    match exponent {
        0 => sign * mantissa * (2f32).powi(-24),
        31 if mantissa == 0.0 => sign * f32::INFINITY,
        31 => f32::NAN,
        e => sign * (1.0 + mantissa / 1024.0) * (2f32).powi(e - 15),
    }
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
        Ok(device.submit_once("frame", |cmd| self.frames.record(cmd, None, self.scene, view, 0, input))?)
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
        camera: &Camera,
        size: (u32, u32),
        settings: &Settings,
        range: Range<u32>,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<(Film, RayCounts), RenderError> {
        let mut view = self.view(size)?;
        let count = range.len() as u32;
        for (n, index) in range.enumerate() {
            self.accumulate_one(&mut view, camera, settings, index, n as u32 + 1)?;
            progress((n + 1) as f32 / count as f32);
        }
        let mut counts = view.take_counts(0)?;
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
            ..*settings
        };
        self.accumulate_one(&mut view, camera, &still, 0, 1)?;
        let g = &view.gbuffer;
        let (albedo, position) = (floats(g.albedo())?, floats(g.position())?);
        let (surface, object) = (words(g.surface())?, words(g.object())?);
        let motion = halves(g.motion())?;
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
    let pixels = floats(view.gbuffer.composite())?;
    Ok(pixels.iter().map(|p| [p[0], p[1], p[2]]).collect())
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
    let n = f64::from(count.max(1));
    for i in 0..film.mean.len() {
        film.samples[i] = count as f32;
        for c in 0..3 {
            let mean = (f64::from(sums[i][c]) - f64::from(lost[i][c])) / n;
            // The shares are summed without compensation and drift with the number of samples: they are used as shares.
            let (direct, emission) = (f64::from(direct[i][c]), f64::from(emission[i][c]));
            let scale = if direct + emission > 0.0 {
                mean / (direct + emission)
            } else {
                0.0
            };
            film.mean[i][c] = mean as f32;
            film.direct[i][c] = (direct * scale) as f32;
            film.emission[i][c] = (emission * scale) as f32;
        }
        if count > 1 {
            film.variance[i] = (f64::from(sums[i][3]) / (n * (n - 1.0))) as f32;
        }
    }
    Ok(film)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_decode() {
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x0001, 5.960_464_5e-8),
            (0x7bff, 65504.0),
            (0x3555, 0.333_251_95),
        ] {
            assert_eq!(half_to_f32(bits), value);
        }
        assert!(half_to_f32(0x7e00).is_nan());
    }
}
