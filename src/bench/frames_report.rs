//! What `q3rays bench` writes: `data.json`, `frames.csv` with a row a frame, `summary.csv` with a row a map, and `report.html`.

use super::frames::{FrameTime, MapFrames};
use super::page::Page;
use super::plot::{Axis, Bar, PlotError, Series, Style, bars, chart, short};
use super::run_info::RunInfo;
use super::statistics::power_law;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The measurements of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FramesReport {
    /// `frames`: what kind of data this is.
    pub kind: String,
    pub run: RunInfo,
    pub maps: Vec<MapFrames>,
}

/// What the kind of such data is called.
pub const KIND: &str = "frames";
/// Passes shown apart in the bars; the others are joined.
const SHOWN_PASSES: usize = 7;

/// Rows of `frames.csv` of a map, with a head where it is the first.
pub fn frames_csv(map: &str, runs: &[Vec<FrameTime>], head: bool) -> String {
    let passes: BTreeSet<&String> = runs.iter().flatten().flat_map(|f| f.stats.passes.keys()).collect();
    let mut out = String::new();
    if head {
        out.push_str("map,run,frame,gpu_ms,cpu_ms,wall_ms,primary_rays,shadow_rays,shadow_rays_skipped,pass_ms\n");
    }
    for (run, frames) in runs.iter().enumerate() {
        for (i, f) in frames.iter().enumerate() {
            let gpu = f.stats.gpu_ms.map(|t| format!("{t:.4}")).unwrap_or_default();
            let times: Vec<String> = passes
                .iter()
                .filter_map(|p| Some(format!("{p}={:.4}", f.stats.passes.get(*p)?.as_f64()?)))
                .collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "{map},{run},{i},{gpu},{:.4},{:.4},{},{},{},{}",
                f.stats.cpu_ms,
                f.wall_ms,
                f.stats.rays.primary,
                f.stats.rays.shadow,
                f.stats.rays.shadow_skipped,
                times.join(" ")
            );
        }
    }
    out
}

impl FramesReport {
    /// One row a map.
    pub fn summary_csv(&self) -> String {
        let mut out = String::from(
            "map,width,height,way,triangles,lights,frames,runs,p50_ms,p95_ms,p99_ms,max_ms,mean_ms,stutters,run_median_mean_ms,\
             run_median_deviation_ms,run_median_within_95_ms,cpu_p50_ms,memory_bytes,primary_rays,shadow_rays,\
             shadow_rays_skipped,passes_p50_ms\n",
        );
        for m in &self.maps {
            let passes: Vec<String> = m.passes.iter().map(|(n, t)| format!("{n}={:.4}", t.p50)).collect();
            let within = m.medians.of_another().map(|w| format!("{w:.4}")).unwrap_or_default();
            let s = &m.summary;
            let cpu: f64 = m.runs.iter().map(|r| r.cpu_p50).sum::<f64>() / m.runs.len().max(1) as f64;
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{:.4},{:.4},{:.4},{:.4},{:.4},{},{:.4},{:.4},{within},{cpu:.4},{},{:.0},{:.0},{:.0},{}",
                m.map,
                m.size[0],
                m.size[1],
                m.way,
                m.triangles,
                m.lights,
                m.frames,
                m.runs.len(),
                s.p50,
                s.p95,
                s.p99,
                s.max,
                s.mean,
                m.stutters,
                m.medians.mean,
                m.medians.deviation,
                m.memory,
                m.rays.primary,
                m.rays.shadow,
                m.rays.shadow_skipped,
                passes.join(" ")
            );
        }
        out
    }

    /// The page.
    ///
    /// # Errors
    /// [`PlotError`] where the drawing library fails.
    pub fn html(&self) -> Result<String, PlotError> {
        let mut page = Page::new("q3rays: frame times");
        self.run.show(&mut page);
        page.paragraph(
            "Each map is gone through several times along the same way. Times are the GPU's from the first pass to the last, in \
             milliseconds, over all frames of all runs; a stutter is a frame over twice the median. The last column says within \
             what of the mean of the runs' medians another run's median lies with a probability of 95%. Rows: summary.csv; \
             single frames: frames.csv; all of it: data.json.",
        );
        page.heading("All maps");
        let rows: Vec<Vec<String>> = self.maps.iter().map(row).collect();
        page.table(
            &[
                "map",
                "size",
                "triangles",
                "lights",
                "p50",
                "p95",
                "p99",
                "max",
                "stutters",
                "CPU p50",
                "Mrays a frame",
                "skipped",
                "MiB",
                "run medians",
            ],
            &rows,
        );
        let (names, lengths) = self.parts();
        let parts: Vec<&str> = names.iter().map(String::as_str).collect();
        page.plot(
            &bars("ms", &parts, &lengths)?,
            "Median time of the passes by map (summary.csv, passes_p50_ms); medians need not add up to the frame's.",
        );
        self.growth(&mut page)?;
        for m in &self.maps {
            self.map(&mut page, m)?;
        }
        Ok(page.html())
    }

    fn parts(&self) -> (Vec<String>, Vec<Bar>) {
        let mut sums: Vec<(String, f64)> = Vec::new();
        for (name, time) in self.maps.iter().flat_map(|m| &m.passes) {
            match sums.iter_mut().find(|(n, _)| n == name) {
                Some(sum) => sum.1 += time.p50,
                None => sums.push((name.clone(), time.p50)),
            }
        }
        sums.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut names: Vec<String> = sums.into_iter().take(SHOWN_PASSES).map(|(n, _)| n).collect();
        let lengths = self.maps.iter().map(|m| {
            let shown: Vec<f64> = names.iter().map(|n| m.passes.get(n).map_or(0.0, |t| t.p50)).collect();
            let all: f64 = m.passes.values().map(|t| t.p50).sum();
            let rest = all - shown.iter().sum::<f64>();
            (m.map.clone(), shown.into_iter().chain([rest]).collect())
        });
        let lengths: Vec<Bar> = lengths.collect();
        names.push("others".to_owned());
        (names, lengths)
    }

    /// How time grows with lights and triangles, where there are maps enough to tell.
    fn growth(&self, page: &mut Page) -> Result<(), PlotError> {
        if self.maps.len() < 4 {
            return Ok(());
        }
        for (name, of) in [
            ("lights", (|m| m.lights as f64) as fn(&MapFrames) -> f64),
            ("triangles", |m| m.triangles as f64),
        ] {
            let points: Vec<(f64, f64)> = self.maps.iter().map(|m| (of(m), m.summary.p50)).collect();
            let slope = power_law(&points).map_or("no slope".to_owned(), |l| {
                format!(
                    "time grows with the power {:.2} ± {:.2} (standard error)",
                    l.slope, l.error
                )
            });
            let axes = [
                Axis {
                    name,
                    logarithmic: true,
                },
                Axis {
                    name: "p50, ms",
                    logarithmic: true,
                },
            ];
            let series = [Series {
                name: "maps".to_owned(),
                points,
                style: Style::Points,
            }];
            page.plot(
                &chart(axes, &series)?,
                &format!("Median time against {name}: {slope} (summary.csv)."),
            );
        }
        Ok(())
    }

    fn map(&self, page: &mut Page, m: &MapFrames) -> Result<(), PlotError> {
        page.heading(&m.map);
        page.paragraph(&format!(
            "{} frames along \"{}\", {} runs with medians {} ± {} (standard deviation).",
            m.frames,
            m.way,
            m.runs.len(),
            short(m.medians.mean),
            short(m.medians.deviation)
        ));
        let axes = [
            Axis {
                name: "frame",
                logarithmic: false,
            },
            Axis {
                name: "ms",
                logarithmic: false,
            },
        ];
        let series = [Series {
            name: "GPU, first run".to_owned(),
            points: m.graph.iter().enumerate().map(|(i, t)| (i as f64, *t)).collect(),
            style: Style::Line,
        }];
        page.plot(
            &chart(axes, &series)?,
            &format!("frames.csv, map {}, run 0, gpu_ms", m.map),
        );
        let passes: Vec<Vec<String>> = m
            .passes
            .iter()
            .map(|(name, t)| {
                let within = t.runs.of_another().map_or("–".to_owned(), |w| format!("± {w:.4}"));
                vec![name.clone(), format!("{:.4}", t.p50), format!("{:.4}", t.p95), within]
            })
            .collect();
        page.table(&["pass", "p50, ms", "p95, ms", "another run's median"], &passes);
        let runs: Vec<Vec<String>> = m
            .runs
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let s = &r.summary;
                let mut cells = vec![i.to_string()];
                cells.extend([s.p50, s.p95, s.p99, s.max].map(|t| format!("{t:.3}")));
                cells.extend([
                    r.stutters.to_string(),
                    format!("{:.3}", r.cpu_p50),
                    format!("{:.3}", r.wall_p50),
                ]);
                cells
            })
            .collect();
        page.table(
            &[
                "run",
                "p50",
                "p95",
                "p99",
                "max",
                "stutters",
                "CPU p50",
                "from frame to frame, p50",
            ],
            &runs,
        );
        Ok(())
    }
}

fn row(m: &MapFrames) -> Vec<String> {
    let s = &m.summary;
    let cpu: f64 = m.runs.iter().map(|r| r.cpu_p50).sum::<f64>() / m.runs.len().max(1) as f64;
    let mut cells = vec![
        m.map.clone(),
        format!("{}x{}", m.size[0], m.size[1]),
        m.triangles.to_string(),
        m.lights.to_string(),
    ];
    cells.extend([s.p50, s.p95, s.p99, s.max].map(|t| format!("{t:.3}")));
    cells.extend([
        m.stutters.to_string(),
        format!("{cpu:.3}"),
        format!("{:.2}", (m.rays.primary + m.rays.shadow) / 1e6),
        format!("{:.2}", m.rays.shadow_skipped / 1e6),
        format!("{:.0}", m.memory as f64 / (1 << 20) as f64),
        m.medians.of_another().map_or(format!("{:.3}", m.medians.mean), |w| {
            format!("{:.3} ± {w:.3}", m.medians.mean)
        }),
    ]);
    cells
}
