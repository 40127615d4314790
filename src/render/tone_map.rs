//! Output: exposure, tone map, encoding, and views of intermediate images.
//! Shader: `shaders/tone_map.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct ToneMap(Pass);

impl ToneMap {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "tone_map", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, exposure: &Buffer) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let mut uses = vec![
            Use::buffer(exposure, Access::ComputeRead),
            Use::image(g.display(), Access::ComputeWrite),
        ];
        for image in [
            g.albedo(),
            g.position(),
            g.surface(),
            g.object(),
            g.emission(),
            g.direct(),
            g.composite(),
            g.mean(),
            g.motion(),
            g.filter_a(),
            g.filter_b(),
            g.gradient_a(),
            g.moments().now(g.parity),
            g.taa().now(g.parity),
        ] {
            uses.push(Use::image(image, Access::ComputeRead));
        }
        self.0.record_image(r, &uses)
    }
}
