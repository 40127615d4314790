//! How fast a device copies memory, and how few bytes the denoiser's passes could move at that speed.

use crate::gpu::{Access, Barrier, Buffer, Device, GpuError, MemoryKind, Timestamps};
use ash::vk;
use std::sync::Arc;

/// Bytes of a copy: more than any cache holds.
const COPIED: u64 = 512 << 20;
const COPIES: u32 = 12;

/// Fewest bytes per pixel that a pass must move, each image that it needs read or written once: guide, colours, moments
/// and what anti-aliasing fetches take 8, radiance, its mean and motion 16. `moving`: the view moves, the scene does not.
/// None for passes that are not the denoiser's or TAA.
pub fn fewest_bytes(pass: &str, moving: bool) -> Option<u32> {
    Some(match pass {
        // Sample, guide and history of guide, irradiance and moments; result and moments.
        "temporal" => 16 + 8 + 8 + 8 + 8 + 8 + 8,
        // Guide, colour, moments; result and what the next frame starts from.
        "atrous0" => 8 + 8 + 8 + 8 + 8,
        "atrous1" | "atrous2" | "atrous3" | "atrous4" => 8 + 8 + 8,
        // Radiance, motion, history, result; of a still view radiance, mean before and after, result.
        "taa" if moving => 16 + 16 + 8 + 8,
        "taa" => 16 + 16 + 16 + 8,
        _ => return None,
    })
}

/// Bytes a second that copies within the device's memory read and write together, median; `None` where the device tells no times.
///
/// # Errors
/// [`GpuError`], out of memory above all.
pub fn copy_bandwidth(device: &Arc<Device>) -> Result<Option<f64>, GpuError> {
    let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = |name| Buffer::new(device, name, COPIED, usage, MemoryKind::DeviceLocal);
    let (from, to) = (buffer("copied from")?, buffer("copied to")?);
    let timestamps = Timestamps::new(device, COPIES)?;
    device.submit_once("bench bandwidth", |cmd| {
        timestamps.reset(cmd);
        cmd.fill_buffer(&from, 0x5eed_5eed);
        for _ in 0..COPIES {
            cmd.barrier(&Barrier::between(Access::TransferWrite, Access::TransferRead));
            cmd.barrier(&Barrier::between(Access::TransferWrite, Access::TransferWrite));
            timestamps.scope(cmd, "copy", |cmd| cmd.copy_buffer(&from, 0, &to, 0, COPIED))?;
        }
        Ok::<_, GpuError>(())
    })?;
    let Some(scopes) = timestamps.read()? else {
        return Ok(None);
    };
    let mut times: Vec<f64> = scopes.iter().map(|s| s.milliseconds).collect();
    times.sort_by(f64::total_cmp);
    Ok(times.get(times.len() / 2).map(|ms| 2.0 * COPIED as f64 / (ms * 1e-3)))
}
