//! Plots as SVG that takes the page's ink colour.

use super::Report;
use super::map::{ellipse_m, fix_of, half_axes_m};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

/// Becomes `currentColor`, so that the plot reads on light and on dark.
pub(super) const INK: RGBColor = RGBColor(1, 2, 3);
pub(super) const RIGHT: RGBColor = RGBColor(22, 150, 136);
pub(super) const FALSE: RGBColor = RGBColor(220, 60, 50);
pub(super) const BOUND: RGBColor = RGBColor(214, 140, 30);

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// A plot of this size, drawn into text.
pub(super) fn svg(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> String {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw(&area).and_then(|()| area.present()).expect("drawing into memory does not fail");
    drop(area);
    text.replace("\"#010203\"", "\"currentColor\"").replacen("<svg ", "<svg class=\"plot\" ", 1)
}

/// Error of every fix, east and north, each with its own 95 % ellipse, which should hold the cross.
pub(super) fn error_plane(report: &Report) -> String {
    let fixes: Vec<_> = report.outcomes.iter().filter_map(|o| Some((fix_of(o)?, o.error?))).collect();
    let mut reach: Vec<f64> = fixes.iter().map(|(f, e)| e.length_m() + half_axes_m(f)[0]).collect();
    reach.sort_by(f64::total_cmp);
    // A far false fix would shrink all others to a dot: it is left outside, and counted in the text.
    let limit = reach.get(reach.len() * 9 / 10).copied().unwrap_or(1.0).max(0.1) * 1.15;
    svg((520, 520), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(42)
            .y_label_area_size(56)
            .build_cartesian_2d(-limit..limit, -limit..limit)?;
        mesh(&mut chart, "east, m", "north, m")?;
        for (fix, error) in &fixes {
            let colour = if error.length_m() > report.score.right_m { FALSE } else { RIGHT };
            let around = ellipse_m(fix).map(|(e, n)| (error.east_m + e, error.north_m + n));
            chart.draw_series(LineSeries::new(around, colour.mix(0.35)))?;
            chart.draw_series([Circle::new((error.east_m, error.north_m), 3, colour.filled())])?;
        }
        let arm = limit * 0.06;
        chart.draw_series([
            PathElement::new([(-arm, 0.0), (arm, 0.0)], INK.stroke_width(2)),
            PathElement::new([(0.0, -arm), (0.0, arm)], INK.stroke_width(2)),
        ])?;
        Ok(())
    })
}

/// Error of every fix along the flight, and the long half axis of its own 95 % ellipse.
pub(super) fn error_in_time(report: &Report) -> String {
    let fixes: Vec<_> = times(report)
        .zip(report.outcomes)
        .filter_map(|(t, o)| Some((t, o.error?.length_m(), half_axes_m(fix_of(o)?)[0])))
        .collect();
    let mut heights: Vec<f64> = fixes.iter().flat_map(|f| [f.1, f.2]).collect();
    heights.sort_by(f64::total_cmp);
    let top = heights.get(heights.len() * 19 / 20).copied().unwrap_or(1.0).max(0.1) * 1.3;
    svg((720, 300), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(42)
            .y_label_area_size(56)
            .build_cartesian_2d(span(report), 0.0..top)?;
        mesh(&mut chart, "time, s", "error, m")?;
        let bound = fixes.iter().map(|(t, _, axis)| (*t, axis.min(top)));
        chart.draw_series(LineSeries::new(bound, BOUND.stroke_width(2)))?;
        for (t, error, _) in &fixes {
            let colour = if *error > report.score.right_m { FALSE } else { RIGHT };
            chart
                .draw_series([PathElement::new([(*t, 0.0), (*t, error.min(top))], colour.mix(0.4).stroke_width(2))])?;
            chart.draw_series([Circle::new((*t, error.min(top)), 4, colour.filled())])?;
        }
        Ok(())
    })
}

/// Time of every search along the flight.
pub(super) fn elapsed_in_time(report: &Report) -> String {
    let top = report.outcomes.iter().map(|o| o.elapsed_ms).fold(1.0, f64::max) * 1.15;
    let width = (span(report).end - span(report).start) / report.outcomes.len().max(1) as f64 * 0.32;
    svg((720, 240), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(42)
            .y_label_area_size(56)
            .build_cartesian_2d(span(report), 0.0..top)?;
        mesh(&mut chart, "time, s", "search, ms")?;
        chart.draw_series(
            times(report)
                .zip(report.outcomes)
                .map(|(t, o)| Rectangle::new([(t - width, 0.0), (t + width, o.elapsed_ms)], RIGHT.mix(0.7).filled())),
        )?;
        Ok(())
    })
}

fn times<'a>(report: &'a Report) -> impl Iterator<Item = f64> + 'a {
    report.flight.frames.iter().map(|f| f.time_s)
}

/// The flight's time with a little air on both sides.
fn span(report: &Report) -> std::ops::Range<f64> {
    let (first, last) = times(report).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    let air = ((last - first) * 0.03).max(0.5);
    first - air..last + air
}

/// A chart that is being drawn, on any two axes.
pub(super) type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

/// Axes with their names, and lines at the labelled values.
pub(super) fn mesh<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&tick, &tick])
}

/// [`mesh`] whose numbers upwards are written by `name`.
pub(super) fn mesh_named<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str, name: &dyn Fn(&f64) -> String) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&tick, name])
}

/// [`mesh`] for logarithmic axes: of each decade only 1, 2 and 5 are labelled.
pub(super) fn log_mesh<X, Y>(chart: &mut Chart<X, Y>, x: &str, y: &str) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    labelled_mesh(chart, [x, y], [&log_tick, &log_tick])
}

/// `names` of the axes, and what writes their numbers.
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

/// A line with its name in the legend.
pub(super) fn named_line<X, Y>(
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

/// The names of what is drawn.
pub(super) fn legend<'a, 'b: 'a, X, Y>(chart: &mut Chart<'a, 'b, X, Y>, position: SeriesLabelPosition) -> Drawn
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

/// A tick's number without needless zeros; ticks are never finer than a hundredth.
fn tick(value: &f64) -> String {
    let text = format!("{:.2}", if value.abs() < 0.005 { 0.0 } else { *value });
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A tick of a logarithmic axis where its first digit is 1, 2 or 5, else nothing.
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
