//! Filter over the gradients of the denoiser.
//! Shader: `shaders/gradient_atrous.comp`.

use super::pass::{Pass, PassContext, Recorder};
use super::strata::strata_groups;
use crate::gpu::{Access, GpuError, Use};

/// Labels and timing rows of the levels: an even number, so that the result ends where it began.
const LABELS: [&str; 4] = [
    "gradient_atrous0",
    "gradient_atrous1",
    "gradient_atrous2",
    "gradient_atrous3",
];

/// The pass.
pub struct GradientAtrous(Pass);

impl GradientAtrous {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "gradient_atrous", false).map(Self)
    }

    /// Records the levels; the result is in `gradient_a` again.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>) -> Result<(), GpuError> {
        let g = r.gbuffer;
        for (level, label) in (0..).zip(LABELS) {
            let (from, to) = if level % 2 == 0 {
                (g.gradient_a(), g.gradient_b())
            } else {
                (g.gradient_b(), g.gradient_a())
            };
            let uses = [
                Use::image(from, Access::ComputeRead),
                Use::image(g.guide().now(g.parity), Access::ComputeRead),
                Use::image(to, Access::ComputeWrite),
            ];
            r.push.level = level;
            self.0.record_as(label, r, &uses, strata_groups(g.size))?;
        }
        Ok(())
    }
}
