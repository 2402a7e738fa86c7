//! `stanford_svg`: protection levels against true errors, on logarithmic axes.
//!
//! # References
//! Tossaint et al., The Stanford-ESA integrity diagram (2007).

use super::chart::{BOUND, FALSE, INK, RIGHT, legend, mesh, named_line, svg};
use crate::trial::ProtectedError;
use plotters::prelude::*;

/// Errors and levels below this are drawn there, metres.
const LEAST_M: f64 = 0.1;

/// A plot of error against protection level, a dot for each position that has one. What lies above its level is misleading information.
pub fn stanford_svg(errors: &[ProtectedError], alert_limit_m: Option<f64>) -> String {
    let dots: Vec<(f64, f64, bool)> = errors
        .iter()
        .filter_map(|error| Some((error.error_m, error.protection_level_m?, error.is_misleading())))
        .map(|(error_m, level_m, is_misleading)| (log(error_m), log(level_m), is_misleading))
        .collect();
    let most = dots.iter().map(|(error, level, _)| error.max(*level)).fold(2.0, f64::max) + 0.1;
    let least = log(LEAST_M);
    svg((720, 520), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(least..most, least..most)?;
        mesh(&mut chart, "error: log10 of metres", "protection level: log10 of metres")?;
        named_line(&mut chart, "error = protection level; below: misleading", INK, [(least, least), (most, most)])?;
        if let Some(limit_m) = alert_limit_m {
            named_line(&mut chart, "alert limit", BOUND, [(least, log(limit_m)), (most, log(limit_m))])?;
        }
        for (name, colour, misleading) in [("protected", RIGHT, false), ("misleading", FALSE, true)] {
            let these = dots.iter().filter(|dot| dot.2 == misleading);
            let circles = these.map(|(x, y, _)| Circle::new((*x, *y), 3, colour.mix(0.6).filled()));
            chart
                .draw_series(circles)?
                .label(format!("{name}: {}", dots.iter().filter(|dot| dot.2 == misleading).count()))
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
        }
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}

fn log(metres: f64) -> f64 {
    metres.max(LEAST_M).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_nothing_and_what_is_beyond_all_scales() {
        let error = |error_m, protection_level_m| ProtectedError { error_m, protection_level_m };
        for errors in [vec![], vec![error(0.0, Some(0.0)), error(1e6, Some(3.0)), error(5.0, None)]] {
            let plot = stanford_svg(&errors, Some(50.0));
            assert!(plot.starts_with("<svg ") && plot.trim_end().ends_with("</svg>"));
        }
    }
}
