//! Plots of a replayed flight: errors over time, tiles searched, and the chronogram of registrations.

use super::chart::{BOUND, Drawn, INK, LinearChart, RIGHT, linear_chart, mesh, mesh_named, svg, time_range, top_of};
use super::replayed_flight::ReplayedFlight;
use crate::trial::FlyOutcome;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const PROPAGATED: RGBColor = RGBColor(120, 90, 190);

/// A plot of the error of every position, and of three of its own standard deviations along the long axis.
pub fn errors(flown: &ReplayedFlight) -> String {
    let sigma_m = |o: &FlyOutcome| 3.0 * o.position.covariance.ellipse().semi_major_m;
    let top = top_of(flown.outcomes.iter().flat_map(|o| [o.error.length_m(), sigma_m(o)]));
    svg((720, 300), |area| {
        let mut chart = linear_chart(area, span(flown), 0.0..top)?;
        mesh(&mut chart, "time, s", "error, m")?;
        let band = flown.outcomes.iter().map(|o| (o.position.time_s, sigma_m(o).min(top)));
        chart.draw_series(AreaSeries::new(band, 0.0, BOUND.mix(0.25)))?;
        for o in flown.outcomes {
            let colour = if o.position.fix_age_s == Some(0.0) { RIGHT } else { PROPAGATED };
            let at = (o.position.time_s, o.error.length_m().min(top));
            chart.draw_series([Circle::new(at, 4, colour.filled())])?;
        }
        Ok(())
    })
}

/// A plot of the tiles that each absolute registration searched (bars), and of 𝒩 by the model (dots), on a
/// logarithmic axis.
pub fn tiles(flown: &ReplayedFlight) -> String {
    let searched: Vec<_> = flown.outcomes.iter().filter(|o| o.position.absolute_count > 0).collect();
    let level = |v: f64| v.max(1.0).log10();
    let top = searched.iter().map(|o| level(o.position.tiles_searched as f64).max(level(o.position.nominal_count)));
    let top = top.fold(1.0, f64::max) * 1.1;
    let width = (span(flown).end - span(flown).start) / flown.outcomes.len().max(1) as f64 * 0.3;
    svg((720, 220), |area| {
        let mut chart = linear_chart(area, span(flown), 0.0..top)?;
        mesh_named(&mut chart, "time, s", "tiles", &|level| {
            format!("{:.1}", 10f64.powf(*level)).trim_end_matches(".0").to_owned()
        })?;
        for o in searched {
            let (t, p) = (o.position.time_s, &o.position);
            let bar = [(t - width, 0.0), (t + width, level(p.tiles_searched as f64))];
            chart.draw_series([Rectangle::new(bar, RIGHT.mix(0.5).filled())])?;
            chart.draw_series([Circle::new((t, level(p.nominal_count)), 3, BOUND.filled())])?;
        }
        Ok(())
    })
}

/// A plot of the times of registrations, as in figure 3 of the paper: relative ones below, absolute ones above,
/// filled if they have a fix.
pub fn chronogram(flown: &ReplayedFlight) -> String {
    let least_s = (span(flown).end - span(flown).start) / 300.0;
    svg((720, 130), |area| {
        let mut chart = linear_chart(area, span(flown), 0.0..2.2)?;
        let style = ("sans-serif", 14).into_font().color(&INK);
        let mut axes = chart.configure_mesh();
        axes.disable_mesh().disable_y_axis().x_desc("time, s").axis_style(INK.mix(0.6));
        axes.axis_desc_style(style.clone()).label_style(style.clone()).draw()?;
        for o in flown.outcomes {
            draw_registrations(&mut chart, flown, o, least_s)?;
        }
        let beside = style.pos(Pos::new(HPos::Right, VPos::Center));
        for (name, y) in [("RR  ", 0.55), ("AR  ", 1.65)] {
            chart.draw_series([Text::new(name, (span(flown).start, y), beside.clone())])?;
        }
        Ok(())
    })
}

fn draw_registrations(chart: &mut LinearChart, flown: &ReplayedFlight, o: &FlyOutcome, least_s: f64) -> Drawn {
    let (t, p) = (o.position.time_s, &o.position);
    if p.relative_count > 0 {
        let end = t + flown.execution_times.relative_s.max(least_s);
        chart.draw_series([Rectangle::new([(t, 0.1), (end, 0.9)], PROPAGATED.mix(0.8).filled())])?;
    }
    if p.absolute_count > 0 {
        let end = t + flown.execution_times.absolute_s(p.tiles_searched).max(least_s);
        let style = if p.fix.is_some() { RIGHT.mix(0.8).filled() } else { RIGHT.stroke_width(1) };
        chart.draw_series([Rectangle::new([(t, 1.2), (end, 2.0)], style)])?;
    }
    Ok(())
}

fn span(flown: &ReplayedFlight) -> std::ops::Range<f64> {
    time_range(flown.outcomes.iter().map(|o| o.position.time_s))
}
