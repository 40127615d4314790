//! What `bench denoiser` measured, as a table and as JSON.

use super::denoiser::{MOVING, RAW, STILL, ViewReport};
use serde::Serialize;
use std::fmt;

/// The measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct DenoiserReport {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
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
            "\n| map, spawn | raw 1 | raw {RAW} | still {} | still {} | SSIM, FLIP, mean | moving {MOVING} | SSIM, FLIP, mean |",
            STILL[0], STILL[1]
        )?;
        writeln!(f, "|---|---:|---:|---:|---:|---|---:|---|")?;
        for v in &self.views {
            let ratio = |e: f64, t: f64| {
                format!(
                    "{e:.2e} ({t:.2e}): {:.0} ({:.0})",
                    v.raw.rel_mse / e,
                    v.raw.rel_mse_trimmed / t
                )
            };
            let [a, b] = v.still;
            let looks = |x: &super::denoiser::Figures| format!("{:.3}, {:.3}, {:.3}", x.ssim, x.flip, x.mean_ratio);
            writeln!(
                f,
                "| {}, {} | {:.2e} ({:.2e}) | {:.2e} ({:.2e}) | {} | {} | {} | {} | {} |",
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
                looks(&v.moved)
            )?;
        }
        for v in &self.views {
            let passes: Vec<_> = v.passes.iter().map(|(name, ms)| format!("{name} {ms:.3}")).collect();
            writeln!(f, "\n{}, {}: {}", v.map, v.spawn, passes.join(", "))?;
        }
        Ok(())
    }
}
