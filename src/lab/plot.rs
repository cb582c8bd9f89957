//! Plots as SVG: readable in print and on light and dark pages, for its colours follow the reader's scheme.

use crate::error::{Error, Result};
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::element::DynElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// One curve or one set of bars.
#[derive(Debug, Clone)]
pub struct Curve {
    /// For the legend.
    pub name: String,
    /// x, y and half the height of the error bar.
    pub points: Vec<(f64, f64, f64)>,
}

/// What is drawn.
#[derive(Debug, Clone)]
pub struct Plot<'a> {
    /// Above it.
    pub title: &'a str,
    /// Below the horizontal axis.
    pub x: &'a str,
    /// Beside the vertical axis.
    pub y: &'a str,
    /// Names of 0, 1, ... on the horizontal axis, for bars; none for curves.
    pub categories: Option<Vec<String>>,
    /// Whether the vertical axis may be logarithmic: for what is never negative.
    pub may_be_logarithmic: bool,
    /// In the legend's order.
    pub curves: Vec<Curve>,
}

const SIZE: (u32, u32) = (760, 400);
const LEGEND: u32 = 190;
const FONT: &str = "sans-serif";
/// Ratio of largest to smallest from which an axis is logarithmic.
const LOGARITHMIC_FROM: f64 = 8.0;

/// Text and axes, then grid, then series: each with its colour on dark pages. The series' are Okabe and Ito's (2008), told
/// apart by colour-blind readers, and by their markers and dashes in print without colour.
const INK: (RGBColor, &str) = (RGBColor(34, 34, 34), "#dddddd");
const GRID: (RGBColor, &str) = (RGBColor(221, 221, 221), "#444444");
const SERIES: [(RGBColor, &str); 7] = [
    (RGBColor(0, 114, 178), "#56b4e9"),
    (RGBColor(213, 94, 0), "#ff9248"),
    (RGBColor(0, 128, 96), "#2fc79a"),
    (RGBColor(160, 72, 128), "#e09ac4"),
    (RGBColor(120, 100, 0), "#e0c83c"),
    (RGBColor(86, 86, 170), "#a8a8f0"),
    (RGBColor(90, 90, 90), "#b0b0b0"),
];

/// Draws.
///
/// # Errors
/// `BAD_VALUE` where there is nothing to draw.
pub fn svg(plot: &Plot) -> Result<String> {
    let values = || plot.curves.iter().flat_map(|curve| &curve.points);
    if values().next().is_none() {
        return Err(Error::bad_value("plot", format!("'{}' has no points", plot.title)));
    }
    let mut text = String::new();
    draw(plot, &mut text).map_err(|what| Error::bad_value("plot", what))?;
    Ok(with_style(&text))
}

/// A range that holds all values, and whether it is to be logarithmic.
fn range(values: impl Iterator<Item = (f64, f64)> + Clone, logarithmic: bool) -> (std::ops::Range<f64>, bool) {
    let low = values.clone().map(|(low, _)| low).fold(f64::INFINITY, f64::min);
    let high = values.map(|(_, high)| high).fold(f64::NEG_INFINITY, f64::max);
    if logarithmic && low > 0.0 && high / low >= LOGARITHMIC_FROM {
        return (low / 1.3..high * 1.3, true);
    }
    let (low, high) = (low.min(0.0), high.max(0.0));
    let room = if high > low { 0.06 * (high - low) } else { 1.0 };
    (if low < 0.0 { low - room } else { low }..if high > 0.0 { high + room } else { high }, false)
}

fn draw(plot: &Plot, text: &mut String) -> std::result::Result<(), String> {
    let points = plot.curves.iter().flat_map(|curve| curve.points.iter());
    let (y, y_log) = range(
        points.clone().map(|(_, y, e)| (if y - e > 0.0 || !plot.may_be_logarithmic { y - e } else { *y }, y + e)),
        plot.may_be_logarithmic && plot.categories.is_none(),
    );
    match &plot.categories {
        Some(names) => chart(plot, text, -0.5..names.len() as f64 - 0.5, y, false),
        None => {
            let (x, x_log) = range(points.map(|(x, ..)| (*x, *x)), true);
            match (x_log, y_log) {
                (true, true) => chart(plot, text, x.log_scale(), y.log_scale(), true),
                (true, false) => chart(plot, text, x.log_scale(), y, false),
                (false, true) => chart(plot, text, x, y.log_scale(), true),
                (false, false) => chart(plot, text, x, y, false),
            }
        }
    }
}

/// The chart with either kind of axis.
fn chart<X, Y>(plot: &Plot, text: &mut String, x: X, y: Y, y_log: bool) -> std::result::Result<(), String>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let fault = |error: DrawingAreaErrorKind<_>| format!("'{}': {error}", plot.title);
    let ink = |size: u32| (FONT, size).into_font().color(&INK.0);
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    let named = plot.curves.iter().any(|curve| !curve.name.is_empty());
    let (left, right) = area.split_horizontally(SIZE.0 - if named { LEGEND } else { 0 });
    let mut chart = ChartBuilder::on(&left)
        .caption(plot.title, ink(17))
        .margin(8)
        .x_label_area_size(44)
        .y_label_area_size(66)
        .build_cartesian_2d(x, y)
        .map_err(fault)?;
    let names = plot.categories.as_deref();
    let category = |x: &f64| match names {
        Some(names) if (x - x.round()).abs() < 1e-6 => names.get(x.round() as usize).cloned().unwrap_or_default(),
        Some(_) => String::new(),
        None => number(*x),
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.0)
        .axis_style(INK.0)
        .x_desc(plot.x)
        .y_desc(plot.y)
        .x_labels(names.map_or(8, |names| 2 * names.len() + 1))
        .x_label_formatter(&category)
        .y_label_formatter(&|y| number(*y))
        .axis_desc_style(ink(14))
        .label_style(ink(13))
        .draw()
        .map_err(fault)?;
    let count = plot.curves.len() as f64;
    for (i, curve) in plot.curves.iter().enumerate() {
        let color = SERIES[i % SERIES.len()].0;
        // Bars of one category stand side by side and fill four fifths of its room.
        let bar = 0.8 / count;
        let shift = if names.is_some() { (i as f64 - 0.5 * (count - 1.0)) * bar } else { 0.0 };
        let points: Vec<_> = curve.points.iter().map(|(x, y, e)| (x + shift, *y, *e)).collect();
        if names.is_some() {
            let half = 0.42 * bar;
            let bars = points.iter().map(|(x, y, _)| Rectangle::new([(x - half, 0.0), (x + half, *y)], color.filled()));
            chart.draw_series(bars).map_err(fault)?;
        } else {
            let line = points.iter().map(|(x, y, _)| (*x, *y));
            if i < SERIES.len() {
                chart.draw_series(LineSeries::new(line, color.stroke_width(2))).map_err(fault)?;
            } else {
                chart.draw_series(DashedLineSeries::new(line, 6, 4, color.stroke_width(2))).map_err(fault)?;
            }
            chart.draw_series(points.iter().map(|(x, y, _)| marker(i, (*x, *y), color))).map_err(fault)?;
        }
        let stroke = if names.is_some() { INK.0 } else { color };
        let bars = points.iter().filter(|(_, _, e)| *e > 0.0).map(|(x, y, e)| {
            let low = if y_log { (y - e).max(y * 0.1) } else { y - e };
            PathElement::new([(*x, low), (*x, y + e)], stroke.stroke_width(1))
        });
        chart.draw_series(bars).map_err(fault)?;
    }
    drop(chart);
    for (i, curve) in plot.curves.iter().enumerate().filter(|(_, curve)| !curve.name.is_empty()) {
        let (row, color) = (44 + 20 * i as i32, SERIES[i % SERIES.len()].0);
        right.draw(&marker(i, (10, row), color)).map_err(fault)?;
        let style = ink(13).pos(Pos::new(HPos::Left, VPos::Center));
        right.draw(&Text::new(shortened(&curve.name), (24, row), style)).map_err(fault)?;
    }
    area.present().map_err(fault)
}

/// A mark of its own for each of four series in turn.
fn marker<C: Clone + 'static, DB: DrawingBackend>(index: usize, at: C, color: RGBColor) -> DynElement<'static, DB, C> {
    match index % 4 {
        0 => Circle::new(at, 4, color.filled()).into_dyn(),
        1 => TriangleMarker::new(at, 5, color.filled()).into_dyn(),
        2 => Cross::new(at, 4, color.stroke_width(2)).into_dyn(),
        _ => Circle::new(at, 4, color.stroke_width(2)).into_dyn(),
    }
}

/// A legend's name, cut to the room there is.
fn shortened(name: &str) -> String {
    const MOST: usize = 26;
    if name.chars().count() <= MOST {
        return name.to_owned();
    }
    let kept: String = name.chars().take(MOST - 1).collect();
    format!("{kept}…")
}

/// Three figures, without an exponent where there is room.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let size = value.abs();
    if (1e-3..1e6).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        return short.to_owned();
    }
    format!("{value:.0e}")
}

/// With the colours of dark pages.
fn with_style(svg: &str) -> String {
    let mut rules = String::new();
    for (light, dark) in [INK, GRID].iter().chain(&SERIES) {
        let light = format!("#{:02X}{:02X}{:02X}", light.0, light.1, light.2);
        rules += &format!("[stroke=\"{light}\"]{{stroke:{dark}}}[fill=\"{light}\"]{{fill:{dark}}}");
    }
    let style = format!("<style>@media (prefers-color-scheme: dark){{{rules}}}</style>\n");
    match svg.find(">\n") {
        Some(end) => format!("{}{style}{}", &svg[..end + 2], &svg[end + 2..]),
        None => svg.to_owned(),
    }
}
