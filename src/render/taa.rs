//! Temporal anti-aliasing of the composed radiance.
//! Shader: `shaders/taa.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Taa(Pass);

impl Taa {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "taa", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, exposure: &Buffer) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let read = [g.composite(), g.motion(), g.gradient_a(), g.taa().before(g.parity)];
        let mut uses: Vec<_> = read.map(|i| Use::image(i, Access::ComputeRead)).into();
        uses.push(Use::buffer(exposure, Access::ComputeRead));
        uses.push(Use::image(g.taa().now(g.parity), Access::ComputeWrite));
        uses.push(Use::image(g.taa_mean(), Access::ComputeReadWrite));
        self.0.record_image(r, &uses)
    }
}
