//! What got faster, slower or less accurate from one run to another, beyond what chance does.

use super::error::Row;
use super::error_report::ErrorReport;
use super::frames::MapFrames;
use super::frames_report::FramesReport;
use super::statistics::Repeated;
use serde::Serialize;

/// Least difference that is told, as a share: what nobody can see is no finding, however sure it is.
const LEAST: f64 = 0.01;
/// Standard errors that two errors must lie apart.
const APART: f64 = 2.0;
/// Times of single measurements must differ by this share: nothing tells how well they are known.
const LEAST_ONCE: f64 = 0.05;

/// A figure that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Of which map and view.
    pub what: String,
    pub figure: String,
    pub before: f64,
    pub after: f64,
    /// Whether it got better; every figure here is the better the smaller it is.
    pub better: bool,
}

/// The comparison.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Comparison {
    /// What makes the two runs hard to compare: other devices, builds, settings, sizes.
    pub notes: Vec<String>,
    pub differences: Vec<Difference>,
    /// Figures that both have.
    pub compared: usize,
}

impl Comparison {
    fn add(&mut self, what: &str, figure: &str, before: f64, after: f64, sure: bool, least: f64) {
        self.compared += 1;
        if sure && (after - before).abs() > least * before.abs() {
            self.differences.push(Difference {
                what: what.to_owned(),
                figure: figure.to_owned(),
                before,
                after,
                better: after < before,
            });
        }
    }

    fn repeated(&mut self, what: &str, figure: &str, before: &Repeated, after: &Repeated) {
        let sure = before.differs(after);
        self.add(what, figure, before.mean, after.mean, sure, LEAST);
    }

    fn note(&mut self, what: &str, before: &str, after: &str) {
        if before != after {
            self.notes.push(format!("other {what}: {before} before, {after} after"));
        }
    }

    fn runs(&mut self, before: &super::run_info::RunInfo, after: &super::run_info::RunInfo) {
        self.note("device", &before.device, &after.device);
        self.note("driver", &before.driver, &after.driver);
        self.note("backend", &before.backend, &after.backend);
        self.note("build", &before.build, &after.build);
        let text = |m: &serde_json::Map<String, serde_json::Value>| serde_json::Value::Object(m.clone()).to_string();
        self.note("settings", &text(&before.settings), &text(&after.settings));
    }

    /// Of frame times.
    pub fn of_frames(before: &FramesReport, after: &FramesReport) -> Self {
        let mut out = Self::default();
        out.runs(&before.run, &after.run);
        for a in &before.maps {
            match after.maps.iter().find(|b| b.map == a.map) {
                Some(b) => out.map(a, b),
                None => out.notes.push(format!("{} is not in the second run", a.map)),
            }
        }
        out
    }

    fn map(&mut self, a: &MapFrames, b: &MapFrames) {
        let of = |m: &MapFrames| format!("{}x{}, {} frames along {}", m.size[0], m.size[1], m.frames, m.way);
        self.note(&format!("frames of {}", a.map), &of(a), &of(b));
        self.repeated(&a.map, "p50, ms", &a.medians, &b.medians);
        let percentile = |m: &MapFrames, f: fn(&crate::output::stats::Summary) -> f64| {
            Repeated::of(&m.runs.iter().map(|r| f(&r.summary)).collect::<Vec<_>>())
        };
        self.repeated(&a.map, "p99, ms", &percentile(a, |s| s.p99), &percentile(b, |s| s.p99));
        for (name, time) in &a.passes {
            if let Some(other) = b.passes.get(name) {
                self.repeated(&a.map, &format!("{name}, ms"), &time.runs, &other.runs);
            }
        }
        // Memory does not vary.
        self.add(
            &a.map,
            "GPU memory, bytes",
            a.memory as f64,
            b.memory as f64,
            true,
            LEAST,
        );
    }

    /// Of times and errors.
    pub fn of_errors(before: &ErrorReport, after: &ErrorReport) -> Self {
        let mut out = Self::default();
        out.runs(&before.run, &after.run);
        for a in &before.views {
            let what = format!("{}, spawn {}", a.map, a.spawn);
            let Some(b) = after.views.iter().find(|b| b.map == a.map && b.spawn == a.spawn) else {
                out.notes.push(format!("{what} is not in the second run"));
                continue;
            };
            out.note(
                &format!("size of {what}"),
                &format!("{:?}", a.size),
                &format!("{:?}", b.size),
            );
            for row in &a.rows {
                if let Some(other) = b.rows.iter().find(|r| r.name == row.name) {
                    out.row(&what, row, other);
                }
            }
        }
        out
    }

    fn row(&mut self, what: &str, a: &Row, b: &Row) {
        self.add(what, &format!("{}: ms", a.name), a.ms, b.ms, true, LEAST_ONCE);
        let sure = (a.rel_mse - b.rel_mse).abs() > APART * a.rel_mse_error.hypot(b.rel_mse_error);
        self.add(what, &format!("{}: rel_mse", a.name), a.rel_mse, b.rel_mse, sure, LEAST);
    }
}

impl std::fmt::Display for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for (better, title) in [(false, "worse"), (true, "better")] {
            for d in self.differences.iter().filter(|d| d.better == better) {
                let change = 100.0 * (d.after / d.before - 1.0);
                writeln!(
                    f,
                    "{title}: {}: {}: {:.4e} to {:.4e} ({change:+.1}%)",
                    d.what, d.figure, d.before, d.after
                )?;
            }
        }
        let worse = self.differences.iter().filter(|d| !d.better).count();
        write!(
            f,
            "{} figures compared: {worse} worse, {} better, the others as before within what chance does",
            self.compared,
            self.differences.len() - worse
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::frames::PassTime;

    fn report(p50: f64, spread: f64, pass: f64) -> FramesReport {
        let medians = Repeated {
            count: 20,
            mean: p50,
            deviation: spread,
        };
        let time = PassTime {
            p50: pass,
            p95: pass,
            runs: Repeated { mean: pass, ..medians },
        };
        FramesReport {
            maps: vec![MapFrames {
                map: "m".into(),
                medians,
                passes: [("direct".to_owned(), time)].into(),
                memory: 100,
                ..MapFrames::default()
            }],
            ..FramesReport::default()
        }
    }

    #[test]
    fn chance_is_no_finding_and_change_is() {
        let a = report(4.0, 0.1, 2.0);
        let noise = Comparison::of_frames(&a, &report(4.03, 0.1, 2.0));
        assert!(noise.differences.is_empty() && noise.compared > 2, "{noise}");
        let slower = Comparison::of_frames(&a, &report(4.5, 0.1, 1.0));
        let names: Vec<(&str, bool)> = slower
            .differences
            .iter()
            .map(|d| (d.figure.as_str(), d.better))
            .collect();
        assert_eq!(names, [("p50, ms", false), ("direct, ms", true)]);
        // Sure, and too little to matter.
        assert!(
            Comparison::of_frames(&a, &report(4.0 + 0.02, 1e-6, 2.0))
                .differences
                .is_empty()
        );
        let other = FramesReport::default();
        assert_eq!(Comparison::of_frames(&a, &other).notes, ["m is not in the second run"]);
    }
}
