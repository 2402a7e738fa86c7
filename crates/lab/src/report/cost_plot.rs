//! `cost_svg`: search times against tiles, on logarithmic axes, and the fitted line.

use super::chart::{BOUND, INK, RIGHT, legend, mesh, named_line, svg};
use crate::trial::Cost;
use plotters::prelude::*;

/// A plot of the median time of each area (with the 95th percentile) and of t = constant + K1 tiles.
pub fn cost_svg(cost: &Cost) -> String {
    let log = |v: f64| v.max(1e-3).log10();
    let most_tiles = cost.steps.iter().map(|s| s.tiles).fold(1.0, f64::max);
    let times = || cost.steps.iter().flat_map(|s| [s.elapsed_ms.median, s.elapsed_ms.p95, s.first_ms]);
    let (low, high) = (times().fold(1e6, f64::min).min(1e3), times().fold(1.0, f64::max));
    svg((720, 420), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(-0.1..log(most_tiles) + 0.1, log(low) - 0.3..log(high) + 0.2)?;
        mesh(&mut chart, "log10 of tiles searched", "log10 of milliseconds")?;
        let at = |tiles: f64| 1e3 * (cost.constant_s + cost.seconds_per_tile * tiles);
        let line = (0..=60).map(|i| {
            let x = log(most_tiles) * f64::from(i) / 60.0;
            (x, log(at(10f64.powf(x))).max(log(low) - 0.3))
        });
        let name = format!("{:.1} ms + {:.3} ms a tile", 1e3 * cost.constant_s, 1e3 * cost.seconds_per_tile);
        named_line(&mut chart, &name, INK, line)?;
        let spread = cost.steps.iter().map(|s| {
            let ends = [(log(s.tiles), log(s.elapsed_ms.median)), (log(s.tiles), log(s.elapsed_ms.p95))];
            PathElement::new(ends, RIGHT.mix(0.5).stroke_width(2))
        });
        chart.draw_series(spread)?;
        let dots = cost.steps.iter().map(|s| Circle::new((log(s.tiles), log(s.elapsed_ms.median)), 5, RIGHT.filled()));
        chart
            .draw_series(dots)?
            .label("median, up to 95 %")
            .legend(|(x, y)| Circle::new((x + 9, y), 5, RIGHT.filled()));
        let first = cost.steps.iter().map(|s| Circle::new((log(s.tiles), log(s.first_ms)), 4, BOUND.stroke_width(2)));
        chart
            .draw_series(first)?
            .label("the first search of an area")
            .legend(|(x, y)| Circle::new((x + 9, y), 4, BOUND.stroke_width(2)));
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}
