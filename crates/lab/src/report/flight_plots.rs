//! Plots of located frames: errors in the plane and over time, and durations.

use super::chart::{BOUND, FALSE, INK, RIGHT, linear_chart, mesh, svg, time_range, top_of};
use super::flight_report::{FlightReport, fix_of};
use overfly_core::geodesy::ErrorEllipse;
use overfly_flight::locate::Fix;
use plotters::prelude::*;

/// The 95 % ellipse of a fix.
fn ellipse_95(fix: &Fix) -> ErrorEllipse {
    fix.covariance.ellipse_95()
}

/// A plot of the error of every fix, east and north, each with its own 95 % ellipse, which should contain the cross.
pub fn error_plane(report: &FlightReport) -> String {
    let fixes: Vec<_> = report.outcomes.iter().filter_map(|o| Some((fix_of(o)?, o.error?))).collect();
    let mut reach: Vec<f64> = fixes.iter().map(|(f, e)| e.length_m() + ellipse_95(f).semi_major_m).collect();
    reach.sort_by(f64::total_cmp);
    // A distant false fix would shrink all others to a dot: the plot leaves such fixes out, the text counts them.
    let limit = reach.get(reach.len() * 9 / 10).copied().unwrap_or(1.0).max(0.1) * 1.15;
    svg((520, 520), |area| {
        let mut chart = linear_chart(area, -limit..limit, -limit..limit)?;
        mesh(&mut chart, "east, m", "north, m")?;
        for (fix, error) in &fixes {
            let colour = if error.length_m() > report.score.right_m { FALSE } else { RIGHT };
            let around = ellipse_95(fix).outline(48).map(|o| (error.east_m + o.east_m, error.north_m + o.north_m));
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

/// A plot of the error of every fix over time, and of the semi-major axis of its own 95 % ellipse.
pub fn error_in_time(report: &FlightReport) -> String {
    let fixes: Vec<_> = times_s(report)
        .zip(report.outcomes)
        .filter_map(|(t, o)| Some((t, o.error?.length_m(), ellipse_95(fix_of(o)?).semi_major_m)))
        .collect();
    let top = top_of(fixes.iter().flat_map(|f| [f.1, f.2]));
    svg((720, 300), |area| {
        let mut chart = linear_chart(area, time_range(times_s(report)), 0.0..top)?;
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

/// A plot of the duration of every search over time.
pub fn elapsed_in_time(report: &FlightReport) -> String {
    let top = report.outcomes.iter().map(|o| o.elapsed_ms).fold(1.0, f64::max) * 1.15;
    let width = (time_range(times_s(report)).end - time_range(times_s(report)).start)
        / report.outcomes.len().max(1) as f64
        * 0.32;
    svg((720, 240), |area| {
        let mut chart = linear_chart(area, time_range(times_s(report)), 0.0..top)?;
        mesh(&mut chart, "time, s", "search, ms")?;
        chart.draw_series(
            times_s(report)
                .zip(report.outcomes)
                .map(|(t, o)| Rectangle::new([(t - width, 0.0), (t + width, o.elapsed_ms)], RIGHT.mix(0.7).filled())),
        )?;
        Ok(())
    })
}

fn times_s<'a>(report: &'a FlightReport) -> impl Iterator<Item = f64> + 'a {
    report.flight.frames.iter().map(|f| f.time_s)
}
