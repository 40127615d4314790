//! What `bench lights` measured, as tables and as JSON.

use super::lights::{MapReport, Measured, Mode};
use serde::Serialize;
use std::fmt;

/// Times at which the modes are held side by side, milliseconds.
pub const BUDGETS: [f64; 3] = [1.0, 4.0, 16.0];

/// The measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct LightsReport {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
    pub maps: Vec<MapReport>,
}

impl MapReport {
    /// The least error of a mode within a time.
    pub fn best(&self, mode: Mode, milliseconds: f64) -> Option<&Measured> {
        self.measured
            .iter()
            .filter(|m| m.config.mode == mode && m.light_ms <= milliseconds)
            .min_by(|a, b| a.rel_mse.total_cmp(&b.rel_mse))
    }
}

/// Median; `None` of nothing.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

impl LightsReport {
    /// Median over maps of the error of the first mode over that of the second, each at its best within a time.
    pub fn ratio(&self, of: Mode, to: Mode, milliseconds: f64) -> Option<f64> {
        median(
            self.maps
                .iter()
                .filter_map(|m| Some(m.best(of, milliseconds)?.rel_mse / m.best(to, milliseconds)?.rel_mse))
                .collect(),
        )
    }
}

impl fmt::Display for LightsReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} ({}), {}x{}: rel_mse of one frame, best knobs within each time for lighting",
            self.device, self.driver, self.size[0], self.size[1]
        )?;
        for budget in BUDGETS {
            writeln!(
                f,
                "\n| {budget} ms | lights |{}",
                Mode::ALL.map(|m| format!(" {} |", m.name())).concat()
            )?;
            writeln!(f, "|---|---:|{}", "---:|".repeat(Mode::ALL.len()))?;
            for map in &self.maps {
                let cells = Mode::ALL.map(|mode| match map.best(mode, budget) {
                    Some(m) => format!(" {:.3e} |", m.rel_mse),
                    None => " |".to_owned(),
                });
                writeln!(f, "| {} | {} |{}", map.map, map.lights, cells.concat())?;
            }
            let ratios = Mode::ALL.map(|mode| match self.ratio(Mode::Uniform, mode, budget) {
                Some(r) => format!(" {r:.1} |"),
                None => " |".to_owned(),
            });
            writeln!(f, "| median of uniform's over it | |{}", ratios.concat())?;
        }
        writeln!(
            f,
            "\n| mean over the references' |{}",
            Mode::ALL.map(|m| format!(" {} |", m.name())).concat()
        )?;
        writeln!(f, "|---|{}", "---:|".repeat(Mode::ALL.len()))?;
        for map in &self.maps {
            let cells: String = map
                .bias
                .iter()
                .map(|b| format!(" {:.4} ± {:.4} |", b.mean_ratio, b.standard_error))
                .collect();
            writeln!(f, "| {} |{cells}", map.map)?;
        }
        Ok(())
    }
}
