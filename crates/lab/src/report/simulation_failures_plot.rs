//! `failures`: simulated failures over predicted ones, scenario by scenario.

use super::chart::{BOUND, FALSE, INK, RIGHT, svg};
use crate::trial::simulation::SimulationSummary;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The figures of a scenario over the failures that (11) predicts.
struct FailureRow {
    name: String,
    simulated: f64,
    band: [f64; 2],
    inside: bool,
    printed: Option<f64>,
    adjusted: Option<f64>,
}

/// Beyond this ratio, or its inverse, the axis is logarithmic.
const NEAR: f64 = 2.5;

/// The plot; `None` if no failures were predicted.
pub(super) fn failures(summaries: &[SimulationSummary]) -> Option<String> {
    let rows: Vec<FailureRow> = summaries.iter().filter_map(row).collect();
    let values = || rows.iter().flat_map(|r| [Some(r.simulated), r.printed, r.adjusted]).flatten();
    let ends = || values().chain(rows.iter().flat_map(|r| r.band)).filter(|v| *v > 0.0);
    let (least, most) = (ends().reduce(f64::min)?.min(0.9), ends().reduce(f64::max)?.max(1.1));
    let is_near = most < NEAR && least > 1.0 / NEAR;
    let at = |ratio: f64| if is_near { ratio } else { ratio.max(least).log10() };
    let air = (at(most) - at(least)) * 0.04;
    let count = rows.len() as f64;
    let height_px = 90 + 19 * rows.len() as u32;
    Some(svg((1200, height_px), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(360)
            .build_cartesian_2d(at(least) - air..at(most) + air, -0.6..count - 0.4)?;
        let text = ("sans-serif", 14).into_font().color(&INK);
        let mut axes = chart.configure_mesh();
        axes.disable_y_mesh().y_labels(0).bold_line_style(INK.mix(0.14)).light_line_style(TRANSPARENT);
        let title = if is_near {
            "failures a flight, over the model's"
        } else {
            "log10 of failures a flight, over the model's"
        };
        axes.x_desc(title).axis_style(INK.mix(0.6)).axis_desc_style(text.clone()).label_style(text.clone()).draw()?;
        let names = text.pos(Pos::new(HPos::Right, VPos::Center));
        chart.draw_series([PathElement::new([(at(1.0), -0.6), (at(1.0), count - 0.4)], INK.mix(0.4))])?;
        for (k, row) in rows.iter().enumerate() {
            let y = count - 1.0 - k as f64;
            chart.draw_series([Text::new(row.name.clone(), (at(least) - 1.5 * air, y), names.clone())])?;
            let [from, to] = row.band.map(at);
            chart.draw_series([Rectangle::new([(from, y - 0.28), (to, y + 0.28)], INK.mix(0.22).filled())])?;
            let colour = if row.inside { RIGHT } else { FALSE };
            chart.draw_series(row.printed.map(|v| Cross::new((at(v), y), 5, INK.stroke_width(2))))?;
            chart.draw_series(row.adjusted.map(|v| Circle::new((at(v), y), 7, BOUND.stroke_width(2))))?;
            chart.draw_series([Circle::new((at(row.simulated), y), 4, colour.filled())])?;
        }
        Ok(())
    }))
}

fn row(s: &SimulationSummary) -> Option<FailureRow> {
    let model = s.predicted.failures.filter(|f| *f > 0.0)?;
    let comparison = s.comparisons.iter().find(|c| c.what == "failures")?;
    Some(FailureRow {
        name: format!("{}, {}", s.variation, s.mode.word()),
        simulated: comparison.simulated / model,
        band: comparison.band.map(|b| b / model),
        inside: comparison.inside,
        printed: s.predicted.failures_printed.map(|f| f / model),
        adjusted: s.adjusted.and_then(|a| a.failures).map(|f| f / model),
    })
}
