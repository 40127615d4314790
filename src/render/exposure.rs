//! Automatic exposure from the image's log-average luminance.
//! Shader: `shaders/exposure.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Exposure(Pass);

impl Exposure {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "exposure", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, exposure: &Buffer) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let uses = [
            Use::image(g.composite(), Access::ComputeRead),
            Use::image(g.mean(), Access::ComputeRead),
            Use::image(g.taa().now(g.parity), Access::ComputeRead),
            Use::buffer(exposure, Access::ComputeReadWrite),
        ];
        self.0.record(r, &uses, [1, 1, 1])
    }
}
