//! `relative_cost_svgs`: the paper's figures 12 to 15, measured here, with the fitted laws, beside the paper's.

use super::chart::{BOUND, INK, RIGHT, legend, log_mesh, mesh, named_line, svg};
use crate::trial::{DriftBin, PaperFigures, Quantiles, RelativeLaws, RelativeSample};
use overfly_core::coupling::{PixelDriftLaw, RelativeCost};
use plotters::prelude::*;

const KEYPOINTS: RGBColor = RGBColor(120, 90, 190);
const UNCHECKED: RGBColor = RGBColor(150, 150, 150);

/// Plots against descriptors or matches, by name: `loading` (figure 12), `matching` (13), `threshold` (14), `total`
/// (the time of whole registrations (45) and of loading beside the paper's loading), and `drift` (15).
pub fn relative_cost_svgs(laws: &RelativeLaws, samples: &[RelativeSample]) -> Vec<(&'static str, String)> {
    let RelativeCost { seconds_per_descriptor, load_s, pair_comparison_s, threshold_s_per_descriptor, .. } =
        laws.relative;
    let (us_each, load_ms) = (1e6 * seconds_per_descriptor, 1e3 * load_s);
    let loading = StepPlot {
        axis: "loading, ms",
        per_s: 1e3,
        law: format!("A_c N + L = {us_each:.2} us N + {load_ms:.2} ms"),
        time_s: |s| Some(s.times.loading_s),
    };
    let matching = StepPlot {
        axis: "matching, ms",
        per_s: 1e3,
        law: format!("t0 N^2 = {:.2} ns N^2", 1e9 * pair_comparison_s),
        time_s: |s| Some(s.times.matching_s),
    };
    let threshold = StepPlot {
        axis: "thresholding, us",
        per_s: 1e6,
        law: format!("B N = {:.2} ns N", 1e9 * threshold_s_per_descriptor),
        time_s: |s| Some(s.times.threshold_s),
    };
    vec![
        ("loading", loading.svg(laws, samples, &|n| seconds_per_descriptor * n + load_s)),
        ("matching", matching.svg(laws, samples, &|n| pair_comparison_s * n * n)),
        ("threshold", threshold.svg(laws, samples, &|n| threshold_s_per_descriptor * n)),
        ("total", total_svg(laws, samples)),
        ("drift", drift_svg(laws)),
    ]
}

/// A step of registrations, and the labels of its plot.
struct StepPlot {
    axis: &'static str,
    /// Units of the axis in a second.
    per_s: f64,
    law: String,
    time_s: fn(&RelativeSample) -> Option<f64>,
}

/// Mean N of each descriptor limit, and the quantiles of the times in seconds.
fn spreads(
    laws: &RelativeLaws,
    samples: &[RelativeSample],
    time_s: fn(&RelativeSample) -> Option<f64>,
) -> Vec<(f64, Quantiles)> {
    let of_limit = |limit: usize| samples.iter().filter(move |s| s.limit == limit).filter_map(time_s).collect();
    laws.rows.iter().filter_map(|row| Some((row.descriptors, Quantiles::from_values(of_limit(row.limit))?))).collect()
}

const SPREAD_NAME: &str = "median of all pairs, up to 95 % of them";

impl StepPlot {
    /// The medians with their law, on linear axes.
    fn svg(&self, laws: &RelativeLaws, samples: &[RelativeSample], law_s: &dyn Fn(f64) -> f64) -> String {
        let dots: Vec<_> = spreads(laws, samples, self.time_s)
            .into_iter()
            .map(|(n, s)| (n, self.per_s * s.median, self.per_s * s.p95))
            .collect();
        let most = dots.iter().map(|d| d.0).fold(1.0, f64::max) * 1.05;
        let law = |n: f64| (n, self.per_s * law_s(n));
        let high = dots.iter().map(|d| d.1).fold(law(most).1, f64::max) * 1.35;
        svg((720, 340), |area| {
            let mut chart = ChartBuilder::on(area)
                .margin(12)
                .x_label_area_size(46)
                .y_label_area_size(64)
                .build_cartesian_2d(0.0..most, 0.0..high)?;
            mesh(&mut chart, "N, descriptors per image", self.axis)?;
            named_line(&mut chart, &self.law, INK, (0..=20).map(|i| law(most * f64::from(i) / 20.0)))?;
            let bars = dots.iter().map(|&(n, median, p95)| {
                PathElement::new([(n, median), (n, p95.min(high))], RIGHT.mix(0.5).stroke_width(2))
            });
            chart.draw_series(bars)?;
            chart
                .draw_series(dots.iter().map(|&(n, median, _)| Circle::new((n, median), 5, RIGHT.filled())))?
                .label(SPREAD_NAME)
                .legend(|(x, y)| Circle::new((x + 9, y), 5, RIGHT.filled()));
            legend(&mut chart, SeriesLabelPosition::UpperLeft)
        })
    }
}

/// Numbers from `low` to `high`, evenly spaced in the logarithm; few, because points are drawn on whole pixels.
fn decades(low: f64, high: f64) -> impl Iterator<Item = f64> {
    (0..=20).map(move |i| low * (high / low).powf(f64::from(i) / 20.0))
}

/// Whole registrations and loading beside the paper's loading, on logarithmic axes.
fn total_svg(laws: &RelativeLaws, samples: &[RelativeSample]) -> String {
    let (cost, paper) = (laws.relative, PaperFigures::PRINTED);
    let loading_s = |n: f64| cost.seconds_per_descriptor * n + cost.load_s;
    let total_s =
        |n: f64| loading_s(n) + cost.pair_comparison_s * n * n + cost.threshold_s_per_descriptor * n + cost.estimate_s;
    let paper_s = |n: f64| paper.seconds_per_descriptor * n + paper.probable_load_s;
    let dots = spreads(laws, samples, |s| s.times.total_s());
    let most = dots.iter().map(|d| d.0).fold(1.0, f64::max) * 1.3;
    let least = dots.iter().map(|d| d.0).fold(most, f64::min).max(2.0) / 1.3;
    let curve = |law_s: &dyn Fn(f64) -> f64| decades(least, most).map(|n| (n, 1e3 * law_s(n))).collect::<Vec<_>>();
    let curves = [
        ("the paper's loading alone, A_c N + L (L as 9 ms)", BOUND, curve(&paper_s)),
        ("this machine: T_exe (45)", INK, curve(&total_s)),
        ("this machine: loading alone (42)", KEYPOINTS, curve(&loading_s)),
    ];
    let low = 1e3 * loading_s(least).min(1e3) / 1.6;
    let high = 1e3 * paper_s(most).max(total_s(most)) * 12.0;
    svg((720, 380), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d((least..most).log_scale(), (low.max(1e-3)..high).log_scale())?;
        log_mesh(&mut chart, "N, descriptors per image", "time, ms")?;
        for (name, colour, points) in curves {
            named_line(&mut chart, name, colour, points)?;
        }
        let bars = dots.iter().map(|(n, s)| {
            PathElement::new([(*n, 1e3 * s.median), (*n, (1e3 * s.p95).min(high))], RIGHT.mix(0.5).stroke_width(2))
        });
        chart.draw_series(bars)?;
        chart
            .draw_series(dots.iter().map(|(n, s)| Circle::new((*n, 1e3 * s.median), 5, RIGHT.filled())))?
            .label("this machine: median of all pairs, up to 95 % of them")
            .legend(|(x, y)| Circle::new((x + 9, y), 5, RIGHT.filled()));
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}

/// Least drift that is drawn, pixels: zero has no logarithm.
const LEAST_DRIFT_PX: f64 = 1e-4;

/// Drift against matches of the three estimators and of the paper, on logarithmic axes.
fn drift_svg(laws: &RelativeLaws) -> String {
    let paper = PaperFigures::PRINTED;
    let dots = |bins: &[DriftBin]| -> Vec<(f64, f64, f64)> {
        bins.iter().map(|b| (b.matches, b.rms_px.max(LEAST_DRIFT_PX), b.drift_px.max.max(LEAST_DRIFT_PX))).collect()
    };
    let series = [
        (
            "keypoints alone, every pair, chance agreements included",
            UNCHECKED,
            dots(&laws.keypoints_unchecked.bins),
            None,
        ),
        ("keypoints alone, registered pairs", KEYPOINTS, dots(&laws.keypoints.bins), laws.keypoints.law),
        ("as the program registers", RIGHT, dots(&laws.program.bins), laws.program.law),
    ];
    let all = || series.iter().flat_map(|s| &s.2);
    let most = all().map(|d| d.0).fold(paper.matches_needed, f64::max) * 1.5;
    let high = all().map(|d| d.2).fold(paper.drift_law.drift_px(1.0), f64::max) * 40.0;
    let low = all().map(|d| d.1).fold(paper.drift_px, f64::min) / 2.0;
    svg((720, 520), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d((1.0..most).log_scale(), (low..high).log_scale())?;
        log_mesh(&mut chart, "n, matches that agree", "drift, px")?;
        let law = |law: PixelDriftLaw| decades(1.0, most).map(move |n| (n, law.drift_px(n).max(low)));
        named_line(&mut chart, "the paper: 1 / sqrt(n) through 1 m at 600 matches", BOUND, law(paper.drift_law))?;
        let point = (paper.matches_needed, paper.drift_px);
        chart.draw_series([Cross::new(point, 7, BOUND.stroke_width(3))])?;
        let bound = [(1.0, paper.drift_px), (most, paper.drift_px)];
        chart.draw_series(DashedLineSeries::new(bound, 6, 5, INK.mix(0.5).stroke_width(1)))?;
        for (name, colour, dots, fitted) in series {
            let bars = dots.iter().map(|d| PathElement::new([(d.0, d.1), (d.0, d.2)], colour.mix(0.4).stroke_width(2)));
            chart.draw_series(bars)?;
            if let Some(fitted) = fitted {
                chart.draw_series(LineSeries::new(law(fitted), colour.stroke_width(2)))?;
            }
            chart
                .draw_series(dots.iter().map(|d| Circle::new((d.0, d.1), 5, colour.filled())))?
                .label(name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 5, colour.filled()));
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}
