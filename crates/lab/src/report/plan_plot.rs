//! `plan_svgs`: v_max against K1, T0_max against D_U, and how the searches settle.

use super::chart::{BOUND, INK, RIGHT, legend, mesh, named_line, svg};
use overfly_core::coupling::{Combined, CouplingParameters, ExecutionSequence, Parallel, Sequential};
use overfly_ingest::plan::Forecast;
use plotters::prelude::*;

/// A line of a plot: name, colour, points.
type Line = (&'static str, RGBColor, Vec<(f64, f64)>);

/// Plots by name: `speed`, `mission`, `settling`.
pub fn plan_svgs(forecast: &Forecast) -> Vec<(&'static str, String)> {
    vec![("speed", speed(forecast)), ("mission", mission(forecast)), ("settling", settling(forecast))]
}

/// Factors from a hundredth to a hundred, evenly spaced in the logarithm.
fn factors() -> impl Iterator<Item = f64> {
    (0..=80).map(|i| 10f64.powf(f64::from(i) / 20.0 - 2.0))
}

fn speed(forecast: &Forecast) -> String {
    let p = forecast.parameters;
    let curve = |of: &dyn Fn(CouplingParameters) -> Option<f64>| -> Vec<(f64, f64)> {
        factors()
            .filter_map(|f| {
                let scaled = CouplingParameters { seconds_per_tile: p.seconds_per_tile * f, ..p };
                of(scaled).map(|v| (scaled.seconds_per_tile.log10(), v.log10()))
            })
            .collect()
    };
    let here = p.speed_mps.log10();
    let ends = [0.01, 100.0].map(|f| ((p.seconds_per_tile * f).log10(), here));
    let lines = [
        ("sequential (7)", RIGHT, curve(&|p| Sequential::new(p).ok().map(|m| m.max_speed_mps()))),
        ("combined", BOUND, curve(&|p| Combined::new(p).ok().map(|m| m.max_speed_mps()))),
        ("this aircraft", INK, ends.to_vec()),
    ];
    let dot = (p.seconds_per_tile.log10(), here);
    chart("log10 of K1, s an image", "log10 of v_max, m/s", &lines, Some(dot))
}

fn mission(forecast: &Forecast) -> String {
    let p = forecast.parameters;
    let curve = |of: &dyn Fn(Sequential) -> Option<f64>| -> Vec<(f64, f64)> {
        factors()
            .filter_map(|f| {
                let scaled = CouplingParameters { unit_drift_m: p.unit_drift_m * f, ..p };
                let value = of(Sequential::new(scaled).ok()?).filter(|v| v.is_finite() && *v > 0.0)?;
                Some((scaled.unit_drift_m.log10(), value.log10()))
            })
            .filter(|(x, _)| x.is_finite())
            .collect()
    };
    let lines = [
        ("T0_max (16), s", RIGHT, curve(&|m| m.max_mission_s().ok())),
        ("n_opt (13)", BOUND, curve(&|m| m.best_relative_count().ok())),
    ];
    chart("log10 of D_U, m", "log10", &lines, None)
}

fn settling(forecast: &Forecast) -> String {
    let p = forecast.parameters;
    let run = |sequence: Option<ExecutionSequence>, start_s: f64| -> Vec<(f64, f64)> {
        let times = sequence.into_iter().flat_map(|s| s.times_s(start_s).take(16).collect::<Vec<_>>());
        times.take_while(|t| *t < 1e6).enumerate().map(|(k, t)| (k as f64, t.max(1e-4).log10())).collect()
    };
    let parallel = Parallel::new(p).and_then(|m| m.sequence()).ok();
    let combined = Combined::new(p).and_then(|m| m.sequence()).ok();
    let late = |unstable: Option<f64>| unstable.filter(|t| t.is_finite()).map_or(100.0, |t| 0.9 * t);
    let lines = [
        ("parallel", RIGHT, run(parallel, late(forecast.parallel.unstable_s))),
        ("combined", BOUND, run(combined, late(forecast.combined.unstable_s))),
    ];
    chart("search (0: the time since the last image)", "log10 of its time, s", &lines, None)
}

fn chart(x: &str, y: &str, lines: &[Line], dot: Option<(f64, f64)>) -> String {
    let points = || lines.iter().flat_map(|l| &l.2).chain(dot.iter());
    let range = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = points().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low <= high { low - 0.1..high + 0.1 } else { 0.0..1.0 }
    };
    svg((720, 360), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
        mesh(&mut chart, x, y)?;
        for (name, colour, line) in lines {
            named_line(&mut chart, name, *colour, line.iter().copied())?;
        }
        chart.draw_series(dot.iter().map(|&d| Circle::new(d, 5, INK.filled())))?;
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}
