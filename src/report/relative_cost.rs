//! `relative_cost_svgs`: the paper's figures 12 to 15, measured here, with the fitted models.

use super::plot::{BOUND, INK, RIGHT, mesh, svg};
use crate::trial::{Calibrated, CalibrationRow};
use plotters::prelude::*;

/// Plots against descriptors or matches, by name: `loading` (figure 12), `matching` (13), `threshold` (14), `drift` (15).
pub fn relative_cost_svgs(found: &Calibrated) -> Vec<(&'static str, String)> {
    let r = found.calibration.relative;
    let times = |name, model: &dyn Fn(f64) -> f64, of: fn(&CalibrationRow) -> f64| {
        let dots: Vec<_> = found.rows.iter().map(|row| (row.descriptors, 1e3 * of(row))).collect();
        times_svg(&format!("{name}, ms"), &dots, &|n| 1e3 * model(n))
    };
    vec![
        ("loading", times("loading", &|n| r.seconds_per_descriptor * n + r.load_s, |row| row.loading_s)),
        ("matching", times("matching", &|n| r.pair_comparison_s * n * n, |row| row.matching_s)),
        ("threshold", times("thresholding", &|n| r.threshold_s_per_descriptor * n, |row| row.threshold_s)),
        ("drift", drift_svg(found)),
    ]
}

fn times_svg(name: &str, dots: &[(f64, f64)], model: &dyn Fn(f64) -> f64) -> String {
    let most = dots.iter().map(|d| d.0).fold(1.0, f64::max) * 1.05;
    let high = dots.iter().map(|d| d.1).fold(1e-3, f64::max).max(model(most)) * 1.1;
    svg((720, 320), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..most, 0.0..high)?;
        mesh(&mut chart, "descriptors per image", name)?;
        let line = (0..=60).map(|i| most * f64::from(i) / 60.0).map(|n| (n, model(n)));
        chart.draw_series(LineSeries::new(line, INK.mix(0.7).stroke_width(2)))?;
        chart.draw_series(dots.iter().map(|&d| Circle::new(d, 5, RIGHT.filled())))?;
        Ok(())
    })
}

fn drift_svg(found: &Calibrated) -> String {
    let log = |v: f64| v.max(1e-6).log10();
    let dots: Vec<_> = found.drift_by_matches.iter().map(|&[n, drift]| (log(n), log(drift))).collect();
    let d = found.calibration.drift;
    let keypoints = found.keypoint_drift;
    let most = dots.iter().map(|d| d.0).fold(1.0, f64::max) + 0.1;
    let at = |pair: f64, floor: f64, x: f64| log(floor.hypot(pair / 10f64.powf(x / 2.0)));
    let high = at(keypoints.pair_drift_px, keypoints.floor_px, 0.0).max(at(d.pair_drift_px, d.floor_px, 0.0)) + 0.2;
    let low = dots.iter().map(|d| d.1).fold(at(d.pair_drift_px, d.floor_px, most), f64::min) - 0.3;
    svg((720, 420), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..most, low..high)?;
        mesh(&mut chart, "log10 of matches that agree", "log10 of drift, px")?;
        let lines = [
            ("as the program registers", d.pair_drift_px, d.floor_px, INK),
            ("keypoints alone, as the paper does", keypoints.pair_drift_px, keypoints.floor_px, BOUND),
        ];
        for (name, pair, floor, colour) in lines {
            let line = (0..=60).map(|i| most * f64::from(i) / 60.0).map(|x| (x, at(pair, floor, x)));
            chart
                .draw_series(LineSeries::new(line, colour.mix(0.8).stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
        chart.draw_series(dots.iter().map(|&d| Circle::new(d, 5, RIGHT.filled())))?;
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font(("sans-serif", 14).into_font().color(&INK))
            .border_style(INK.mix(0.2))
            .draw()
    })
}
