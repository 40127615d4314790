//! Deform stage: dynamic triangles where the clock has them. Nothing is uploaded; the driver's structures over them are refitted.
//! Shader: `shaders/deform.comp`.

use super::pass::{Pass, PassContext, Recorder};
use crate::gpu::acceleration::{BottomLevel, Refit};
use crate::gpu::{Access, GpuError, Use};

/// Threads of a work group.
const GROUP: u32 = 64;

/// The pass.
pub struct Deform(Pass);

impl Deform {
    /// Makes the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn new(context: &PassContext<'_>) -> Result<Self, GpuError> {
        Pass::new(context, "deform", false).map(Self)
    }

    /// Records the pass.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn record(&self, r: &mut Recorder<'_>) -> Result<(), GpuError> {
        let scene = r.scene;
        let moved = [
            &scene.positions,
            &scene.attributes,
            &scene.bvh.cwbvh_triangles,
            &scene.bvh.bvh2_triangles,
        ];
        let written: Vec<_> = moved.iter().map(|b| Use::buffer(b, Access::ComputeReadWrite)).collect();
        self.0
            .record(r, &written, [scene.dynamic_triangles_count.div_ceil(GROUP), 1, 1])?;
        if let Some(driver) = &scene.driver {
            let refits = || driver.refits.iter().filter_map(|r| Some((r, driver.bottom(r.mesh)?)));
            let mut uses = vec![Use::buffer(&scene.positions, Access::BuildInput)];
            uses.extend(refits().map(|(_, level)| Use::resource(level.id(), Access::BuildWrite)));
            r.tracker.pass(r.cmd, &uses)?;
            for (refit, level) in refits() {
                let one = Refit {
                    bottom: level,
                    geometries: &refit.geometries,
                    rebuild: false,
                };
                BottomLevel::record_refits(r.cmd, &[one], &refit.scratch)?;
            }
            let built: Vec<_> = refits()
                .map(|(_, level)| Use::resource(level.id(), Access::BuildRead))
                .collect();
            r.tracker.pass(r.cmd, &built)?;
        }
        // What follows reads all of it without saying so: scenes are still otherwise.
        let read: Vec<_> = moved.iter().map(|b| Use::buffer(b, Access::ComputeRead)).collect();
        r.tracker.pass(r.cmd, &read)
    }
}
