//! Plots as SVG: lines and points over linear or logarithmic axes, and stacked bars.

use plotters::coord::combinators::WithKeyPoints;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use thiserror::Error;

/// A picture could not be drawn.
#[derive(Debug, Error)]
#[error("cannot draw the plot: {0}")]
pub struct PlotError(String);

impl PlotError {
    /// From what the drawing library says.
    pub fn of(error: impl std::fmt::Display) -> Self {
        Self(error.to_string())
    }
}

/// Colours that people who cannot tell red from green can tell apart (Okabe and Ito 2008, and two of Tol 2021).
const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 150),
    RGBColor(136, 34, 85),
    RGBColor(128, 128, 40),
];
/// Size of a plot, pixels; rows of the legend are added.
const SIZE: (u32, u32) = (720, 320);
const LEGEND_ROW: u32 = 18;
const LEGEND_LEFT: u32 = 50;
/// Width of the legend's marks, and of a letter.
const LEGEND_MARK: u32 = 34;
const LETTER: f32 = 7.2;
const FONT: (&str, i32) = ("sans-serif", 13);

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    Line,
    Points,
    Both,
}

/// Points of one kind.
#[derive(Clone, Debug)]
pub struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    pub style: Style,
}

/// What an axis shows.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    pub name: &'a str,
    pub logarithmic: bool,
}

/// Number of the colour of the `i`-th series.
pub fn colour(i: usize) -> RGBColor {
    COLOURS[i % COLOURS.len()]
}

fn span(values: impl Iterator<Item = f64>, axis: Axis<'_>) -> (f64, f64) {
    let usable = values.filter(|v| v.is_finite() && (!axis.logarithmic || *v > 0.0));
    let (lo, hi) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    match (lo <= hi, axis.logarithmic) {
        (false, _) => (0.1, 10.0),
        (true, true) => (lo / 1.3, hi * 1.3),
        // Times and counts begin at 0, so that lengths can be compared.
        (true, false) => {
            let low = if lo >= 0.0 { 0.0 } else { lo * 1.05 };
            (low, if hi > low { hi + (hi - low) * 0.05 } else { low + 1.0 })
        }
    }
}

/// A number as short as its size allows.
pub fn short(v: f64) -> String {
    let a = v.abs();
    if v == 0.0 {
        "0".to_owned()
    } else if !(1e-2..1e5).contains(&a) {
        format!("{v:.1e}")
    } else if a >= 100.0 || v.fract() == 0.0 {
        format!("{v:.0}")
    } else if a >= 1.0 {
        format!("{v:.2}")
    } else {
        format!("{v:.3}")
    }
}

/// Where numbers stand on a logarithmic axis: the fewer decades, the more of them.
fn ticks(lo: f64, hi: f64) -> Vec<f64> {
    let decades = (hi / lo).log10();
    let (steps, every): (&[f64], i32) = match decades {
        d if d <= 1.0 => (&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0], 1),
        d if d <= 2.5 => (&[1.0, 2.0, 5.0], 1),
        d => (&[1.0], (d / 8.0).ceil() as i32),
    };
    let decades = lo.log10().floor() as i32..=hi.log10().ceil() as i32;
    decades
        .filter(|d| d.rem_euclid(every) == 0)
        .flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)))
        .filter(|v| (lo..=hi).contains(v))
        .collect()
}

/// Columns of a legend and their width, pixels.
fn legend_columns(names: &[&str]) -> (u32, u32) {
    let letters = names.iter().map(|n| n.chars().count()).max().unwrap_or(0);
    let width = LEGEND_MARK + (letters as f32 * LETTER) as u32;
    (((SIZE.0 - LEGEND_LEFT) / width).max(1), width)
}

/// Height of a legend.
fn legend_height(names: &[&str]) -> u32 {
    (names.len() as u32).div_ceil(legend_columns(names).0) * LEGEND_ROW + 6
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn legend(area: &Area<'_>, names: &[&str]) -> Result<(), PlotError> {
    let (columns, width) = legend_columns(names);
    for (i, name) in (0..).zip(names) {
        let x = (LEGEND_LEFT + i % columns * width) as i32;
        let y = 2 + (i / columns * LEGEND_ROW) as i32;
        let i = i as usize;
        area.draw(&Rectangle::new([(x, y + 2), (x + 14, y + 12)], colour(i).filled()))
            .map_err(PlotError::of)?;
        area.draw(&Text::new((*name).to_owned(), (x + 19, y), FONT))
            .map_err(PlotError::of)?;
    }
    Ok(())
}

fn draw<X, Y>(area: &Area<'_>, x: X, y: Y, axes: [Axis<'_>; 2], series: &[Series]) -> Result<(), PlotError>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
    Y::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
{
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(24)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(x, y)
        .map_err(PlotError::of)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 225, 225))
        .x_desc(axes[0].name)
        .y_desc(axes[1].name)
        .x_labels(8)
        .y_labels(7)
        .x_label_formatter(&|v| short(*v))
        .y_label_formatter(&|v| short(*v))
        .label_style(FONT)
        .draw()
        .map_err(PlotError::of)?;
    for (i, s) in series.iter().enumerate() {
        let shown = |p: &(f64, f64)| {
            let fits = |v: f64, axis: Axis<'_>| v.is_finite() && (!axis.logarithmic || v > 0.0);
            fits(p.0, axes[0]) && fits(p.1, axes[1])
        };
        let points: Vec<(f64, f64)> = s.points.iter().copied().filter(shown).collect();
        if s.style != Style::Points {
            chart
                .draw_series(LineSeries::new(points.iter().copied(), colour(i).stroke_width(2)))
                .map_err(PlotError::of)?;
        }
        if s.style != Style::Line {
            chart
                .draw_series(points.iter().map(|p| Circle::new(*p, 4, colour(i).filled())))
                .map_err(PlotError::of)?;
        }
    }
    Ok(())
}

fn logarithmic((lo, hi): (f64, f64)) -> WithKeyPoints<LogCoord<f64>> {
    (lo..hi).log_scale().with_key_points(ticks(lo, hi))
}

/// Draws series over two axes.
///
/// # Errors
/// [`PlotError`] where the drawing library fails.
pub fn chart(axes: [Axis<'_>; 2], series: &[Series]) -> Result<String, PlotError> {
    let names: Vec<&str> = series.iter().map(|s| s.name.as_str()).collect();
    let rows = legend_height(&names);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (SIZE.0, SIZE.1 + rows)).into_drawing_area();
        root.fill(&WHITE).map_err(PlotError::of)?;
        let (top, area) = root.split_vertically(rows);
        legend(&top, &names)?;
        let all = || series.iter().flat_map(|s| s.points.iter());
        let x = span(all().map(|p| p.0), axes[0]);
        let y = span(all().map(|p| p.1), axes[1]);
        match (axes[0].logarithmic, axes[1].logarithmic) {
            (false, false) => draw(&area, x.0..x.1, y.0..y.1, axes, series)?,
            (true, false) => draw(&area, logarithmic(x), y.0..y.1, axes, series)?,
            (false, true) => draw(&area, x.0..x.1, logarithmic(y), axes, series)?,
            (true, true) => draw(&area, logarithmic(x), logarithmic(y), axes, series)?,
        }
        root.present().map_err(PlotError::of)?;
    }
    Ok(text)
}

/// A bar: its name, and the lengths of its parts.
pub type Bar = (String, Vec<f64>);

/// Height of a bar with its gap, and room for names, pixels.
const BAR: u32 = 24;
const NAMES: i32 = 190;

/// Draws stacked bars, one below the other.
///
/// # Errors
/// [`PlotError`] where the drawing library fails.
pub fn bars(unit: &str, parts: &[&str], bars: &[Bar]) -> Result<String, PlotError> {
    let top = legend_height(parts);
    let height = top + BAR * bars.len() as u32 + 12;
    let longest = bars
        .iter()
        .map(|b| b.1.iter().sum::<f64>())
        .fold(f64::MIN_POSITIVE, f64::max);
    let scale = f64::from(SIZE.0 as i32 - NAMES - 90) / longest;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (SIZE.0, height)).into_drawing_area();
        root.fill(&WHITE).map_err(PlotError::of)?;
        let (legend_area, area) = root.split_vertically(top);
        if parts.len() > 1 {
            legend(&legend_area, parts)?;
        }
        for (row, (name, lengths)) in bars.iter().enumerate() {
            let y = (row as u32 * BAR) as i32 + 4;
            area.draw(&Text::new(name.clone(), (6, y + 2), FONT))
                .map_err(PlotError::of)?;
            let mut x = f64::from(NAMES);
            for (i, length) in lengths.iter().enumerate() {
                let end = x + length.max(0.0) * scale;
                let corners = [(x as i32, y), (end as i32, y + BAR as i32 - 7)];
                area.draw(&Rectangle::new(corners, colour(i).filled()))
                    .map_err(PlotError::of)?;
                x = end;
            }
            let sum = format!("{} {unit}", short(lengths.iter().sum()));
            area.draw(&Text::new(sum, (x as i32 + 6, y + 2), FONT))
                .map_err(PlotError::of)?;
        }
        root.present().map_err(PlotError::of)?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_not_a_number_is_left_out() {
        let axis = |logarithmic| Axis { name: "x", logarithmic };
        let series = [Series {
            name: "a".into(),
            points: vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 0.0), (3.0, 4.0)],
            style: Style::Both,
        }];
        for (a, b) in [(false, false), (true, false), (false, true), (true, true)] {
            let text = chart([axis(a), axis(b)], &series).expect("a plot");
            assert!(text.starts_with("<svg") && !text.contains("NaN"), "{text}");
        }
        assert!(chart([axis(true), axis(true)], &[]).is_ok());
        assert_eq!(ticks(0.9, 6.0), [1.0, 1.5, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(ticks(3.0, 110.0).len(), 5);
        assert_eq!(ticks(1e-3, 1e3).len(), 7);
        assert!(bars("ms", &["a"], &[("b".into(), vec![0.0])]).is_ok());
        assert_eq!(
            [short(0.0), short(12.0), short(0.25), short(1e-5)],
            ["0", "12", "0.250", "1.0e-5"]
        );
    }
}
