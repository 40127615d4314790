//! Temporal stage of the denoiser: this frame blended with the history of its surfaces.
//! Shader: `shaders/temporal.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Temporal(Pass);

impl Temporal {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "temporal", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, counters: &Buffer) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let read = [
            g.direct(),
            g.motion(),
            g.gradient_a(),
            g.guide().now(g.parity),
            g.guide().before(g.parity),
            g.irradiance().before(g.parity),
            g.moments().before(g.parity),
        ];
        let written = [g.filter_a(), g.irradiance().now(g.parity), g.moments().now(g.parity)];
        let mut uses: Vec<_> = read.map(|i| Use::image(i, Access::ComputeRead)).into();
        uses.extend(written.map(|i| Use::image(i, Access::ComputeWrite)));
        uses.push(Use::buffer(counters, Access::ComputeReadWrite));
        self.0.record_image(r, &uses)
    }
}
