//! Frame-time statistics as JSON and CSV.

use super::{OutputError, atomic};
use crate::reference::direct::RayCounts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// Times of one frame in milliseconds.
#[derive(Clone, Debug, Serialize)]
pub struct FrameStats {
    pub index: u32,
    pub cpu_ms: f64,
    /// Time on the GPU from the first pass to the last; `None` where nothing ran there or it cannot be measured.
    pub gpu_ms: Option<f64>,
    /// GPU time by pass.
    pub passes: serde_json::Map<String, serde_json::Value>,
    pub rays: RayCounts,
    /// Mean number of frames in the denoiser's history; `None` where nothing was denoised.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history: Option<f64>,
}

/// Percentiles over the frames: of GPU time where there is one, else of CPU time; milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub p50: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
    pub mean: f64,
}

/// A run's statistics with what is needed to repeat it.
#[derive(Clone, Debug, Serialize)]
pub struct RunStats {
    pub device: String,
    pub backend: String,
    pub driver: String,
    pub map: String,
    pub size: [u32; 2],
    pub settings: serde_json::Map<String, serde_json::Value>,
    pub frames: Vec<FrameStats>,
    pub summary: Summary,
}

impl Summary {
    /// Nearest-rank percentiles; all 0 without frames.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let rank = |p: f64| {
            values
                .get(((p * n as f64).ceil() as usize).saturating_sub(1))
                .copied()
                .unwrap_or(0.0)
        };
        Self {
            p50: rank(0.5),
            p95: rank(0.95),
            p99: rank(0.99),
            max: values.last().copied().unwrap_or(0.0),
            mean: if n == 0 {
                0.0
            } else {
                values.iter().sum::<f64>() / n as f64
            },
        }
    }

    /// Over frames.
    pub fn of_frames(frames: &[FrameStats]) -> Self {
        Self::of(frames.iter().map(FrameStats::ms).collect())
    }
}

impl FrameStats {
    /// Time on the GPU where that is known, else on the CPU, milliseconds.
    pub fn ms(&self) -> f64 {
        self.gpu_ms.unwrap_or(self.cpu_ms)
    }
}

impl RunStats {
    /// Indented JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// One row a frame, one column a pass; missing times are empty.
    pub fn csv(&self) -> String {
        let passes: BTreeSet<&String> = self.frames.iter().flat_map(|f| f.passes.keys()).collect();
        let mut out = String::from("index,cpu_ms,gpu_ms");
        for pass in &passes {
            out.push_str(&format!(",{pass}_ms"));
        }
        out.push_str(",primary_rays,shadow_rays,shadow_rays_skipped\n");
        for f in &self.frames {
            let gpu = f.gpu_ms.map(|t| format!("{t:.4}")).unwrap_or_default();
            out.push_str(&format!("{},{:.4},{gpu}", f.index, f.cpu_ms));
            for pass in &passes {
                let ms = f.passes.get(*pass).and_then(serde_json::Value::as_f64);
                out.push_str(&ms.map_or_else(|| ",".to_owned(), |t| format!(",{t:.4}")));
            }
            out.push_str(&format!(
                ",{},{},{}\n",
                f.rays.primary, f.rays.shadow, f.rays.shadow_skipped
            ));
        }
        out
    }

    /// Writes CSV where the name ends in `.csv`, else JSON.
    ///
    /// # Errors
    /// [`OutputError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let csv = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
        let text = if csv { self.csv() } else { self.json() };
        atomic::write(path, text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_rank() {
        let s = Summary::of((1..=100).rev().map(f64::from).collect());
        assert_eq!((s.p50, s.p95, s.p99, s.max, s.mean), (50.0, 95.0, 99.0, 100.0, 50.5));
        assert_eq!(Summary::of(Vec::new()).p99, 0.0);
        assert_eq!(Summary::of(vec![3.0]).p50, 3.0);
    }
}
