//! The page of a flown flight: its track over the map and its registrations, mode by mode.

use super::flown_plots::{chronogram, errors, tiles};
use super::map::{half_axes_of_m, long_axis_of_deg};
use super::{Mosaic, data_url, escaped};
use crate::trial::{FlyOutcome, FlyScore};
use overfly_flight::navigate::ExecutionTimes;
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");
const WIDTH_PX: usize = 1200;

/// One mode's flight.
pub struct Flown<'a> {
    /// What came of each image.
    pub outcomes: &'a [FlyOutcome],
    /// Its score.
    pub score: &'a FlyScore,
    /// Execution times.
    pub execution_times: ExecutionTimes,
}

/// The page. Every image and plot is embedded; nothing is loaded from anywhere.
pub fn flown_page(title: &str, mosaic: &Mosaic, modes: &[Flown]) -> String {
    let (picture, factor) = mosaic.shrunk(WIDTH_PX);
    let size = (picture.width_px(), picture.height_px());
    let background = data_url(&picture, 78);
    let sections: String =
        modes.iter().map(|flown| section(flown, &track(flown, mosaic, factor as f64, size, &background))).collect();
    let title = escaped(title);
    format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{STYLE}</style></head>
<body><main><header><h1>{title}</h1><p>Every position comes from images, compass and altimeter alone, in a closed loop; truth starts the flight and scores it. White and dashed is the true track, green a position with a fix of its own image, violet one that was carried forward. Ellipses hold 95&nbsp;%.</p></header>
{sections}</main></body></html>
"#
    )
}

fn section(flown: &Flown, map: &str) -> String {
    let score = flown.score;
    let number = |v: Option<f64>, digits: usize, unit: &str| {
        v.map_or_else(|| "none".to_owned(), |v| format!("{v:.digits$}<small>{unit}</small>"))
    };
    let cards = [
        (number(score.position_error_m.map(|e| e.median), 1, "m"), "median error of all positions"),
        (number(score.position_error_m.map(|e| e.p95), 1, "m"), "error, 95 % below"),
        (number(score.dead_reckoning_error_m.map(|e| e.max), 1, "m"), "dead reckoning, at most"),
        (number(score.ellipse95_coverage.map(|c| 100.0 * c), 0, "%"), "truths inside the stated 95 % ellipse"),
        (format!("{}<small>of {}</small>", score.fixes, score.absolute_count), "absolute registrations with a fix"),
        (score.wrong.to_string(), "of them false"),
    ];
    let cards: String = cards
        .iter()
        .map(|(value, name)| format!(r#"<div class="card"><b>{value}</b><span>{name}</span></div>"#))
        .collect();
    format!(
        r#"<section><h2>{mode}</h2><div class="cards">{cards}</div>{map}
<figure>{errors}<figcaption>Error of each position, and three of its own standard deviations (band).</figcaption></figure>
<figure>{tiles}<figcaption>Tiles that each absolute registration searched (bars), and the nominal count of the model (dots).</figcaption></figure>
<figure>{chronogram}<figcaption>When relative (RR) and absolute (AR) registrations ran; hollow: no fix. Short ones are drawn longer than they are.</figcaption></figure></section>
"#,
        mode = score.mode.word(),
        errors = errors(flown),
        tiles = tiles(flown),
        chronogram = chronogram(flown),
    )
}

/// The map of one mode: the true track, the positions and their ellipses.
fn track(flown: &Flown, mosaic: &Mosaic, factor: f64, (width, height): (usize, usize), background: &str) -> String {
    let at = |point| mosaic.pixel_of(point).map(|p: [f64; 2]| p.map(|v| v / factor));
    let truths: Vec<String> =
        flown.outcomes.iter().filter_map(|o| at(o.truth)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let truths = truths.join(" ");
    let mut svg = format!(
        r#"<svg class="map" viewBox="0 0 {width} {height}" role="img" aria-label="map of the flight"><image width="{width}" height="{height}" href="{background}"/><polyline class="track-edge" points="{truths}"/><polyline class="track" points="{truths}"/>"#
    );
    for o in flown.outcomes {
        let Some([x, y]) = at(o.position.position) else { continue };
        let [east, north] = mosaic.pixels_per_m(o.truth);
        let scale = (east * north).sqrt() / factor;
        let [long, short] = half_axes_of_m(&o.position.covariance_m2).map(|a| (a * scale).min(2.0 * width as f64));
        let turn_deg = long_axis_of_deg(&o.position.covariance_m2);
        let colour = if o.position.fix_age_s == Some(0.0) { "#169688" } else { "#785abe" };
        let _ = write!(
            svg,
            r##"<ellipse cx="{x:.1}" cy="{y:.1}" rx="{long:.1}" ry="{short:.1}" transform="rotate({turn_deg:.1} {x:.1} {y:.1})" fill="{colour}" fill-opacity="0.12" stroke="{colour}"/><circle cx="{x:.1}" cy="{y:.1}" r="4" fill="{colour}" stroke="#fff"><title>{}: {:.1} m off</title></circle>"##,
            escaped(&o.image),
            o.error.length_m(),
        );
    }
    svg.push_str("</svg>");
    svg
}
