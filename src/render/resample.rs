//! Resample stage: light candidates, and what the surface had in the frame before.
//! Shader: `shaders/resample.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::reservoirs::Reservoirs;
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Resample(Pass);

impl Resample {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "resample", true).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, counters: &Buffer, reservoirs: &Reservoirs) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let uses = [
            Use::image(g.albedo(), Access::ComputeRead),
            Use::image(g.position(), Access::ComputeRead),
            Use::image(g.surface(), Access::ComputeRead),
            Use::buffer(&reservoirs.history, Access::ComputeRead),
            Use::buffer(&reservoirs.current, Access::ComputeWrite),
            Use::buffer(counters, Access::ComputeReadWrite),
        ];
        self.0.record_image(r, &uses)
    }
}
