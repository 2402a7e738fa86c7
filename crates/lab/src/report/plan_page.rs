//! `plan_html`: the plan as one page: text, map of the route, plots.

use super::data_url::data_url;
use super::html::Page;
use super::mosaic::Mosaic;
use super::plan_plot::plan_svgs;
use maud::{Markup, PreEscaped, html};
use overfly_core::geodesy::Geodetic;
use overfly_ingest::plan::{Forecast, RouteForecast, RouteStep};

const WIDTH_PX: usize = 1200;
const HEIGHT_WITHOUT_MAP_PX: usize = 600;

/// The page. `text` is what the command prints; a mosaic, where given, lies under the route.
pub fn plan_html(forecast: &Forecast, text: &str, route: Option<(&RouteForecast, Option<&Mosaic>)>) -> String {
    let body = html! {
        @if let Some((route, mosaic)) = route { (route_map(route, mosaic)) }
        section { h2 { "Figures" } pre { @for line in text.lines() { (figures_line(line)) } } }
        section {
            h2 { "Plots" }
            div class="plots" { @for (_, plot) in plan_svgs(forecast) { figure { (PreEscaped(plot)) } } }
        }
    };
    let introduction = html! { (forecast.verdict(route.map(|(route, _)| route))) };
    Page { title: "overfly: plan", heading: "Plan", introduction, body, script: "" }.into_html()
}

/// Longest line of a table, characters; what is longer is a sentence, and wraps.
const TABLE_CHARS: usize = 108;

fn figures_line(line: &str) -> Markup {
    let is_sentence = line.chars().count() > TABLE_CHARS;
    html! { @if is_sentence { span class="sentence" { (line) } } @else { (line) "\n" } }
}

fn route_map(route: &RouteForecast, mosaic: Option<&Mosaic>) -> Markup {
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
    let (width, height) = picture
        .as_ref()
        .map_or((WIDTH_PX, HEIGHT_WITHOUT_MAP_PX), |(_, (small, _))| (small.width_px(), small.height_px()));
    let [left, top, right, bottom] = frame(route.steps.iter().filter_map(&place), width as f64, height as f64);
    let view_box = format!("{left:.0} {top:.0} {:.0} {:.0}", right - left, bottom - top);
    html! {
        section {
            h2 { "Route" }
            p class="legend" {
                span class="key track" {} "the route " span class="key right" {} "a fix is expected "
                span class="key false" {} "no fix is expected"
            }
            svg class="map route" viewBox=(view_box) role="img" aria-label="map of the route" {
                @if let Some((_, (small, _))) = &picture {
                    image width=(width) height=(height) href=(data_url(small, 78)) {}
                }
                (track(route.steps.iter().filter_map(&place)))
                @for s in &route.steps { @if let Some(at) = place(s) { (step(s, at, (right - left) / 200.0)) } }
            }
        }
    }
}

/// The line of the route, below its steps.
fn track(points: impl Iterator<Item = [f64; 2]>) -> Markup {
    let points = points.map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ");
    html! { polyline class="track-edge" points=(points) {} polyline class="track" points=(points) {} }
}

/// A step as a dot, with its figures. Position and radius are in units of the picture.
fn step(s: &RouteStep, at: [f64; 2], radius: f64) -> Markup {
    let class = if s.fix_expected { "fix right" } else { "fix false" };
    let [x, y] = at.map(|v| format!("{v:.1}"));
    let title = format!(
        "{:.0} m: map {:.0} %, {:.0} keypoints, distinctiveness {:.2}, {:.2} s a search",
        s.way_m,
        100.0 * s.covered,
        s.keypoints,
        s.distinctiveness,
        s.execution_s
    );
    html! { circle class=(class) cx=(x) cy=(y) r=(format!("{radius:.2}")) { title { (title) } } }
}

/// The box around the picture and the route: left, top, right, bottom. A route farther away than five pictures is cut.
fn frame(points: impl Iterator<Item = [f64; 2]>, width: f64, height: f64) -> [f64; 4] {
    let most = 5.0 * width.max(height);
    points.fold([0.0, 0.0, width, height], |[l, t, r, b], [x, y]| {
        let (x, y) = (x.clamp(-most, most), y.clamp(-most, most));
        [l.min(x - 20.0), t.min(y - 20.0), r.max(x + 20.0), b.max(y + 20.0)]
    })
}

/// A place without a map: longitude and latitude fill the frame.
fn plain(route: &RouteForecast, s: &RouteStep) -> Option<[f64; 2]> {
    let scaled = |of: fn(&RouteStep) -> f64, room: f64| {
        let (low, high) =
            route.steps.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        30.0 + room * (of(s) - low) / (high - low).max(1e-9)
    };
    Some([scaled(|s| s.longitude_deg, 1140.0), 600.0 - scaled(|s| s.latitude_deg, 540.0)])
}
