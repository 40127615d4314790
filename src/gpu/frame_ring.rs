//! Frames in flight: while the GPU works on one frame, the CPU records the next.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::error::Context;
use super::{Commands, Device, GpuError, ScopeTime, Timestamps};

/// Semaphores of a submission, both usually those of a swapchain.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubmitSync {
    /// Semaphore to wait for, and the stages that wait.
    pub wait: Option<(vk::Semaphore, vk::PipelineStageFlags)>,
    /// Semaphore to signal.
    pub signal: Option<vk::Semaphore>,
}

/// What an earlier frame took.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTimings {
    /// Number of that frame.
    pub frame: u64,
    /// Its scopes, in order of beginning.
    pub scopes: Vec<ScopeTime>,
}

/// What one frame in flight needs. Destroyed on drop, which is only sound when its commands are done.
struct Slot {
    device: Arc<Device>,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timestamps: Timestamps,
    /// Submitted and not yet waited for.
    pending: bool,
    retired: Mutex<Vec<Box<dyn Any + Send>>>,
    frame_index: u64,
}

/// A ring of slots, one per frame in flight, each with its command buffer, fence, timers and retired objects.
///
/// Dropping it waits for the GPU.
pub struct FrameRing {
    device: Arc<Device>,
    slots: Vec<Slot>,
    next_frame: u64,
}

/// A frame being recorded. Dropping it without [`Frame::submit`] abandons what was recorded.
pub struct Frame<'r> {
    device: &'r Arc<Device>,
    slot: &'r mut Slot,
    slot_index: usize,
    timings: Option<FrameTimings>,
}

impl FrameRing {
    /// Makes a ring of `frames` frames in flight (at least 1), each with up to `timers` timed scopes.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Arc<Device>, frames: usize, timers: u32) -> Result<Self, GpuError> {
        let slots = (0..frames.max(1))
            .map(|_| Slot::new(device, timers))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            device: device.clone(),
            slots,
            next_frame: 0,
        })
    }

    /// Number of frames in flight.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Never true; a ring has at least one frame.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Waits until the oldest frame in flight is done, drops what it retired, and begins the next in its place.
    ///
    /// # Errors
    /// Device loss, out of memory.
    pub fn begin(&mut self) -> Result<Frame<'_>, GpuError> {
        let slot_index = (self.next_frame % self.slots.len() as u64) as usize;
        let slot = &mut self.slots[slot_index];
        let was_pending = slot.pending;
        slot.wait()?;
        let timings = if was_pending {
            slot.timestamps.read()?.map(|scopes| FrameTimings {
                frame: slot.frame_index,
                scopes,
            })
        } else {
            None
        };
        slot.frame_index = self.next_frame;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's earlier commands are done, so its pool may be reset.
        unsafe {
            self.device
                .raw()
                .reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty())
                .context("the reset of a frame")?;
            self.device
                .raw()
                .begin_command_buffer(slot.commands, &begin)
                .context("the begin of a frame")?;
        }
        self.next_frame += 1;
        let frame = Frame {
            device: &self.device,
            slot,
            slot_index,
            timings,
        };
        frame.timestamps().reset(&frame.commands());
        Ok(frame)
    }

    /// Waits for all frames in flight and drops what they retired.
    ///
    /// # Errors
    /// Device loss.
    pub fn wait(&mut self) -> Result<(), GpuError> {
        self.slots.iter_mut().try_for_each(Slot::wait)
    }
}

impl Drop for FrameRing {
    fn drop(&mut self) {
        if let Err(error) = self.wait() {
            tracing::warn!("{error}");
        }
    }
}

impl Slot {
    fn new(device: &Arc<Device>, timers: u32) -> Result<Self, GpuError> {
        let what = "the creation of the frames in flight";
        let mut slot = Self {
            device: device.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            timestamps: Timestamps::new(device, timers)?,
            pending: false,
            retired: Mutex::default(),
            frame_index: 0,
        };
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the structures are complete; `Drop` destroys what was made, also on error.
        unsafe {
            slot.pool = device.raw().create_command_pool(&pool_info, None).context(what)?;
            slot.fence = device
                .raw()
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .context(what)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(slot.pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            slot.commands = device.raw().allocate_command_buffers(&info).context(what)?[0];
        }
        Ok(slot)
    }

    fn wait(&mut self) -> Result<(), GpuError> {
        if self.pending {
            // SAFETY: the fence was given to a submission.
            let waited = unsafe { self.device.raw().wait_for_fences(&[self.fence], true, u64::MAX) };
            // A lost device will not signal any more; waiting again would only fail again.
            self.pending = false;
            waited.context("the wait for a frame")?;
        }
        self.retired.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
        Ok(())
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        // SAFETY: the ring has waited for the slot (or the device is lost); null handles are ignored.
        unsafe {
            self.device.raw().destroy_fence(self.fence, None);
            self.device.raw().destroy_command_pool(self.pool, None);
        }
    }
}

impl Frame<'_> {
    /// The frame's command buffer.
    pub fn commands(&self) -> Commands<'_> {
        // SAFETY: the buffer was begun by `FrameRing::begin` and is ended only by `submit`, which takes `self`.
        unsafe { Commands::from_raw(self.device, self.slot.commands) }
    }

    /// Index of the slot, `0..ring.len()`: which of the per-slot buffers and descriptor sets may be written now.
    pub fn slot(&self) -> usize {
        self.slot_index
    }

    /// Number of this frame, counted from 0.
    pub fn index(&self) -> u64 {
        self.slot.frame_index
    }

    /// The frame's timers.
    pub fn timestamps(&self) -> &Timestamps {
        &self.slot.timestamps
    }

    /// Timings of the frame that last used this slot; `None` without timestamps and
    /// in the first round.
    pub fn timings(&self) -> Option<&FrameTimings> {
        self.timings.as_ref()
    }

    /// Keeps `object` alive until the GPU is done with this frame.
    pub fn retire(&self, object: impl Any + Send) {
        self.slot
            .retired
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(Box::new(object));
    }

    /// Submits what was recorded, without waiting for it.
    ///
    /// # Errors
    /// Device loss, out of memory.
    pub fn submit(self, sync: SubmitSync) -> Result<(), GpuError> {
        let raw = self.device.raw();
        let commands = [self.slot.commands];
        let (waits, stages): (Vec<_>, Vec<_>) = sync.wait.into_iter().unzip();
        let signals: Vec<_> = sync.signal.into_iter().collect();
        let submit = [vk::SubmitInfo::default()
            .command_buffers(&commands)
            .wait_semaphores(&waits)
            .wait_dst_stage_mask(&stages)
            .signal_semaphores(&signals)];
        let queue = self.device.queue();
        // SAFETY: recording has begun; the queue is locked; the fence is not in use (see `FrameRing::begin`).
        unsafe {
            raw.end_command_buffer(self.slot.commands)
                .context("the end of a frame")?;
            raw.reset_fences(&[self.slot.fence])
                .context("the submission of a frame")?;
            raw.queue_submit(*queue, &submit, self.slot.fence)
                .context("the submission of a frame")?;
        }
        self.slot.pending = true;
        Ok(())
    }
}
