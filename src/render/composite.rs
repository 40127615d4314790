//! Composition of the stages to radiance, and accumulation over samples.
//! Shader: `shaders/composite.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, GpuError, Use};

/// The pass.
pub struct Composite(Pass);

impl Composite {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "composite", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let mut uses = Vec::new();
        for image in [
            g.albedo(),
            g.position(),
            g.surface(),
            g.direct(),
            g.emission(),
            g.share(),
            g.layers(),
            g.secondary(),
            g.filter_a(),
            g.filter_b(),
        ] {
            uses.push(Use::image(image, Access::ComputeRead));
        }
        uses.push(Use::image(g.composite(), Access::ComputeWrite));
        for image in [
            g.mean(),
            g.compensation(),
            g.mean_direct(),
            g.mean_emission(),
            g.mean_layers(),
        ] {
            uses.push(Use::image(image, Access::ComputeReadWrite));
        }
        self.0.record_image(r, &uses)
    }
}
