//! Table of recoveries, its targets, and its place in the documentation.

use q3rays::recovery::Recovery;
use q3rays::recovery::score::{Score, Scores};
use std::fmt::{self, Display};
use std::path::Path;

/// Between these lines of `docs/recovery.md` the table stands.
const BEGIN: &str = "<!-- table -->\n";
const END: &str = "<!-- end of table -->\n";

/// Least median correlation with and without the gathered term, and on surfaces held out whole.
const MEDIAN_WITH: f64 = 0.92;
const MEDIAN_WITHOUT: f64 = 0.89;
const MEDIAN_HELD_OUT: f64 = 0.86;
/// Nearly all maps have at least this correlation: so many of them.
const GOOD: f64 = 0.80;
const GOOD_MAPS: usize = 80;
/// Where the median of predicted over stored lies on every map.
const RATIO: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// What was found out about a map.
pub struct Row {
    pub map: String,
    pub gamma: f32,
    pub compensate: f32,
    pub lights: usize,
    pub scores: Scores,
    /// Part of the gathered light that the bake had.
    pub indirect: f32,
    /// Score on surfaces that were held out whole, if that was tried.
    pub held_out: Option<Score>,
    pub seconds: f32,
    /// Most memory that the process held meanwhile, where the system tells.
    pub peak_mib: Option<u64>,
}

impl Row {
    /// The row of a recovery.
    pub fn new(r: &Recovery, held_out: Option<Score>, seconds: f32, peak_mib: Option<u64>) -> Self {
        Self {
            map: r.map.clone(),
            gamma: r.encoding.gamma,
            compensate: r.encoding.compensate,
            lights: r.lights.len(),
            scores: r.scores,
            indirect: r.indirect,
            held_out,
            seconds,
            peak_mib,
        }
    }
}

/// Names of the columns.
pub const HEAD: &str = "\
| map | γ | c | lights | known | known + recovered | + ambient | + bounces | bounce factor | held-out surfaces | s | MiB |
|---|---|---|---|---|---|---|---|---|---|---|---|";

struct Cell(Score);

impl Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:.3} {:.2}", self.0.correlation, self.0.ratio)
    }
}

impl Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let s = &self.scores;
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        write!(
            f,
            "| {} | {:.2} | {:.2} | {} | {} | {} | {} | {} | {:.2} | {} | {:.0} | {} |",
            self.map,
            self.gamma,
            self.compensate,
            self.lights,
            Cell(s.known),
            Cell(s.direct),
            Cell(s.without_indirect),
            Cell(s.full),
            self.indirect,
            or_dash(self.held_out.map(|h| Cell(h).to_string())),
            self.seconds,
            or_dash(self.peak_mib.map(|m| m.to_string()))
        )
    }
}

/// The middle value.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// What the table comes to.
pub struct Summary {
    pub with: f64,
    pub without: f64,
    /// Maps with a good correlation, with and without the gathered term.
    pub good: [usize; 2],
    pub ratios: [f64; 2],
    pub held_out: Option<f64>,
    pub maps: usize,
}

impl Summary {
    /// Sums up.
    pub fn new(rows: &[Row]) -> Self {
        let good = |of: fn(&Row) -> f64| rows.iter().filter(|r| of(r) >= GOOD).count();
        let with = |r: &Row| r.scores.full.correlation;
        let without = |r: &Row| r.scores.without_indirect.correlation;
        let ratios = || {
            rows.iter()
                .flat_map(|r| [r.scores.full.ratio, r.scores.without_indirect.ratio])
        };
        let held: Vec<f64> = rows.iter().filter_map(|r| r.held_out).map(|s| s.correlation).collect();
        Self {
            with: median(rows.iter().map(with)),
            without: median(rows.iter().map(without)),
            good: [good(with), good(without)],
            ratios: [
                ratios().fold(f64::INFINITY, f64::min),
                ratios().fold(f64::NEG_INFINITY, f64::max),
            ],
            held_out: (!held.is_empty()).then(|| median(held)),
            maps: rows.len(),
        }
    }

    /// What is missed.
    pub fn misses(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut check = |good: bool, text: String| {
            if !good {
                out.push(text);
            }
        };
        check(
            self.with >= MEDIAN_WITH,
            format!("median with bounces {:.3}", self.with),
        );
        check(
            self.without >= MEDIAN_WITHOUT,
            format!("median without {:.3}", self.without),
        );
        for (n, name) in self.good.into_iter().zip(["with", "without"]) {
            check(n >= GOOD_MAPS, format!("{n} maps of at least {GOOD} {name} bounces"));
        }
        for ratio in self.ratios {
            check(RATIO.contains(&ratio), format!("ratio {ratio:.2}"));
        }
        if let Some(held) = self.held_out {
            check(held >= MEDIAN_HELD_OUT, format!("held-out surfaces {held:.3}"));
        }
        out
    }
}

impl Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "{} maps: median correlation {:.3} with and {:.3} without the gathered term, at least {GOOD} on {} and {} of \
             them, median ratios {:.2} to {:.2}",
            self.maps, self.with, self.without, self.good[0], self.good[1], self.ratios[0], self.ratios[1]
        )?;
        match self.held_out {
            Some(held) => write!(f, "; on surfaces held out whole {held:.3}."),
            None => write!(f, "."),
        }
    }
}

/// Puts the table into the documentation.
pub fn document(rows: &[Row], failures: &[String]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/recovery.md");
    let text = std::fs::read_to_string(&path).expect("docs/recovery.md");
    let (before, rest) = text.split_once(BEGIN).expect("the table's beginning");
    let (_, after) = rest.split_once(END).expect("the table's end");
    let mut table = format!("{}\n\n{HEAD}\n", Summary::new(rows));
    rows.iter().for_each(|r| table += &format!("{r}\n"));
    failures
        .iter()
        .for_each(|f| table += &format!("\nNot recovered: {f}\n"));
    std::fs::write(&path, format!("{before}{BEGIN}\n{table}\n{END}{after}")).expect("docs/recovery.md written");
}

/// Forgets how much memory the process has held so far.
pub fn forget_peak() {
    // Only Linux keeps such a mark; elsewhere the table says nothing about memory.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Most memory since then.
pub fn peak_mib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.split_whitespace()
        .next()?
        .parse::<u64>()
        .ok()
        .map(|kib| kib / 1024)
}
