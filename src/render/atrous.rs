//! Spatial filter of the denoiser, level by level.
//! Shader: `shaders/atrous.comp`.

use super::gbuffer::{GBuffer, History};
use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, GpuError, Use};

/// Labels and timing rows of the levels.
const LABELS: [&str; 5] = ["atrous0", "atrous1", "atrous2", "atrous3", "atrous4"];
const SECONDARY_LABELS: [&str; 3] = ["secondary_atrous0", "secondary_atrous1", "secondary_atrous2"];

/// Pixels that a work group makes, the rows a step of its level apart.
const GROUP: [u32; 2] = [32, 8];

/// Work groups of a level.
fn groups(size: (u32, u32), level: u32) -> [u32; 3] {
    let step = 1 << level;
    [size.0.div_ceil(GROUP[0]), size.1.div_ceil(GROUP[1] * step) * step, 1]
}

/// The pass: a pipeline per channel and level, whose distances are constants then.
pub struct Atrous {
    direct: [Pass; LABELS.len()],
    secondary: [Pass; SECONDARY_LABELS.len()],
}

impl Atrous {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        let level = |name, level: u32| Pass::specialized(context, name, false, &[(0, level)]);
        let direct = |n| level("atrous", n);
        let secondary = |n| level("secondary_atrous", n);
        Ok(Self {
            direct: [direct(0)?, direct(1)?, direct(2)?, direct(3)?, direct(4)?],
            secondary: [secondary(0)?, secondary(1)?, secondary(2)?],
        })
    }

    /// Records so many levels of the direct channel; afterwards the result is in `filter_b` where their number is odd, else in
    /// `filter_a`.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, levels: u32) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let kept = [g.guide(), g.moments(), g.irradiance()];
        for ((level, label), pass) in (0..levels).zip(LABELS).zip(&self.direct) {
            let uses = uses(g, level, kept);
            pass.record_as(label, r, &uses, groups(g.size, level))?;
        }
        Ok(())
    }

    /// Records so many levels of the secondary channel, one at least; afterwards the result is in `secondary`.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record_secondary(&self, r: &mut Recorder<'_>, levels: u32) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let kept = [g.secondary_guide(), g.secondary_moments(), g.secondary_radiance()];
        for ((level, label), pass) in (0..levels.max(1)).zip(SECONDARY_LABELS).zip(&self.secondary) {
            let mut uses = uses(g, level, kept);
            uses.push(Use::image(g.secondary(), Access::ComputeWrite));
            pass.record_as(label, r, &uses, groups(g.size, level))?;
        }
        Ok(())
    }
}

/// What a level reads and writes. `kept`: guide, moments and what the next frame starts from, of the channel.
fn uses<'a>(g: &'a GBuffer, level: u32, kept: [&'a History; 3]) -> Vec<Use<'a>> {
    let (from, to) = if level.is_multiple_of(2) {
        (g.filter_a(), g.filter_b())
    } else {
        (g.filter_b(), g.filter_a())
    };
    let [guide, moments, colour] = kept.map(|history| history.now(g.parity));
    let mut uses = vec![
        Use::image(from, Access::ComputeRead),
        Use::image(guide, Access::ComputeRead),
        Use::image(to, Access::ComputeWrite),
    ];
    if level == 0 {
        // The first level's result is what the next frame starts from.
        uses.push(Use::image(moments, Access::ComputeRead));
        uses.push(Use::image(colour, Access::ComputeWrite));
    }
    uses
}
