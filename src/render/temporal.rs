//! Temporal stage of the denoiser: this frame blended with the history of its surfaces.
//! Shader: `shaders/temporal.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// Signals that are denoised apart: `shaders/include/channel.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Irradiance by direct light.
    Direct,
    /// Radiance of what branches off.
    Secondary,
}

/// The pass, a pipeline per channel.
pub struct Temporal {
    direct: Pass,
    secondary: Pass,
}

impl Temporal {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Ok(Self {
            direct: Pass::new(context, "temporal", false)?,
            secondary: Pass::new(context, "secondary_temporal", false)?,
        })
    }

    /// Records the pass for a channel.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, channel: Channel, counters: &Buffer) -> Result<(), GpuError> {
        let g = r.gbuffer;
        let (pass, sampled, guide, colour, moments) = match channel {
            Channel::Direct => (&self.direct, g.direct(), g.guide(), g.irradiance(), g.moments()),
            Channel::Secondary => (
                &self.secondary,
                g.secondary(),
                g.secondary_guide(),
                g.secondary_radiance(),
                g.secondary_moments(),
            ),
        };
        let read = [
            sampled,
            g.motion(),
            g.gradient_a(),
            guide.now(g.parity),
            guide.before(g.parity),
            colour.before(g.parity),
            moments.before(g.parity),
        ];
        let written = [g.filter_a(), colour.now(g.parity), moments.now(g.parity)];
        let mut uses: Vec<_> = read.map(|i| Use::image(i, Access::ComputeRead)).into();
        uses.extend(written.map(|i| Use::image(i, Access::ComputeWrite)));
        uses.push(Use::buffer(counters, Access::ComputeReadWrite));
        pass.record_image(r, &uses)
    }
}
