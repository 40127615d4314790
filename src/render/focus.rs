//! Distance to what is under the crosshair, for depth of field.
//! Shader: `shaders/focus.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::{Access, Buffer, GpuError, Use};

/// The pass.
pub struct Focus(Pass);

impl Focus {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "focus", true).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>, focus: &Buffer) -> Result<(), GpuError> {
        self.0.record(r, &[Use::buffer(focus, Access::ComputeWrite)], [1, 1, 1])
    }
}
