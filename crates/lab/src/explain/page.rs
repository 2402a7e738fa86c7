//! The page that shows the pictures of a registration.

use super::drawing::{ARROW_SCALE, DrawnEllipse};
use super::surface::MARKED_PEAKS;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use overfly_flight::locate::{Answer, Trace};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1180px;margin:2rem auto;padding:0 1rem;color:#1b2330;background:#fafaf7}h1,h2{line-height:1.2}div{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}figure{margin:0;max-width:100%}img{max-width:min(100%,560px);height:auto;border-radius:4px;display:block}figcaption{color:#566;font-size:.88rem;max-width:34rem}@media(prefers-color-scheme:dark){body{color:#dde;background:#14181f}figcaption{color:#9ab}}";

/// The page for an answer and its trace, with the pictures that were drawn.
pub fn html(answer: &Answer, trace: &Trace, names: &[&str]) -> String {
    let figure = |name: &str, caption: &str| {
        html! { @if names.contains(&name) { figure { img src=(name) alt=""; figcaption { (caption) } } } }
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width";
            title { "One registration" }
            style { (PreEscaped(STYLE)) }
            h1 { "One registration" }
            p { (summary(answer, trace)) }
            h2 { "Frame and map" }
            div {
                (figure("frame.jpg", "The frame."))
                (figure("view.jpg", "The frame as a ground view, north up, in the map's pixels."))
                (figure("map.jpg", "The map there."))
            }
            @if trace.windows.is_some() { (comparison(&figure)) (evidence(answer, trace, &figure)) }
        }
    };
    page.into_string()
}

fn summary(answer: &Answer, trace: &Trace) -> String {
    match answer {
        Answer::Fix(f) => format!(
            "Fix at {:.7}, {:.7}, heading {:.2} degrees, {:.4} m a pixel: {} windows agree, 10^{:.0} false alarms are expected by chance.",
            f.position.latitude_deg(),
            f.position.longitude_deg(),
            f.heading.degrees(),
            f.gsd_m_per_px,
            f.inliers,
            f.log10_false_alarms.unwrap_or(0.0)
        ),
        Answer::NoFix(n) => {
            let shown = match &trace.windows {
                None => "The search did not begin.",
                Some(traced) if traced.is_found => "The pictures show the best place found.",
                Some(_) => "The pictures show the centre of the region under the stated heading.",
            };
            format!("No fix: {}. {shown}", n.detail)
        }
    }
}

fn comparison(figure: &dyn Fn(&str, &str) -> Markup) -> Markup {
    html! {
        h2 { "Structural channels" }
        p { "The direction of edges: hue is the angle, doubled (direction of edges) or quadrupled (corners and crossings); brightness is how distinct it is. Contrast and its sign are dropped." }
        div {
            (figure("view-doubled.jpg", "View, doubled angle."))
            (figure("map-doubled.jpg", "Map, doubled angle."))
            (figure("view-quadrupled.jpg", "View, quadrupled angle."))
            (figure("map-quadrupled.jpg", "Map, quadrupled angle."))
        }
    }
}

fn evidence(answer: &Answer, trace: &Trace, figure: &dyn Fn(&str, &str) -> Markup) -> Markup {
    let Some(traced) = &trace.windows else { return html! {} };
    let surface = trace.surface.as_ref().map(|surface| {
        let scope = if trace.cell_level.is_some() {
            "A wide search over cells came first, and the coarse search compared only the surroundings of its best places."
        } else {
            "The coarse search compared every place of the region."
        };
        format!(
            "The coarse surface under the heading and scale of the best peak, {:.1} m a pixel, as z-scores. Of the peaks found under any heading and scale, the best {MARKED_PEAKS} are marked where they lie here. {scope}",
            surface.gsd_m_per_px
        )
    });
    let windows = format!(
        "Small windows, each matched on its own: {} of {} agree on one similarity (green). Arrows are {ARROW_SCALE:.0} times as long as the displacements.",
        traced.inliers.len(),
        traced.windows.len()
    );
    let footprint = match answer {
        Answer::Fix(fix) => {
            let DrawnEllipse { ellipse, times } = DrawnEllipse::new(fix, traced.observation.gsd.mean_m_per_px());
            let (long, short) = (ellipse.semi_major_m, ellipse.semi_minor_m);
            format!(
                "The frame's outline, its upper edge bold, and the nadir with its 95 % ellipse of {long:.2} and {short:.2} m semi-axes, drawn {times:.0} times as large."
            )
        }
        Answer::NoFix(_) => String::new(),
    };
    html! {
        h2 { "Evidence" }
        div {
            @if let Some(caption) = &surface { (figure("surface.svg", caption)) }
            (figure("windows.svg", &windows))
            (figure("footprint.svg", &footprint))
        }
    }
}
