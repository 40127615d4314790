//! Direct stage: next-event estimation at the G-buffer's surfaces.
//! Shader: `shaders/direct.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::strata::Strata;
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Direct(Pass);

impl Direct {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "direct", true).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, counters: &Buffer, strata: &Strata) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let uses = [
            Use::image(g.albedo(), Access::ComputeRead),
            Use::image(g.position(), Access::ComputeRead),
            Use::image(g.surface(), Access::ComputeRead),
            Use::image(g.object(), Access::ComputeRead),
            Use::image(g.direct(), Access::ComputeWrite),
            Use::buffer(counters, Access::ComputeReadWrite),
            Use::buffer(&strata.buffer, Access::ComputeWrite),
        ];
        self.0.record_image(r, &uses)
    }
}
