//! Bringing data to GPU memory: many copies through one staging buffer, in as few submissions as fit.

use std::sync::Arc;

use ash::vk;

use super::format::texel_size;
use super::image::subresource_layer;
use super::{Access, Buffer, Commands, Device, GpuError, Image, MemoryKind};

/// Staged data start at multiples of this: enough for every texel format and for vectorised copies.
const ALIGNMENT: u64 = 16;

enum Copy<'a> {
    Buffer {
        target: &'a Buffer,
        region: vk::BufferCopy,
    },
    Image {
        target: &'a Image,
        region: vk::BufferImageCopy,
    },
}

/// Collects uploads and sends them when the staging buffer is full and on [`Self::finish`].
///
/// Data are copied to the staging buffer at once, so they need not live on. Images are left in the layout of
/// [`Access::ComputeSampled`]. What is added but not finished may never arrive.
pub struct UploadBatch<'a> {
    device: Arc<Device>,
    staging: Buffer,
    used: u64,
    copies: Vec<Copy<'a>>,
    images: Vec<&'a Image>,
}

impl<'a> UploadBatch<'a> {
    /// Makes a batch with `staging_bytes` of staging memory (at least 64 KiB); larger data go in pieces.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Arc<Device>, staging_bytes: u64) -> Result<Self, GpuError> {
        let size = staging_bytes.max(64 << 10);
        let staging = Buffer::new(
            device,
            "staging",
            size,
            vk::BufferUsageFlags::empty(),
            MemoryKind::Upload,
        )?;
        Ok(Self {
            device: device.clone(),
            staging,
            used: 0,
            copies: Vec::new(),
            images: Vec::new(),
        })
    }

    /// Copies `data` to byte `offset` of `target`.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if it does not fit; what a full batch's submission returns.
    pub fn buffer<T: bytemuck::NoUninit>(
        &mut self,
        target: &'a Buffer,
        offset: u64,
        data: &[T],
    ) -> Result<(), GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        if offset
            .checked_add(bytes.len() as u64)
            .is_none_or(|end| end > target.size())
        {
            return Err(GpuError::InvalidInput(format!(
                "an upload of {} bytes at {offset} exceeds a buffer of {} bytes",
                bytes.len(),
                target.size()
            )));
        }
        let mut done = 0;
        while done < bytes.len() {
            let (piece, at) = self.stage(&bytes[done..], 1)?;
            let region = vk::BufferCopy {
                src_offset: at,
                dst_offset: offset + done as u64,
                size: piece as u64,
            };
            self.copies.push(Copy::Buffer { target, region });
            done += piece;
        }
        Ok(())
    }

    /// Copies texels without gaps, row by row from the top, to a whole level of `target`.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if the level is not there or `texels` has the wrong length;
    /// [`GpuError::Unsupported`] if not even one row fits the staging memory.
    pub fn image(&mut self, target: &'a Image, mip: u32, texels: &[u8]) -> Result<(), GpuError> {
        if mip >= target.mips() || target.mip_bytes(mip)? != texels.len() as u64 {
            return Err(GpuError::InvalidInput(format!(
                "{} bytes do not fill mip level {mip} of an image of {}x{} with {} levels",
                texels.len(),
                target.width(),
                target.height(),
                target.mips()
            )));
        }
        let extent = target.mip_extent(mip);
        let row = extent.width as usize * texel_size(target.format())? as usize;
        if row as u64 > self.staging.size() {
            return Err(GpuError::Unsupported(format!(
                "staging memory for a row of {row} bytes"
            )));
        }
        if !self.images.iter().any(|known| known.id() == target.id()) {
            self.images.push(target);
        }
        let mut done = 0;
        while done < texels.len() {
            let (piece, at) = self.stage(&texels[done..], row)?;
            let region = vk::BufferImageCopy::default()
                .buffer_offset(at)
                .image_subresource(subresource_layer(mip))
                .image_offset(vk::Offset3D {
                    x: 0,
                    y: (done / row) as i32,
                    z: 0,
                })
                .image_extent(vk::Extent3D {
                    width: extent.width,
                    height: (piece / row) as u32,
                    depth: 1,
                });
            self.copies.push(Copy::Image { target, region });
            done += piece;
        }
        Ok(())
    }

    /// Sends what is left and waits until everything has arrived.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn finish(mut self) -> Result<(), GpuError> {
        self.flush()?;
        let images = std::mem::take(&mut self.images);
        if images.is_empty() {
            return Ok(());
        }
        self.device.submit_once("uploaded images", |cmd| {
            for image in images {
                cmd.transition(image, Access::TransferWrite, Access::ComputeSampled);
            }
            Ok(())
        })
    }

    /// Puts as much of `bytes` as fits (a multiple of `unit`) into the staging buffer; returns how much and where.
    fn stage(&mut self, bytes: &[u8], unit: usize) -> Result<(usize, u64), GpuError> {
        let mut free = self.staging.size().saturating_sub(self.used) as usize;
        if free < unit.max(ALIGNMENT as usize) && free < bytes.len() {
            self.flush()?;
            free = self.staging.size() as usize;
        }
        let piece = bytes.len().min(free - free % unit);
        let at = self.used;
        self.staging.write(at, &bytes[..piece])?;
        self.used = (at + piece as u64).next_multiple_of(ALIGNMENT);
        Ok((piece, at))
    }

    fn flush(&mut self) -> Result<(), GpuError> {
        let copies = std::mem::take(&mut self.copies);
        self.used = 0;
        if copies.is_empty() {
            return Ok(());
        }
        let staging = &self.staging;
        self.device.submit_once("upload", |cmd| {
            for copy in &copies {
                record(cmd, staging, copy);
            }
            Ok(())
        })
    }
}

fn record(cmd: &Commands<'_>, staging: &Buffer, copy: &Copy<'_>) {
    let raw = cmd.device().raw();
    match copy {
        // SAFETY: ranges were checked when the copy was added; the borrow keeps the target alive.
        Copy::Buffer { target, region } => unsafe {
            raw.cmd_copy_buffer(cmd.raw(), staging.raw(), target.raw(), &[*region]);
        },
        Copy::Image { target, region } => {
            let mip = region.image_subresource.mip_level;
            let layout = Access::TransferWrite.layout();
            if target.layout(mip) != layout {
                cmd.transition_mip(target, mip, Access::ComputeReadWrite, Access::TransferWrite);
            }
            // SAFETY: as above.
            unsafe { raw.cmd_copy_buffer_to_image(cmd.raw(), staging.raw(), target.raw(), layout, &[*region]) };
        }
    }
}
