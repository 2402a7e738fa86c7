//! Parts of all plots: colours, axes, legends. A plot is SVG text that takes the ink colour of its page.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

/// Stands for `currentColor`, so that a plot can be read on a light and on a dark page.
pub const INK: RGBColor = RGBColor(1, 2, 3);
/// A right answer.
pub const RIGHT: RGBColor = RGBColor(22, 150, 136);
/// A false answer.
pub const FALSE: RGBColor = RGBColor(220, 60, 50);
/// A bound or a prediction.
pub const BOUND: RGBColor = RGBColor(214, 140, 30);

/// A plot being drawn.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// The result of drawing.
pub type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The SVG text of a plot of `size` pixels.
pub fn svg(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> String {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw(&area).and_then(|()| area.present()).expect("drawing into memory does not fail");
    drop(area);
    text.replace("\"#010203\"", "\"currentColor\"").replacen("<svg ", "<svg class=\"plot\" ", 1)
}

/// The range of times in `times_s`, with a margin of 3 % and at least half a second on both sides.
pub fn time_range(times_s: impl Iterator<Item = f64>) -> Range<f64> {
    let (first, last) = times_s.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    let margin_s = ((last - first) * 0.03).max(0.5);
    first - margin_s..last + margin_s
}

/// Returns the end of an axis from 0 that shows 95 % of `heights`, so that an outlier does not flatten the rest.
pub fn top_of(heights: impl Iterator<Item = f64>) -> f64 {
    let mut heights: Vec<f64> = heights.filter(|h| h.is_finite()).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() * 19 / 20).copied().unwrap_or(1.0).max(0.1) * 1.3
}

/// Returns a chart on two linear axes, with room for their labels.
///
/// # Errors
/// Those of drawing.
pub fn linear_chart<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
) -> Result<LinearChart<'a, 'b>, DrawingAreaErrorKind<std::io::Error>> {
    ChartBuilder::on(area).margin(10).x_label_area_size(42).y_label_area_size(56).build_cartesian_2d(x, y)
}

/// A chart on two linear axes.
pub type LinearChart<'a, 'b> = Chart<'a, 'b, RangedCoordf64, RangedCoordf64>;

/// A chart on any two axes.
pub type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

/// Draws the axes with their names, and lines at the labelled values.
pub fn mesh<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&tick, &tick])
}

/// Like [`mesh`]; `name` writes the numbers of the y axis.
pub fn mesh_named<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str, name: &dyn Fn(&f64) -> String) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&tick, name])
}

/// Like [`mesh`], for logarithmic axes: only 1, 2 and 5 of each decade are labelled.
pub fn log_mesh<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&log_tick, &log_tick])
}

/// Draws axes with `names`; `numbers` write the labels.
fn labelled_mesh<X, Y>(chart: &mut Chart<X, Y>, names: [&str; 2], numbers: [&dyn Fn(&f64) -> String; 2]) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let text = ("sans-serif", 14).into_font().color(&INK);
    chart
        .configure_mesh()
        .x_desc(names[0])
        .y_desc(names[1])
        .x_label_formatter(numbers[0])
        .y_label_formatter(numbers[1])
        .axis_desc_style(text.clone())
        .label_style(text)
        .axis_style(INK.mix(0.6))
        .bold_line_style(INK.mix(0.14))
        .light_line_style(TRANSPARENT)
        .draw()
}

/// Draws a line, and names it in the legend.
pub fn named_line<X, Y>(
    chart: &mut Chart<X, Y>,
    name: &str,
    colour: RGBColor,
    points: impl IntoIterator<Item = (f64, f64)>,
) -> Drawn
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    chart
        .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
        .label(name)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    Ok(())
}

/// Draws the legend.
pub fn legend<'a, 'b: 'a, X, Y>(chart: &mut Chart<'a, 'b, X, Y>, position: SeriesLabelPosition) -> Drawn
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    chart
        .configure_series_labels()
        .position(position)
        .label_font(("sans-serif", 14).into_font().color(&INK))
        .border_style(INK.mix(0.2))
        .draw()
}

/// The label of a tick, without trailing zeros. Ticks are never finer than a hundredth.
fn tick(value: &f64) -> String {
    let text = format!("{:.2}", if value.abs() < 0.005 { 0.0 } else { *value });
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The label of a tick on a logarithmic axis; empty unless its first digit is 1, 2 or 5.
fn log_tick(value: &f64) -> String {
    let power = value.log10().floor().min(0.0);
    let text = format!("{:.*}", (-power) as usize, value);
    let first = text.chars().find(|c| ('1'..='9').contains(c));
    if matches!(first, Some('1' | '2' | '5')) { text } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_short() {
        assert_eq!([0.0, -1e-17, 0.25, 10.0, 1000.0, -2.5].map(|v| tick(&v)), ["0", "0", "0.25", "10", "1000", "-2.5"]);
        let log = [0.001, 0.02, 0.3, 0.5, 1.0, 70.0, 500.0, 10_000.0].map(|v| log_tick(&v));
        assert_eq!(log, ["0.001", "0.02", "", "0.5", "1", "", "500", "10000"]);
    }
}
