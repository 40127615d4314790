//! Gradient stage of the denoiser: a sample of the frame before is shaded again.
//! Shader: `shaders/gradient.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::strata::{Strata, strata_groups};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Gradient(Pass);

impl Gradient {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "gradient", true).map(Self)
    }

    /// Records the pass, with one thread per stratum.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, counters: &Buffer, strata: &Strata) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let uses = [
            Use::image(g.motion(), Access::ComputeRead),
            Use::image(g.position(), Access::ComputeRead),
            Use::image(g.object(), Access::ComputeRead),
            Use::buffer(&strata.buffer, Access::ComputeRead),
            Use::buffer(counters, Access::ComputeReadWrite),
            Use::image(g.gradient_a(), Access::ComputeWrite),
        ];
        self.0.record(r, &uses, strata_groups(g.size))
    }
}
