//! Plots of a simulation: flights without a failure over time, their distribution, f(n), coverage; and all plots by
//! name.

use super::chart::{BOUND, Chart, Drawn, FALSE, INK, RIGHT, legend, mesh, named_line, svg};
use super::simulation_failures_plot::failures;
use crate::trial::simulation::{BandComparison, CHECKPOINTS, SimulatedFlights, SimulationSummary};
use overfly_core::coupling::Mode;
use overfly_core::coupling::Sequential;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

type LinearChart<'a, 'b> = Chart<'a, 'b, RangedCoordf64, RangedCoordf64>;

/// Colours of scenarios.
const COLOURS: [RGBColor; 6] =
    [RIGHT, BOUND, RGBColor(120, 90, 190), RGBColor(60, 130, 210), RGBColor(190, 80, 130), RGBColor(120, 140, 60)];
const SIZE: (u32, u32) = (720, 420);

/// Plots by name, if there is something to plot: `failures`, `survival`, `spread`, `together`, `optimum`, `coverage`.
pub fn simulation_svgs(flown: &[SimulatedFlights], summaries: &[SimulationSummary]) -> Vec<(&'static str, String)> {
    let plots = [
        ("failures", failures(summaries)),
        ("survival", survival(flown)),
        ("spread", with_failures(flown).first().and_then(|(f, _)| spread(f))),
        ("together", most_together(flown, summaries).and_then(spread)),
        ("optimum", optimum(flown, summaries)),
        ("coverage", coverage(summaries)),
    ];
    plots.into_iter().filter_map(|(name, plot)| Some((name, plot?))).collect()
}

/// The name of a scenario and its mode, for a legend.
fn name(variation: &str, mode: Mode) -> String {
    format!("{variation}, {}", mode.word())
}

fn plot(
    [left, right, bottom, top]: [f64; 4],
    [x, y]: [&str; 2],
    position: Option<SeriesLabelPosition>,
    draw: impl FnOnce(&mut LinearChart) -> Drawn,
) -> String {
    svg(SIZE, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(left..right, bottom..top)?;
        mesh(&mut chart, x, y)?;
        draw(&mut chart)?;
        position.map_or(Ok(()), |position| legend(&mut chart, position))
    })
}

/// Scenarios with a predicted p, at most as many as there are colours.
fn with_failures(flown: &[SimulatedFlights]) -> Vec<(&SimulatedFlights, RGBColor)> {
    let has = |f: &&SimulatedFlights| f.prediction.failure_probability.is_some() && f.prediction.cycle_s.is_some();
    flown.iter().filter(has).zip(COLOURS).collect()
}

/// A plot of the share of the flights without a failure, against time over T0_max.
fn survival(flown: &[SimulatedFlights]) -> Option<String> {
    let shown = with_failures(flown);
    let length = |f: &SimulatedFlights| f.plan.mission_s / f.prediction.max_mission_s.unwrap_or(f.plan.mission_s);
    let right = shown.iter().map(|(f, _)| length(f)).reduce(f64::max)?.min(3.0);
    let labels = ["time over T0_max", "flights without a failure"];
    Some(plot([0.0, right, 0.0, 1.02], labels, Some(SeriesLabelPosition::UpperRight), |chart| {
        for (f, colour) in shown {
            let (Some(p), Some(cycle_s)) = (f.prediction.failure_probability, f.prediction.cycle_s) else { continue };
            let scale_s = f.plan.mission_s / length(f);
            let end = length(f).min(right);
            let at = |k: u32| end * f64::from(k) / 120.0;
            let predicted = (0..=120).map(|k| (at(k), (at(k) * scale_s / cycle_s * (-p).ln_1p()).exp()));
            chart.draw_series(LineSeries::new(predicted, INK.mix(0.7).stroke_width(1)))?;
            let mut firsts: Vec<f64> = f.tallies.iter().filter_map(|t| t.first_failure_s).collect();
            firsts.sort_by(f64::total_cmp);
            let left = |t: f64| 1.0 - firsts.partition_point(|first| *first <= t) as f64 / f.tallies.len() as f64;
            let simulated = (0..=120).map(|k| (at(k), left(at(k) * scale_s)));
            named_line(chart, &name(&f.variation, f.mode), colour, simulated)?;
        }
        Ok(())
    }))
}

/// The scenario whose failures cluster most: the variance of a flight's failures is the largest multiple of their
/// mean, beyond chance.
fn most_together<'a>(flown: &'a [SimulatedFlights], summaries: &[SimulationSummary]) -> Option<&'a SimulatedFlights> {
    let dispersion = |s: &SimulationSummary| s.simulated.dispersion.unwrap_or(0.0);
    let pairs = flown.iter().zip(summaries).filter(|(f, s)| {
        // For independent failures the ratio has a standard deviation of sqrt(2 / flights); the limit is four of
        // these.
        f.prediction.failures.is_some() && dispersion(s) > 1.0 + 4.0 * (2.0 / f64::from(s.runs)).sqrt()
    });
    pairs.max_by(|a, b| dispersion(a.1).total_cmp(&dispersion(b.1))).map(|(f, _)| f)
}

/// A plot of the flights by their number of failures.
fn spread(f: &SimulatedFlights) -> Option<String> {
    let (p, count) = (f.prediction.failure_probability?, f.prediction.absolute_count?);
    let most = f.tallies.iter().map(|t| t.failures).max()?.clamp(1, 60);
    let flights = f.tallies.len() as f64;
    let share = |k: u64| f.tallies.iter().filter(|t| t.failures == k).count() as f64 / flights;
    let shares: Vec<f64> = (0..=most).map(share).collect();
    // Binomial, for the mean number of registrations, which is not whole.
    let mut predicted = vec![(count * (-p).ln_1p()).exp()];
    for k in 0..most {
        let last = predicted.last().copied().unwrap_or(0.0);
        predicted.push(last * (count - k as f64).max(0.0) / (k + 1) as f64 * p / (1.0 - p).max(1e-300));
    }
    let top = shares.iter().chain(&predicted).copied().fold(0.01, f64::max) * 1.15;
    let labels = ["failures of a flight", "share of the flights"];
    Some(plot([-0.6, most as f64 + 0.6, 0.0, top], labels, Some(SeriesLabelPosition::UpperRight), |chart| {
        let bars = shares.iter().enumerate().map(|(k, share)| {
            Rectangle::new([(k as f64 - 0.35, 0.0), (k as f64 + 0.35, *share)], RIGHT.mix(0.6).filled())
        });
        chart
            .draw_series(bars)?
            .label(format!("{}, simulated", name(&f.variation, f.mode)))
            .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], RIGHT.mix(0.6).filled()));
        let dots = predicted.iter().enumerate().map(|(k, share)| Circle::new((k as f64, *share), 4, BOUND.filled()));
        chart
            .draw_series(dots)?
            .label("predicted: each on its own with p")
            .legend(|(x, y)| Circle::new((x + 9, y), 4, BOUND.filled()));
        Ok(())
    }))
}

/// A plot of f(n) of the base, and of the scenarios that differ from it in n alone.
fn optimum(flown: &[SimulatedFlights], summaries: &[SimulationSummary]) -> Option<String> {
    let base = flown.iter().find(|f| f.mode == Mode::Sequential && f.variation == "base")?;
    let alike = |f: &SimulatedFlights| {
        let same_n = f.scenario.sequential.clone();
        let mut base = base.scenario.clone();
        base.sequential = same_n;
        (base.seed, base.runs, base.covariance) = (f.scenario.seed, f.scenario.runs, f.scenario.covariance.clone());
        f.mode == Mode::Sequential && f.scenario == base
    };
    let points: Vec<(f64, BandComparison)> = flown
        .iter()
        .zip(summaries)
        .filter(|(f, _)| alike(f))
        .filter_map(|(f, s)| {
            let comparison = s.comparisons.iter().find(|c| c.what == "failures")?;
            Some(((f.plan.relative_count.max(1) as f64).log10(), *comparison))
        })
        .collect();
    if points.len() < 3 {
        return None;
    }
    let model = Sequential::new(base.scenario.parameters()).ok()?;
    let (first, last) = (points.iter().map(|p| p.0).reduce(f64::min)?, points.iter().map(|p| p.0).reduce(f64::max)?);
    let curve: Vec<(f64, f64)> = (0..=160)
        .map(|k| first - 0.15 + (last - first + 0.3) * f64::from(k) / 160.0)
        .filter_map(|x| Some((x, model.expected_failures(10f64.powf(x), base.plan.mission_s).ok()?)))
        .collect();
    let top = points.iter().flat_map(|p| p.1.band).chain(curve.iter().map(|c| c.1)).fold(0.0, f64::max) * 1.08;
    let best = base.prediction.optimal_relative_count?.log10();
    let labels = ["log10 of n", "failures a flight"];
    Some(plot([first - 0.2, last + 0.2, 0.0, top], labels, None, |chart| {
        chart.draw_series([PathElement::new([(best, 0.0), (best, top)], INK.mix(0.4).stroke_width(1))])?;
        chart.draw_series(LineSeries::new(curve, INK.mix(0.7).stroke_width(2)))?;
        for (x, c) in points {
            let colour = if c.inside { RIGHT } else { FALSE };
            let [from, to] = c.band;
            chart.draw_series([PathElement::new([(x, from), (x, to)], INK.mix(0.6).stroke_width(4))])?;
            chart.draw_series([Circle::new((x, c.simulated), 5, colour.filled())])?;
        }
        Ok(())
    }))
}

/// A plot of the coverage over the mission, scenario by scenario.
fn coverage(summaries: &[SimulationSummary]) -> Option<String> {
    let shown: Vec<_> = summaries.iter().filter_map(|s| Some((s, s.covariance.as_ref()?))).zip(COLOURS).collect();
    let least = shown.iter().flat_map(|((_, c), _)| c.coverage_over_time.iter().flatten()).copied().reduce(f64::min)?;
    let labels = ["share of the mission", "truth in the 95 % ellipse"];
    let bottom = (least - 0.05).clamp(0.0, 0.8);
    Some(plot([0.0, 1.03, bottom, 1.01], labels, Some(SeriesLabelPosition::LowerLeft), |chart| {
        chart.draw_series([PathElement::new([(0.0, 0.95), (1.03, 0.95)], INK.mix(0.6).stroke_width(1))])?;
        for ((s, score), colour) in shown {
            let at = |k: usize| (k + 1) as f64 / CHECKPOINTS as f64;
            let points: Vec<(f64, f64)> =
                score.coverage_over_time.iter().enumerate().filter_map(|(k, c)| Some((at(k), (*c)?))).collect();
            named_line(chart, &name(&s.variation, s.mode), colour, points)?;
        }
        Ok(())
    }))
}
