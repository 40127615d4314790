//! Primary stage: camera rays to the G-buffer.
//! Shader: `shaders/primary.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::secondary::SecondaryPixels;
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Primary(Pass);

impl Primary {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "primary", true).map(Self)
    }

    /// Records the pass. `secondary`: where pixels are listed of which something branches off.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(
        &self,
        r: &mut Recorder<'_>,
        focus: &Buffer,
        secondary: Option<&SecondaryPixels>,
    ) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let mut uses = vec![Use::buffer(focus, Access::ComputeRead)];
        uses.extend(secondary.map(|pixels| Use::buffer(&pixels.buffer, Access::ComputeReadWrite)));
        for image in [
            g.albedo(),
            g.position(),
            g.surface(),
            g.object(),
            g.view(),
            g.motion(),
            g.emission(),
            g.share(),
            g.layers(),
            g.secondary(),
            g.guide().now(g.parity),
            g.secondary_guide().now(g.parity),
        ] {
            uses.push(Use::image(image, Access::ComputeWrite));
        }
        self.0.record_image(r, &uses)
    }
}
