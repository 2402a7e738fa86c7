//! `calibration_svg`: stated false alarms against observed ones, on logarithmic axes.

use super::chart::{INK, legend, mesh, named_line, svg};
use crate::trial::{CalibrationStep, NegativeScore};
use plotters::prelude::*;

const COLOURS: [RGBColor; 5] = [
    RGBColor(22, 150, 136),
    RGBColor(214, 140, 30),
    RGBColor(120, 90, 190),
    RGBColor(60, 130, 220),
    RGBColor(200, 70, 110),
];

/// A plot of the share of negatives that stated fewer false alarms than 10^x, a line per size of region with its 95 %
/// bounds, and the line that no share may cross.
pub fn calibration_svg(score: &NegativeScore) -> String {
    let deepest = score.calibration.last().map_or(-8.0, |c| f64::from(c.log10_false_alarms));
    svg((720, 520), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(deepest - 0.3..-0.7, deepest..0.0)?;
        mesh(&mut chart, "stated: log10 of the false alarms, below", "observed: log10 of the share of negatives")?;
        let diagonal = [(deepest - 0.3, deepest - 0.3), (-0.7, -0.7)].map(|(x, y): (f64, f64)| (x, y.max(deepest)));
        named_line(&mut chart, "greatest share allowed; bars: 95 % bounds", INK, diagonal)?;
        for (i, region) in score.by_region.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            // Side by side, so that bounds do not hide each other.
            let shift = 0.08 * (i as f64 - (score.by_region.len() as f64 - 1.0) / 2.0);
            let at = |c: &CalibrationStep| f64::from(c.log10_false_alarms) + shift;
            let level = |rate: f64| if rate > 0.0 { rate.log10().clamp(deepest, 0.0) } else { deepest };
            let bounds = region.calibration.iter().map(|c| {
                let ends = [(at(c), level(c.rate_lower95)), (at(c), level(c.rate_upper95))];
                PathElement::new(ends, colour.mix(0.45).stroke_width(2))
            });
            chart.draw_series(bounds)?;
            let seen = region.calibration.iter().filter(|c| c.observed > 0);
            let dots = seen.map(|c| {
                let share = c.observed as f64 / region.trials.max(1) as f64;
                Circle::new((at(c), level(share)), 4, colour.filled())
            });
            chart
                .draw_series(dots)?
                .label(format!("area {} of the usual, {} trials", region.region, region.trials))
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
        }
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_an_empty_score_too() {
        let plot = calibration_svg(&NegativeScore::from_outcomes(&[], 1));
        assert!(plot.starts_with("<svg ") && plot.trim_end().ends_with("</svg>"));
    }
}
