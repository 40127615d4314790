//! What `bench denoiser`, `bench motion` and `bench culling` measured, as tables and as JSON.

use super::bandwidth::fewest_bytes;
use super::culling::CullingReport;
use super::denoiser::{MOVING, RAW, STILL, ViewReport};
use super::motion::{JUMP, MotionReport, RAW as RAW_MOTION};
use super::stage::Figures;
use serde::Serialize;
use std::fmt;

/// The measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct DenoiserReport {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
    /// Bytes a second of copies within the device's memory, both ways together.
    pub copy_bandwidth: Option<f64>,
    pub views: Vec<ViewReport>,
}

impl fmt::Display for DenoiserReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} ({}), {}x{}: rel_mse (trimmed) and how many times less than the raw frame's",
            self.device, self.driver, self.size[0], self.size[1]
        )?;
        writeln!(
            f,
            "\n| map, spawn | raw 1 | raw {RAW} | still {} | still {} | SSIM, FLIP, mean | moving {MOVING} | SSIM, FLIP, mean | references: samples, error |",
            STILL[0], STILL[1]
        )?;
        writeln!(f, "|---|---:|---:|---:|---:|---|---:|---|---|")?;
        for v in &self.views {
            let ratio = |e: f64, t: f64| {
                format!(
                    "{e:.2e} ({t:.2e}): {:.0} ({:.0})",
                    v.raw.rel_mse / e,
                    v.raw.rel_mse_trimmed / t
                )
            };
            let [a, b] = v.still;
            let looks = |x: &Figures| format!("{:.3}, {:.3}, {:.3}", x.ssim, x.flip, x.mean_ratio);
            writeln!(
                f,
                "| {}, {} | {:.2e} ({:.2e}) | {:.2e} ({:.2e}) | {} | {} | {} | {} | {} | {}, {:.1e} |",
                v.map,
                v.spawn,
                v.raw.rel_mse,
                v.raw.rel_mse_trimmed,
                v.raw_many.rel_mse,
                v.raw_many.rel_mse_trimmed,
                ratio(a.rel_mse, a.rel_mse_trimmed),
                ratio(b.rel_mse, b.rel_mse_trimmed),
                looks(&b),
                ratio(v.moved.rel_mse, v.moved.rel_mse_trimmed),
                looks(&v.moved),
                v.references,
                v.reference_error
            )?;
        }
        let Some(bandwidth) = self.copy_bandwidth else {
            return Ok(());
        };
        let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
        writeln!(
            f,
            "\nMilliseconds of the denoiser's passes, and the least that the bytes they must move take at the {:.0} GB/s of a copy:",
            bandwidth * 1e-9
        )?;
        for v in &self.views {
            for (kind, passes) in [("still", &v.passes), ("moving", &v.moving_passes)] {
                let mut sums = [0.0; 2];
                let rows: Vec<_> = passes
                    .iter()
                    .filter_map(|(name, ms)| {
                        let bytes = fewest_bytes(name, kind == "moving")?;
                        let least = f64::from(bytes) * pixels / bandwidth * 1e3;
                        sums = [sums[0] + ms, sums[1] + least];
                        Some(format!("{name} {ms:.3} ({least:.3})"))
                    })
                    .collect();
                let (rows, [sum, least]) = (rows.join(", "), sums);
                writeln!(f, "\n{}, {}, {kind}: {rows}; all {sum:.3} ({least:.3})", v.map, v.spawn)?;
            }
        }
        Ok(())
    }
}

/// Walks of a run.
#[derive(Clone, Debug, Serialize)]
pub struct MotionTable {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
    pub maps: Vec<MotionReport>,
}

impl fmt::Display for MotionTable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} ({}), {}x{}",
            self.device, self.driver, self.size[0], self.size[1]
        )?;
        writeln!(
            f,
            "\n| map | mean FLIP, denoised | raw {RAW_MOTION} | 8 frames after the jump in frame {JUMP} | settled | ratio | pixels in \
             sight for 4 frames | their FLIP | around | ratio |"
        )?;
        writeln!(f, "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")?;
        for m in &self.maps {
            writeln!(
                f,
                "| {} | {:.4} | {:.4} | {:.4} | {:.4} | {:.2} | {} | {:.4} | {:.4} | {:.2} |",
                m.map,
                m.flip,
                m.raw_flip,
                m.after_jump,
                m.settled,
                m.after_jump / m.settled,
                m.young_pixels,
                m.young,
                m.around,
                m.young / m.around
            )?;
        }
        Ok(())
    }
}

/// Culling in the views of a run.
#[derive(Clone, Debug, Serialize)]
pub struct CullingTable {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
    pub maps: Vec<CullingReport>,
}

impl fmt::Display for CullingTable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} ({}), {}x{}",
            self.device, self.driver, self.size[0], self.size[1]
        )?;
        writeln!(
            f,
            "\n| map (lights) | sampling | `rt_cullLights` | raw rel_mse | denoised | FLIP | flicker | direct, ms |"
        )?;
        writeln!(f, "|---|---|---:|---:|---:|---:|---:|---:|")?;
        for m in &self.maps {
            for c in &m.culled {
                writeln!(
                    f,
                    "| {} ({}) | {} | {} | {:.2e} | {:.2e} | {:.4} | {:.4} | {} |",
                    m.map,
                    m.lights,
                    c.sampling,
                    c.cull_lights,
                    c.raw.rel_mse,
                    c.denoised.rel_mse,
                    c.denoised.flip,
                    c.flicker,
                    c.direct_ms.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.3}"))
                )?;
            }
        }
        Ok(())
    }
}
