//! Spatial filter of the denoiser, level by level.
//! Shader: `shaders/atrous.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, GpuError, Use};

/// Labels and timing rows of the levels.
const LABELS: [&str; 5] = ["atrous0", "atrous1", "atrous2", "atrous3", "atrous4"];

/// Threads of a work group.
const GROUP: [u32; 2] = [16, 8];

/// The pass.
pub struct Atrous(Pass);

impl Atrous {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "atrous", false).map(Self)
    }

    /// Records so many levels; afterwards the result is in `filter_b` where their number is odd, else in `filter_a`.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, levels: u32) -> Result<(), GpuError> {
        let g = r.gbuffer;
        for (level, label) in (0..levels).zip(LABELS) {
            let (from, to) = if level % 2 == 0 {
                (g.filter_a(), g.filter_b())
            } else {
                (g.filter_b(), g.filter_a())
            };
            let mut uses = vec![
                Use::image(from, Access::ComputeRead),
                Use::image(g.guide().now(g.parity), Access::ComputeRead),
                Use::image(to, Access::ComputeWrite),
            ];
            if level == 0 {
                // The first level's result is what the next frame starts from.
                uses.push(Use::image(g.moments().now(g.parity), Access::ComputeRead));
                uses.push(Use::image(g.irradiance().now(g.parity), Access::ComputeWrite));
            }
            r.push.level = level;
            self.0.record_as(
                label,
                r,
                &uses,
                [g.size.0.div_ceil(GROUP[0]), g.size.1.div_ceil(GROUP[1]), 1],
            )?;
        }
        Ok(())
    }
}
