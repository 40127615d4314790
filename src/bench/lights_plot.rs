//! Error against time as a picture: one panel per map, both axes logarithmic.

use super::lights::{MapReport, Mode};
use super::lights_report::LightsReport;
use super::plot::PlotError;
use plotters::prelude::*;

/// Size of a panel, pixels.
const PANEL: (u32, u32) = (300, 240);
const COLUMNS: u32 = 4;
/// Room for the legend, pixels.
const LEGEND: u32 = 40;

/// Colours that people who cannot tell red from green can tell apart (Okabe and Ito 2008).
const fn colour(mode: Mode) -> RGBColor {
    match mode {
        Mode::Uniform => RGBColor(0, 0, 0),
        Mode::Power => RGBColor(230, 159, 0),
        Mode::Bvh => RGBColor(86, 180, 233),
        Mode::Cells => RGBColor(0, 158, 115),
        Mode::Resampled => RGBColor(0, 114, 178),
        Mode::Reservoir => RGBColor(213, 94, 0),
    }
}

/// Times and errors of a mode that no faster configuration beats, by time.
fn front(map: &MapReport, mode: Mode) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = map
        .measured
        .iter()
        .filter(|m| m.config.mode == mode && m.rel_mse > 0.0)
        .map(|m| (m.light_ms, m.rel_mse))
        .collect();
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = f64::INFINITY;
    points.retain(|p| {
        let better = p.1 < best;
        best = best.min(p.1);
        better
    });
    points
}

/// Draws the report as SVG.
///
/// # Errors
/// [`PlotError`] where the drawing library fails.
pub fn svg(report: &LightsReport) -> Result<String, PlotError> {
    let rows = (report.maps.len() as u32).div_ceil(COLUMNS).max(1);
    let mut text = String::new();
    {
        let size = (PANEL.0 * COLUMNS, PANEL.1 * rows + LEGEND);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(PlotError::of)?;
        let (legend, panels) = root.split_vertically(LEGEND);
        for (i, mode) in Mode::ALL.into_iter().enumerate() {
            let x = 20 + i as i32 * 130;
            legend
                .draw(&Rectangle::new([(x, 14), (x + 18, 24)], colour(mode).filled()))
                .map_err(PlotError::of)?;
            legend
                .draw(&Text::new(mode.name(), (x + 24, 12), ("sans-serif", 15)))
                .map_err(PlotError::of)?;
        }
        let areas = panels.split_evenly((rows as usize, COLUMNS as usize));
        for (map, area) in report.maps.iter().zip(&areas) {
            let all: Vec<(f64, f64)> = Mode::ALL.into_iter().flat_map(|m| front(map, m)).collect();
            let span = |f: fn(&(f64, f64)) -> f64| {
                let (lo, hi) = all
                    .iter()
                    .map(f)
                    .fold((f64::INFINITY, 0.0f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
                if lo < hi { lo / 1.3..hi * 1.3 } else { 0.1..10.0 }
            };
            let mut chart = ChartBuilder::on(area)
                .margin(6)
                .caption(format!("{} ({} lights)", map.map, map.lights), ("sans-serif", 14))
                .x_label_area_size(28)
                .y_label_area_size(46)
                .build_cartesian_2d(span(|p| p.0).log_scale(), span(|p| p.1).log_scale())
                .map_err(PlotError::of)?;
            chart
                .configure_mesh()
                .light_line_style(WHITE)
                .x_desc("ms")
                .y_desc("rel_mse")
                .x_labels(5)
                .y_labels(6)
                .y_label_formatter(&|v| format!("{v:.0e}"))
                .draw()
                .map_err(PlotError::of)?;
            for mode in Mode::ALL {
                let points = front(map, mode);
                chart
                    .draw_series(LineSeries::new(points.iter().copied(), colour(mode).stroke_width(2)))
                    .map_err(PlotError::of)?;
                chart
                    .draw_series(points.iter().map(|p| Circle::new(*p, 2, colour(mode).filled())))
                    .map_err(PlotError::of)?;
            }
        }
        root.present().map_err(PlotError::of)?;
    }
    Ok(text)
}
