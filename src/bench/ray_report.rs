//! What `bench rays` measured, as a table and as JSON.

use super::rays::{Level, Tree, Workload};
use serde::Serialize;
use std::fmt;

/// Most rays whose hit may differ between two traversals, as a share: silhouette edges decided by rounding.
pub const MOST_DISAGREEMENT: f64 = 1e-3;

/// One measured combination.
#[derive(Clone, Debug, Serialize)]
pub struct Rate {
    pub tree: Tree,
    pub level: Level,
    pub workload: Workload,
    /// Median of a dispatch, milliseconds.
    pub milliseconds: f64,
    pub rays: u64,
    /// Millions of rays per second.
    pub mrays_per_second: f64,
}

/// How far a traversal's hits are from those of the 8-wide tree.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    pub tree: Tree,
    pub level: Level,
    pub workload: Workload,
    /// Rays with another hit, 0..1.
    pub disagreement: f64,
    /// Rays that hit anything, 0..1.
    pub hits: f64,
}

/// The measurements of a map.
#[derive(Clone, Debug, Serialize)]
pub struct MapReport {
    pub map: String,
    pub triangles: usize,
    pub instances: u32,
    pub rates: Vec<Rate>,
    pub agreements: Vec<Agreement>,
}

/// The measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct RaysReport {
    pub device: String,
    pub driver: String,
    pub size: [u32; 2],
    pub dispatches: u32,
    pub trees: &'static str,
    /// Whether the device traces by itself.
    pub ray_query: bool,
    pub maps: Vec<MapReport>,
}

impl MapReport {
    fn rate(&self, tree: Tree, level: Level, workload: Workload) -> Option<f64> {
        let wanted = |r: &&Rate| (r.tree, r.level, r.workload) == (tree, level, workload);
        self.rates.iter().find(wanted).map(|r| r.mrays_per_second)
    }

    /// The largest share of rays whose hit differs between two traversals.
    pub fn worst_disagreement(&self) -> f64 {
        self.agreements.iter().map(|a| a.disagreement).fold(0.0, f64::max)
    }
}

impl fmt::Display for RaysReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [w, h] = self.size;
        writeln!(
            f,
            "{} ({}), {w}x{h}, median of {} dispatches, {} trees",
            self.device, self.driver, self.dispatches, self.trees
        )?;
        writeln!(
            f,
            "Mrays/s: P primary, S any hit towards emitters, D one diffuse bounce\n"
        )?;
        write!(f, "{:26}", "map (triangles)")?;
        writeln!(
            f,
            "{:>9} {:>24} {:>24} {:>24}",
            "", "single-level P/S/D", "two-level P/S/D", "alpha-tested P/S/D"
        )?;
        for map in &self.maps {
            for (row, tree) in Tree::ALL.into_iter().enumerate() {
                let title = match row {
                    0 => format!("{} ({})", map.map, map.triangles),
                    _ => String::new(),
                };
                write!(f, "{title:26}{:>9}", tree.name())?;
                if tree == Tree::RayQuery && !self.ray_query {
                    writeln!(f, " the device or driver has no ray queries")?;
                    continue;
                }
                for level in Level::ALL {
                    let cells = Workload::ALL.map(|workload| match map.rate(tree, level, workload) {
                        Some(rate) if rate < 100.0 => format!("{rate:.1}"),
                        Some(rate) => format!("{rate:.0}"),
                        None => "-".to_owned(),
                    });
                    write!(f, " {:>24}", cells.join(" / "))?;
                }
                writeln!(f)?;
            }
            writeln!(
                f,
                "{:26}hits that differ between trees: at most {:.2e} of the rays",
                "",
                map.worst_disagreement()
            )?;
        }
        Ok(())
    }
}
