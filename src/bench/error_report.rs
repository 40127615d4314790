//! What `q3rays bench error` writes: `data.json`, `errors.csv` with a row a choice of settings, and `report.html`.

use super::error::{Row, ViewErrors, WANTED};
use super::page::Page;
use super::plot::{Axis, PlotError, Series, Style, chart, short};
use super::run_info::RunInfo;
use super::sweep::FAMILIES;
use crate::output::png_file;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// The measurements of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ErrorReport {
    /// `error`: what kind of data this is.
    pub kind: String,
    pub run: RunInfo,
    pub views: Vec<ViewErrors>,
}

/// What the kind of such data is called.
pub const KIND: &str = "error";

fn figure(v: Option<f64>) -> String {
    v.map_or("–".to_owned(), |v| format!("{v:.4}"))
}

impl ErrorReport {
    /// One row a view and choice.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "map,spawn,width,height,settings,ms,rel_mse,rel_mse_standard_error,rel_mse_trimmed,rmse,ssim,flip,mean_ratio,images,\
             on_front,truth_samples\n",
        );
        for v in &self.views {
            for r in &v.rows {
                let optional = |x: Option<f64>| x.map(|x| format!("{x:.6}")).unwrap_or_default();
                // Writing to a string cannot fail.
                let _ = writeln!(
                    out,
                    "{},{},{},{},\"{}\",{:.4},{:.6e},{:.2e},{:.6e},{:.6e},{},{},{:.6},{},{},{}",
                    v.map,
                    v.spawn,
                    v.size[0],
                    v.size[1],
                    r.name,
                    r.ms,
                    r.rel_mse,
                    r.rel_mse_error,
                    r.rel_mse_trimmed,
                    r.rmse,
                    optional(r.ssim),
                    optional(r.flip),
                    r.mean_ratio,
                    r.images,
                    u8::from(r.front),
                    v.samples
                );
            }
        }
        out
    }

    /// The page; pictures are taken from `folder`.
    ///
    /// # Errors
    /// [`PlotError`] where the drawing library fails.
    pub fn html(&self, folder: &Path) -> Result<String, PlotError> {
        let mut page = Page::new("q3rays: run time against error");
        self.run.show(&mut page);
        page.paragraph(
            "Errors are against two independent truths R1 and R2, as mean((I−R1)(I−R2)/(R²+0.01·m²)), so that the truths' noise is \
             no floor. Each choice of settings shows some images, each with random numbers and a history of its own; ± is the \
             standard error by the spread over these and by the noise of the truths. ms: median GPU time of a frame, or of all \
             samples that are averaged. Rows: errors.csv; all of it: data.json.",
        );
        self.both(&mut page);
        for v in &self.views {
            view(&mut page, v, folder)?;
        }
        Ok(page.html())
    }

    /// Medians over the views, where there are some.
    fn both(&self, page: &mut Page) {
        if self.views.len() < 2 {
            return;
        }
        let mut by_name: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
        for r in self.views.iter().flat_map(|v| &v.rows) {
            by_name.entry(&r.name).or_default().push(r);
        }
        let mut rows: Vec<(f64, Vec<String>)> = by_name
            .iter()
            .map(|(name, rows)| {
                let of = |f: &dyn Fn(&Row) -> Option<f64>| {
                    super::statistics::median(&rows.iter().filter_map(|r| f(r)).collect::<Vec<_>>())
                };
                let ms = of(&|r| Some(r.ms)).unwrap_or(0.0);
                let fronts = rows.iter().filter(|r| r.front).count();
                let cells = vec![
                    (*name).to_owned(),
                    format!("{ms:.3}"),
                    of(&|r| Some(r.rel_mse)).map_or("–".to_owned(), |e| format!("{e:.2e}")),
                    figure(of(&|r| r.ssim)),
                    figure(of(&|r| r.flip)),
                    figure(of(&|r| Some(r.mean_ratio))),
                    format!("{fronts} of {}", rows.len()),
                ];
                (ms, cells)
            })
            .collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        page.heading("Medians over all views");
        page.table(
            &[
                "settings",
                "ms",
                "rel_mse",
                "SSIM",
                "FLIP",
                "mean ratio",
                "on the front of",
            ],
            &rows.into_iter().map(|r| r.1).collect::<Vec<_>>(),
        );
    }
}

fn view(page: &mut Page, v: &ViewErrors, folder: &Path) -> Result<(), PlotError> {
    page.heading(&format!("{}, spawn {}", v.map, v.spawn));
    page.paragraph(&format!(
        "{} lights, {}x{}, truths of {} samples (at most {}), each of 4 lights. {} SSIM and FLIP are taken against the mean of \
         both, whose own rel_mse is {}.",
        v.lights,
        v.size[0],
        v.size[1],
        v.samples,
        v.most_samples,
        if v.unsure == 0 {
            format!("All figures are known to {:.0}% or better.", v.worst * 100.0)
        } else {
            format!(
                "{} of {} figures are known to less than {:.0}%, the worst to {:.0}%.",
                v.unsure,
                v.rows.len(),
                WANTED * 100.0,
                v.worst * 100.0
            )
        },
        short(v.noise)
    ));
    if !v.left_out.is_empty() {
        let names: Vec<String> = v
            .left_out
            .iter()
            .map(|(n, ms)| format!("{n} ({} ms)", short(*ms)))
            .collect();
        page.paragraph(&format!(
            "Left out, because a frame takes too long: {}.",
            names.join("; ")
        ));
    }
    let axes = |y| {
        [
            Axis {
                name: "ms",
                logarithmic: true,
            },
            Axis {
                name: y,
                logarithmic: true,
            },
        ]
    };
    let mut series: Vec<Series> = FAMILIES
        .iter()
        .map(|family| Series {
            name: (*family).to_owned(),
            points: v
                .rows
                .iter()
                .filter(|r| r.config.family() == *family)
                .map(|r| (r.ms, r.rel_mse))
                .collect(),
            style: Style::Points,
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    let mut front: Vec<(f64, f64)> = v.rows.iter().filter(|r| r.front).map(|r| (r.ms, r.rel_mse)).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    series.push(Series {
        name: "front".to_owned(),
        points: front,
        style: Style::Line,
    });
    page.plot(
        &chart(axes("rel_mse"), &series)?,
        &format!(
            "Time against error; the line joins what nothing beats in both (errors.csv, map {}, spawn {}).",
            v.map, v.spawn
        ),
    );
    let mut rows: Vec<&Row> = v.rows.iter().collect();
    rows.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                format!("{}{}", if r.front { "● " } else { "" }, r.name),
                format!("{:.3}", r.ms),
                format!("{:.2e} ± {:.0e}", r.rel_mse, r.rel_mse_error),
                format!("{:.2e}", r.rel_mse_trimmed),
                format!("{:.4}", r.rmse),
                figure(r.ssim),
                figure(r.flip),
                format!("{:.4}", r.mean_ratio),
            ]
        })
        .collect();
    page.table(
        &[
            "settings (● on the front)",
            "ms",
            "rel_mse",
            "trimmed",
            "RMSE",
            "SSIM",
            "FLIP",
            "mean ratio",
        ],
        &cells,
    );
    falls(page, v)?;
    along(page, v)?;
    for p in &v.pictures {
        for (file, what) in [(&p.shown, p.name.clone()), (&p.heatmap, format!("{}: FLIP", p.name))] {
            if let Ok((width, height, pixels)) = png_file::read_bytes(&folder.join(file)) {
                page.picture(width, height, &pixels, &format!("{what} ({file})"));
            }
        }
    }
    Ok(())
}

fn falls(page: &mut Page, v: &ViewErrors) -> Result<(), PlotError> {
    let series: Vec<Series> = v
        .falls
        .iter()
        .map(|f| Series {
            name: match f.slope {
                Some((slope, error)) => format!("{}: {slope:.2} ± {error:.2}", f.name),
                None => f.name.clone(),
            },
            points: f.points.clone(),
            style: Style::Both,
        })
        .collect();
    let axes = [
        Axis {
            name: "samples a pixel, of one light each",
            logarithmic: true,
        },
        Axis {
            name: "rel_mse",
            logarithmic: true,
        },
    ];
    page.plot(
        &chart(axes, &series)?,
        "How the error of a mean falls with its samples, with the power (−1 for independent samples) and its standard error \
         (data.json, falls).",
    );
    Ok(())
}

fn along(page: &mut Page, v: &ViewErrors) -> Result<(), PlotError> {
    if v.along.iter().all(|a| a.frames.is_empty()) {
        return Ok(());
    }
    for (name, of) in [("rel_mse", (|f| f.1) as fn(&(u32, f64, f64)) -> f64), ("FLIP", |f| f.2)] {
        let series: Vec<Series> = v
            .along
            .iter()
            .map(|a| Series {
                name: a.name.clone(),
                points: a.frames.iter().map(|f| (f64::from(f.0), of(f))).collect(),
                style: Style::Both,
            })
            .collect();
        let axes = [
            Axis {
                name: "frame of the tour",
                logarithmic: false,
            },
            Axis {
                name,
                logarithmic: name == "rel_mse",
            },
        ];
        page.plot(
            &chart(axes, &series)?,
            "Frames of a moving camera as they are shown (data.json, along).",
        );
    }
    Ok(())
}
