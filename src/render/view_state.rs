//! What one view keeps between frames: its images, exposure and counters.

use super::frame_constants::FrameConstants;
use super::gbuffer::GBuffer;
use super::guests::Guests;
use super::history::FrameHistory;
use super::moving::Moving;
use super::polygons::Polygons;
use super::reservoirs::Reservoirs;
use super::secondary::SecondaryPixels;
use super::strata::Strata;
use crate::gpu::{Buffer, DescriptorLayout, Device, GpuError, MemoryKind, Tracker};
use crate::reference::direct::RayCounts;
use crate::scene::entity_geometry::EntityState;
use ash::vk;
use std::sync::Arc;

/// Words of the counters buffer: 64 bits each for shadow rays and skipped light samples, then the sum of the history lengths of some
/// pixels and how many these are.
const COUNTER_WORDS: u64 = 6;

/// State of one view. One scene serves any number of them; each belongs to one caller at a time.
pub struct ViewState {
    pub gbuffer: GBuffer,
    pub tracker: Tracker,
    /// One set of constants per frame in flight.
    pub constants: Vec<Buffer>,
    pub exposure: Buffer,
    /// Distance in focus, one per frame in flight: the CPU writes a fixed one while an earlier frame may still run.
    pub focus: Vec<Buffer>,
    /// One set of counters per frame in flight, visible to the CPU.
    pub counters: Vec<Buffer>,
    /// Made when samples are first reused.
    pub reservoirs: Option<Reservoirs>,
    /// Made when a frame first shows a scene where something branches off.
    pub secondary_pixels: Option<SecondaryPixels>,
    pub strata: Strata,
    pub guests: Guests,
    pub polygons: Polygons,
    /// Entities of the frame before that were not as the map has them, and how often that has changed.
    pub entities: (Vec<EntityState>, u32),
    pub history: FrameHistory,
    /// Made when a frame first shows a scene in which something moves.
    pub moving: Option<Moving>,
    /// Whether the last frame shows the image `taa`, else `composite`.
    pub anti_aliased: bool,
    /// Whether the last frame followed what branches off: the image `secondary` is of it.
    pub branches_off: bool,
}

impl ViewState {
    /// Makes the images of a view.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(
        device: &Arc<Device>,
        layout: &Arc<DescriptorLayout>,
        size: (u32, u32),
        frames_in_flight: usize,
    ) -> Result<Self, GpuError> {
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let per_frame = |name: &str, size: u64, kind: MemoryKind| {
            (0..frames_in_flight)
                .map(|_| Buffer::new(device, name, size, storage, kind))
                .collect::<Result<Vec<_>, _>>()
        };
        let mut exposure = Buffer::new(device, "exposure", 4, storage, MemoryKind::Upload)?;
        exposure.write(0, &[0f32])?;
        let mut focus = per_frame("focus", 4, MemoryKind::Upload)?;
        for f in &mut focus {
            f.write(0, &[0f32])?;
        }
        let mut counters = per_frame("counters", COUNTER_WORDS * 4, MemoryKind::Readback)?;
        for c in &mut counters {
            c.write(0, &[0u32; COUNTER_WORDS as usize])?;
        }
        Ok(Self {
            gbuffer: GBuffer::new(device, layout, size)?,
            tracker: Tracker::new(),
            constants: per_frame(
                "frame constants",
                size_of::<FrameConstants>() as u64,
                MemoryKind::Upload,
            )?,
            exposure,
            focus,
            counters,
            reservoirs: None,
            secondary_pixels: None,
            strata: Strata::new(device, size)?,
            guests: Guests::default(),
            polygons: Polygons::default(),
            entities: (Vec::new(), 0),
            history: FrameHistory::default(),
            moving: None,
            anti_aliased: false,
            branches_off: false,
        })
    }

    /// The reservoirs, made if there are none yet.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn reservoirs(&mut self, device: &Arc<Device>) -> Result<&mut Reservoirs, GpuError> {
        let made = match self.reservoirs.take() {
            Some(made) => made,
            None => Reservoirs::new(device, self.gbuffer.size)?,
        };
        Ok(self.reservoirs.insert(made))
    }

    /// The list of pixels for the secondary stage, made if there is none yet.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn secondary_pixels(&mut self, device: &Arc<Device>) -> Result<&SecondaryPixels, GpuError> {
        let made = match self.secondary_pixels.take() {
            Some(made) => made,
            None => SecondaryPixels::new(device, self.gbuffer.size)?,
        };
        Ok(self.secondary_pixels.insert(made))
    }

    /// Reads and clears the counters of a frame that has ended: its rays, and the mean length of its denoiser's history in frames where
    /// it was denoised.
    ///
    /// # Errors
    /// [`GpuError`] where the memory cannot be read.
    pub fn take_counts(&mut self, slot: usize) -> Result<(RayCounts, Option<f64>), GpuError> {
        let words: Vec<u32> = self.counters[slot].read()?;
        self.counters[slot].write(0, &[0u32; COUNTER_WORDS as usize])?;
        let pair = |i: usize| u64::from(words[i]) | u64::from(words[i + 1]) << 32;
        let rays = RayCounts {
            primary: 0,
            shadow: pair(0),
            shadow_skipped: pair(2),
        };
        let history = (words[5] > 0).then(|| f64::from(words[4]) / f64::from(words[5]));
        Ok((rays, history))
    }
}
