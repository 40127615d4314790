//! Reuse stage: light samples of neighbours, and direct light by the one that is kept.
//! Shader: `shaders/reuse.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::reservoirs::Reservoirs;
use super::strata::Strata;
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Reuse(Pass);

impl Reuse {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "reuse", true).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(
        &self,
        r: &mut Recorder<'_>,
        counters: &Buffer,
        reservoirs: &Reservoirs,
        strata: &Strata,
    ) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let uses = [
            Use::image(g.position(), Access::ComputeRead),
            Use::image(g.object(), Access::ComputeRead),
            Use::image(g.direct(), Access::ComputeWrite),
            Use::buffer(&reservoirs.current, Access::ComputeRead),
            Use::buffer(&reservoirs.history, Access::ComputeWrite),
            Use::buffer(counters, Access::ComputeReadWrite),
            Use::buffer(&strata.buffer, Access::ComputeWrite),
        ];
        self.0.record_image(r, &uses)
    }
}
