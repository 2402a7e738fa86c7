//! `plan_html`: the plan as one page that loads nothing: words, map of the route, plots.

use super::plan_plot::plan_svgs;
use super::{Mosaic, data_url, escaped};
use overfly_core::geodesy::Geodetic;
use overfly_ingest::plan::{Forecast, RouteForecast, RouteStep};
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");
const WIDTH_PX: usize = 1200;

/// The page. `text` is what the command prints; the map under the route where it is given.
pub fn plan_html(forecast: &Forecast, text: &str, route: Option<(&RouteForecast, Option<&Mosaic>)>) -> String {
    let map = route.map_or(String::new(), |(route, mosaic)| route_map(route, mosaic));
    let plots: String = plan_svgs(forecast).into_iter().map(|(_, plot)| format!("<figure>{plot}</figure>")).collect();
    format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>overfly: plan</title><style>{STYLE}</style></head>
<body><main><header><h1>Plan</h1><p>{}</p></header>{map}<section><h2>Figures</h2><pre>{}</pre></section>
<section><h2>Plots</h2><div class="plots">{plots}</div></section></main></body></html>
"#,
        escaped(&forecast.advice.why),
        escaped(text)
    )
}

fn route_map(route: &RouteForecast, mosaic: Option<&Mosaic>) -> String {
    let picture = mosaic.map(|m| (m, m.shrunk(WIDTH_PX)));
    let place = |s: &RouteStep| -> Option<[f64; 2]> {
        match &picture {
            Some((mosaic, (_, factor))) => {
                let at = Geodetic::from_degrees(s.latitude_deg, s.longitude_deg).ok()?;
                mosaic.pixel_of(at).map(|p| p.map(|v| v / *factor as f64))
            }
            None => plain(route, s),
        }
    };
    let (width, height) =
        picture.as_ref().map_or((WIDTH_PX, 600), |(_, (small, _))| (small.width_px(), small.height_px()));
    let [left, top, right, bottom] = frame(route.steps.iter().filter_map(&place), width as f64, height as f64);
    let mut svg = format!(
        r#"<section><h2>Route</h2><p class="legend"><span class="key right"></span>a fix is expected <span class="key false"></span>none is</p><svg class="map" viewBox="{left:.0} {top:.0} {:.0} {:.0}" role="img" aria-label="map of the route">"#,
        right - left,
        bottom - top
    );
    if let Some((_, (small, _))) = &picture {
        let _ = write!(svg, r#"<image width="{width}" height="{height}" href="{}"/>"#, data_url(small, 78));
    }
    for s in &route.steps {
        let Some([x, y]) = place(s) else { continue };
        let class = if s.fix_expected { "right" } else { "false" };
        let _ = write!(
            svg,
            r#"<circle class="fix {class}" cx="{x:.1}" cy="{y:.1}" r="6"><title>{:.0} m: map {:.0} %, {:.0} keypoints, distinctiveness {:.2}, {:.2} s a search</title></circle>"#,
            s.way_m,
            100.0 * s.covered,
            s.keypoints,
            s.distinctiveness,
            s.execution_s
        );
    }
    svg.push_str("</svg></section>");
    svg
}

/// The picture and all of the route: left, top, right, bottom. A route that leads further away than five pictures is cut.
fn frame(points: impl Iterator<Item = [f64; 2]>, width: f64, height: f64) -> [f64; 4] {
    let most = 5.0 * width.max(height);
    points.fold([0.0, 0.0, width, height], |[l, t, r, b], [x, y]| {
        let (x, y) = (x.clamp(-most, most), y.clamp(-most, most));
        [l.min(x - 20.0), t.min(y - 20.0), r.max(x + 20.0), b.max(y + 20.0)]
    })
}

/// Without a picture: longitude and latitude filling the frame.
fn plain(route: &RouteForecast, s: &RouteStep) -> Option<[f64; 2]> {
    let scaled = |of: fn(&RouteStep) -> f64, room: f64| {
        let (low, high) =
            route.steps.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        30.0 + room * (of(s) - low) / (high - low).max(1e-9)
    };
    Some([scaled(|s| s.longitude_deg, 1140.0), 600.0 - scaled(|s| s.latitude_deg, 540.0)])
}
