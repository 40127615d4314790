//! Hazard tracking with image layouts, recorded into a command buffer.

use super::barrier::{HazardTracker, HazardUse};
use super::command::layout_changes;
use super::{Access, Buffer, Commands, GpuError, Image, ResourceId};

/// One use of one resource by a pass.
#[derive(Clone, Copy)]
pub struct Use<'a> {
    id: ResourceId,
    access: Access,
    image: Option<&'a Image>,
}

impl<'a> Use<'a> {
    /// A buffer.
    pub fn buffer(buffer: &Buffer, access: Access) -> Self {
        Self::resource(buffer.id(), access)
    }

    /// An image, all levels; it is brought to the layout that `access` needs.
    pub fn image(image: &'a Image, access: Access) -> Self {
        Self {
            id: image.id(),
            access,
            image: Some(image),
        }
    }

    /// Anything else that has an identity (an acceleration structure, memory behind an address).
    pub fn resource(id: ResourceId, access: Access) -> Self {
        Self {
            id,
            access,
            image: None,
        }
    }
}

/// Puts barriers between passes from what each pass declares. One per series of command buffers that are submitted in
/// the order of recording; it carries on from frame to frame.
#[derive(Default)]
pub struct Tracker {
    hazards: HazardTracker,
}

impl Tracker {
    /// A tracker that knows of no earlier uses.
    pub fn new() -> Self {
        Self::default()
    }

    /// To be called before a pass is recorded: waits for what `uses` conflict with and changes image layouts.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if a pass uses one image in two layouts.
    pub fn pass(&mut self, cmd: &Commands<'_>, uses: &[Use<'_>]) -> Result<(), GpuError> {
        let mut hazard_uses = Vec::with_capacity(uses.len());
        for (index, usage) in uses.iter().enumerate() {
            let layout = usage.access.layout();
            let clash = |other: &Use<'_>| other.id == usage.id && other.access.layout() != layout;
            if usage.image.is_some() && uses[..index].iter().any(clash) {
                return Err(GpuError::InvalidInput("a pass uses an image in two layouts".into()));
            }
            let relayout = usage
                .image
                .is_some_and(|image| (0..image.mips()).any(|mip| image.layout(mip) != layout));
            hazard_uses.push(HazardUse {
                id: usage.id,
                access: usage.access,
                relayout,
            });
        }
        if let Some(barrier) = self.hazards.pass(&hazard_uses) {
            let changes: Vec<_> = uses
                .iter()
                .filter_map(|usage| Some((usage.image?, usage.access)))
                .flat_map(|(image, access)| layout_changes(image, 0..image.mips(), &barrier, access.layout()))
                .collect();
            cmd.barrier_with_images(&barrier, &changes);
        }
        Ok(())
    }

    /// Forgets a resource that is no more.
    pub fn forget(&mut self, id: ResourceId) {
        self.hazards.forget(id);
    }
}
