//! From declared reads and writes to barriers: only where a hazard exists, and one barrier per pass.
//!
//! A pass says how it uses each resource ([`Access`]); [`HazardTracker`] remembers earlier uses and says what must be
//! waited for. It knows no GPU. [`super::Tracker`] adds the image layouts and records the barrier.

use std::collections::HashMap;

use ash::vk;
use ash::vk::{AccessFlags as A, PipelineStageFlags as S};

/// Identity of a resource on its device, never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(u64);

impl ResourceId {
    pub(super) fn new(id: u64) -> Self {
        Self(id)
    }
}

/// How a pass uses a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Access {
    /// Storage buffer, address or storage image, read in a compute shader. Images are in layout GENERAL.
    ComputeRead,
    /// The same, written.
    ComputeWrite,
    /// The same, read and written.
    ComputeReadWrite,
    /// Image sampled in a compute shader in layout SHADER_READ_ONLY_OPTIMAL.
    ComputeSampled,
    /// Acceleration structure traced in a compute shader.
    Trace,
    /// Arguments of an indirect dispatch.
    Indirect,
    /// Source of a copy or blit.
    TransferRead,
    /// Target of a copy, blit or fill.
    TransferWrite,
    /// Vertices, indices or instances read by an acceleration structure build.
    BuildInput,
    /// Acceleration structure read by a build (bottom levels under a top level) or copied.
    BuildRead,
    /// Acceleration structure or scratch memory written by a build, refit or copy.
    BuildWrite,
    /// Read by the CPU after the fence.
    HostRead,
    /// Image sampled in a fragment shader in layout SHADER_READ_ONLY_OPTIMAL.
    FragmentSampled,
    /// Image drawn to.
    ColorWrite,
    /// Image shown in a window.
    Present,
}

impl Access {
    const ALL: [Self; 15] = [
        Self::ComputeRead,
        Self::ComputeWrite,
        Self::ComputeReadWrite,
        Self::ComputeSampled,
        Self::Trace,
        Self::Indirect,
        Self::TransferRead,
        Self::TransferWrite,
        Self::BuildInput,
        Self::BuildRead,
        Self::BuildWrite,
        Self::HostRead,
        Self::FragmentSampled,
        Self::ColorWrite,
        Self::Present,
    ];

    /// Pipeline stages and kinds of access in Vulkan's terms.
    pub fn scope(self) -> (S, A) {
        match self {
            Self::ComputeRead | Self::ComputeSampled => (S::COMPUTE_SHADER, A::SHADER_READ),
            Self::ComputeWrite => (S::COMPUTE_SHADER, A::SHADER_WRITE),
            Self::ComputeReadWrite => (S::COMPUTE_SHADER, A::SHADER_READ | A::SHADER_WRITE),
            Self::Trace => (S::COMPUTE_SHADER, A::ACCELERATION_STRUCTURE_READ_KHR),
            Self::Indirect => (S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ),
            Self::TransferRead => (S::TRANSFER, A::TRANSFER_READ),
            Self::TransferWrite => (S::TRANSFER, A::TRANSFER_WRITE),
            Self::BuildInput => (S::ACCELERATION_STRUCTURE_BUILD_KHR, A::SHADER_READ),
            Self::BuildRead => (S::ACCELERATION_STRUCTURE_BUILD_KHR, A::ACCELERATION_STRUCTURE_READ_KHR),
            Self::BuildWrite => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR | A::ACCELERATION_STRUCTURE_WRITE_KHR,
            ),
            Self::HostRead => (S::HOST, A::HOST_READ),
            Self::FragmentSampled => (S::FRAGMENT_SHADER, A::SHADER_READ),
            Self::ColorWrite => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE,
            ),
            Self::Present => (S::BOTTOM_OF_PIPE, A::empty()),
        }
    }

    /// Does it change the resource?
    pub fn writes(self) -> bool {
        !self.write_mask().is_empty()
    }

    /// The layout that an image must be in.
    pub fn layout(self) -> vk::ImageLayout {
        match self {
            Self::ComputeSampled | Self::FragmentSampled => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            Self::TransferRead => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            Self::TransferWrite => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            Self::ColorWrite => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Self::Present => vk::ImageLayout::PRESENT_SRC_KHR,
            _ => vk::ImageLayout::GENERAL,
        }
    }

    fn write_mask(self) -> A {
        self.scope().1
            & (A::SHADER_WRITE | A::TRANSFER_WRITE | A::ACCELERATION_STRUCTURE_WRITE_KHR | A::COLOR_ATTACHMENT_WRITE)
    }
}

/// A global memory barrier; empty stages mean that nothing is waited for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Barrier {
    /// Stages waited for.
    pub src_stage: S,
    /// Writes made available.
    pub src_access: A,
    /// Stages that wait.
    pub dst_stage: S,
    /// Accesses to which the writes are made visible.
    pub dst_access: A,
}

impl Barrier {
    /// The barrier from one use to another.
    pub fn between(before: Access, after: Access) -> Self {
        let (dst_stage, dst_access) = after.scope();
        Self {
            src_stage: before.scope().0,
            src_access: before.write_mask(),
            dst_stage,
            dst_access,
        }
    }

    fn covers(&self, access: Access) -> bool {
        let (stage, mask) = access.scope();
        self.dst_stage.contains(stage) && self.dst_access.contains(mask)
    }
}

/// One use of one resource by a pass, for [`HazardTracker::pass`].
#[derive(Clone, Copy, Debug)]
pub(super) struct HazardUse {
    pub id: ResourceId,
    pub access: Access,
    /// The image changes its layout before this use, which counts as a write.
    pub relayout: bool,
}

/// What happened to a resource since it was last written.
#[derive(Default)]
struct History {
    written_by: Option<Access>,
    /// Bit set over [`Access`]: uses that see the last write.
    visible_to: u32,
    /// Reads since, and the stages that have been made to wait for each.
    reads: Vec<(Access, S)>,
}

/// Remembers how resources were used and finds hazards: read after write, write after write, write after read.
///
/// It follows the order of recording, so command buffers must be submitted in the order in which they were recorded.
#[derive(Default)]
pub(super) struct HazardTracker {
    resources: HashMap<ResourceId, History>,
}

impl HazardTracker {
    /// Notes the uses of a pass and returns the barrier needed before it, if any.
    pub(super) fn pass(&mut self, uses: &[HazardUse]) -> Option<Barrier> {
        let mut barrier = Barrier::default();
        let mut needed = false;
        for usage in uses {
            needed |= self.resources.entry(usage.id).or_default().require(usage, &mut barrier);
        }
        if needed {
            for history in self.resources.values_mut() {
                history.apply(&barrier);
            }
        }
        // Reads first: a pass that lists a resource as read and as written has both, whatever their order.
        for usage in uses {
            if let Some(history) = self.resources.get_mut(&usage.id) {
                history.note_read(usage, &barrier);
            }
        }
        for usage in uses.iter().filter(|usage| usage.access.writes()) {
            if let Some(history) = self.resources.get_mut(&usage.id) {
                *history = History {
                    written_by: Some(usage.access),
                    ..History::default()
                };
            }
        }
        needed.then_some(barrier)
    }

    /// Forgets a resource that is no more.
    pub fn forget(&mut self, id: ResourceId) {
        self.resources.remove(&id);
    }
}

impl History {
    /// Adds to `barrier` what `usage` must wait for; true if there is anything (or a layout to change).
    fn require(&self, usage: &HazardUse, barrier: &mut Barrier) -> bool {
        let (stage, mask) = usage.access.scope();
        let mut needed = usage.relayout;
        if let Some(write) = self.written_by
            && (self.visible_to & bit(usage.access) == 0 || usage.relayout)
        {
            barrier.src_stage |= write.scope().0;
            barrier.src_access |= write.write_mask();
            needed = true;
        }
        if usage.access.writes() || usage.relayout {
            for (read, waited) in &self.reads {
                if usage.relayout || !waited.contains(stage) {
                    barrier.src_stage |= read.scope().0;
                    needed = true;
                }
            }
        }
        if needed {
            barrier.dst_stage |= stage;
            barrier.dst_access |= mask;
        }
        needed
    }

    fn apply(&mut self, barrier: &Barrier) {
        if let Some(write) = self.written_by
            && barrier.src_stage.contains(write.scope().0)
            && barrier.src_access.contains(write.write_mask())
        {
            self.visible_to |= covered(barrier);
        }
        for (read, waited) in &mut self.reads {
            if barrier.src_stage.contains(read.scope().0) {
                *waited |= barrier.dst_stage;
            }
        }
    }

    fn note_read(&mut self, usage: &HazardUse, barrier: &Barrier) {
        if usage.relayout {
            *self = Self {
                written_by: Some(usage.access),
                visible_to: covered(barrier),
                reads: Vec::new(),
            };
        }
        if !usage.access.writes() {
            self.reads.retain(|(read, _)| *read != usage.access);
            self.reads.push((usage.access, S::empty()));
        }
    }
}

fn bit(access: Access) -> u32 {
    1 << access as u8
}

fn covered(barrier: &Barrier) -> u32 {
    Access::ALL
        .into_iter()
        .filter(|access| barrier.covers(*access))
        .map(bit)
        .fold(0, |set, bit| set | bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: ResourceId = ResourceId(1);
    const OTHER: ResourceId = ResourceId(2);

    fn pass(tracker: &mut HazardTracker, uses: &[(ResourceId, Access)]) -> Option<Barrier> {
        let uses: Vec<_> = uses
            .iter()
            .map(|&(id, access)| HazardUse {
                id,
                access,
                relayout: false,
            })
            .collect();
        tracker.pass(&uses)
    }

    #[test]
    fn first_use_needs_nothing() {
        let mut tracker = HazardTracker::default();
        assert_eq!(
            pass(
                &mut tracker,
                &[(IMAGE, Access::ComputeWrite), (OTHER, Access::ComputeRead)]
            ),
            None
        );
    }

    #[test]
    fn read_after_write_waits_once() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::ComputeWrite)]);
        let expected = Barrier::between(Access::ComputeWrite, Access::ComputeRead);
        assert_eq!(pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]), Some(expected));
        assert_eq!(pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]), None);
        assert!(pass(&mut tracker, &[(IMAGE, Access::TransferRead)]).is_some());
    }

    #[test]
    fn reads_after_reads_are_free_and_write_after_read_only_orders() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]);
        assert_eq!(pass(&mut tracker, &[(IMAGE, Access::TransferRead)]), None);
        let barrier = pass(&mut tracker, &[(IMAGE, Access::ComputeWrite)]).unwrap();
        assert_eq!(barrier.src_stage, S::COMPUTE_SHADER | S::TRANSFER);
        assert_eq!(barrier.src_access, A::empty());
        assert_eq!(barrier.dst_stage, S::COMPUTE_SHADER);
    }

    #[test]
    fn write_after_write_waits() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::TransferWrite)]);
        let barrier = pass(&mut tracker, &[(IMAGE, Access::ComputeReadWrite)]).unwrap();
        assert_eq!(
            barrier,
            Barrier::between(Access::TransferWrite, Access::ComputeReadWrite)
        );
        assert!(pass(&mut tracker, &[(IMAGE, Access::ComputeReadWrite)]).is_some());
    }

    #[test]
    fn one_barrier_serves_all_resources() {
        let mut tracker = HazardTracker::default();
        pass(
            &mut tracker,
            &[(IMAGE, Access::ComputeWrite), (OTHER, Access::ComputeWrite)],
        );
        assert!(pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]).is_some());
        // The barrier was global, so the other resource's write is visible as well.
        assert_eq!(pass(&mut tracker, &[(OTHER, Access::ComputeRead)]), None);
        // Both have been read since; the write must wait for the reads.
        let barrier = pass(&mut tracker, &[(OTHER, Access::ComputeWrite)]).unwrap();
        assert_eq!(
            barrier.src_access,
            A::SHADER_WRITE,
            "the earlier write is not visible to writers yet"
        );
    }

    #[test]
    fn read_and_write_in_one_pass_counts_as_write() {
        let mut tracker = HazardTracker::default();
        pass(
            &mut tracker,
            &[(IMAGE, Access::ComputeWrite), (IMAGE, Access::ComputeRead)],
        );
        assert!(pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]).is_some());
    }

    #[test]
    fn build_then_trace_then_rebuild() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::BuildWrite)]);
        let barrier = pass(&mut tracker, &[(IMAGE, Access::Trace)]).unwrap();
        assert_eq!(barrier.src_stage, S::ACCELERATION_STRUCTURE_BUILD_KHR);
        assert_eq!(barrier.src_access, A::ACCELERATION_STRUCTURE_WRITE_KHR);
        assert_eq!(barrier.dst_access, A::ACCELERATION_STRUCTURE_READ_KHR);
        let barrier = pass(&mut tracker, &[(IMAGE, Access::BuildWrite)]).unwrap();
        assert!(barrier.src_stage.contains(S::COMPUTE_SHADER));
    }

    #[test]
    fn a_layout_change_waits_for_readers_and_is_visible_to_its_user() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]);
        let change = HazardUse {
            id: IMAGE,
            access: Access::TransferRead,
            relayout: true,
        };
        let barrier = tracker.pass(&[change]).unwrap();
        assert_eq!((barrier.src_stage, barrier.dst_stage), (S::COMPUTE_SHADER, S::TRANSFER));
        assert_eq!(pass(&mut tracker, &[(IMAGE, Access::TransferRead)]), None);
    }

    #[test]
    fn forgotten_resources_start_afresh() {
        let mut tracker = HazardTracker::default();
        pass(&mut tracker, &[(IMAGE, Access::ComputeWrite)]);
        tracker.forget(IMAGE);
        assert_eq!(pass(&mut tracker, &[(IMAGE, Access::ComputeRead)]), None);
    }
}
