//! Camera rays. Counterpart of `shaders/primary.comp`.

use super::direct::SampleAddress;
use crate::render::settings::Settings;
use crate::scene::camera::{Axes, Camera};
use crate::scene::sampling::{DIM_LENS, DIM_PIXEL, disc, key, sample2};
use glam::Vec3;

/// A view prepared for one image size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: Vec3,
    axes: Axes,
    half: (f32, f32),
    size: (u32, u32),
    /// Distance to the plane in focus along the view direction, units.
    focus: f32,
    /// Width of a pixel at distance 1.
    pub pixel_width: f32,
}

/// A ray; the direction has length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    pub origin: Vec3,
    pub direction: Vec3,
}

impl View {
    /// `focus`: distance to the plane in focus along the view direction, units; only used with a lens.
    pub fn new(camera: &Camera, size: (u32, u32), focus: f32) -> Self {
        let half = camera.half_extent(size.0, size.1);
        Self {
            eye: camera.eye.into(),
            axes: camera.axes(),
            half,
            size,
            focus,
            pixel_width: 2.0 * half.0 / size.0 as f32,
        }
    }

    /// Ray through a point of the image: pixel coordinates with the origin at the top left.
    pub fn through(&self, x: f32, y: f32) -> CameraRay {
        let sx = (2.0 * x / self.size.0 as f32 - 1.0) * self.half.0;
        let sy = (1.0 - 2.0 * y / self.size.1 as f32) * self.half.1;
        CameraRay {
            origin: self.eye,
            direction: (self.axes.forward + self.axes.right * sx + self.axes.up * sy).normalize(),
        }
    }

    /// Ray of a sample: jittered inside the pixel, through a point of the lens.
    pub fn sample(&self, settings: &Settings, x: u32, y: u32, address: SampleAddress) -> CameraRay {
        let numbers = |dimension| {
            sample2(
                settings.sequence,
                key(settings.seed, address.pixel, dimension),
                address.index,
            )
        };
        let [jx, jy] = if settings.antialiasing {
            numbers(DIM_PIXEL)
        } else {
            [0.5; 2]
        };
        let ray = self.through(x as f32 + jx, y as f32 + jy);
        if settings.aperture <= 0.0 {
            return ray;
        }
        let [lx, ly] = disc(numbers(DIM_LENS));
        let origin = ray.origin + (self.axes.right * lx + self.axes.up * ly) * settings.aperture;
        let sharp = ray.origin + ray.direction * (self.focus / ray.direction.dot(self.axes.forward));
        CameraRay {
            origin,
            direction: (sharp - origin).normalize(),
        }
    }
}
