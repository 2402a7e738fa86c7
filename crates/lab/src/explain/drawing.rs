//! The pictures: plain ones as JPEG, those with marks as SVG around a JPEG, and the page that shows them.

use super::{Explanation, MARGIN_PX, palette};
use base64::Engine;
use overfly_core::geodesy::{BodyFrame, Enu, EnuCovariance, ErrorEllipse};
use overfly_core::pixels::Colour;
use overfly_flight::locate::Answer;
use std::fmt::Write;

/// Arrows are drawn this many times as long as the displacements that they stand for.
const LONGER: f64 = 6.0;
/// Wider pictures are shrunk.
const MOST_WIDTH_PX: usize = 900;

/// Everything, `index.html` last.
pub fn pages(e: &Explanation<'_>) -> Vec<super::Page> {
    let mut pages = vec![
        ("frame.jpg", jpeg(&shrunk(e.frame))),
        ("view.jpg", jpeg(&palette::gray(&e.view.gray))),
        ("view-doubled.jpg", jpeg(&palette::channel(&e.view_structure, 0))),
        ("view-quadrupled.jpg", jpeg(&palette::channel(&e.view_structure, 1))),
        ("map.jpg", jpeg(&e.ground.colour)),
        ("map-doubled.jpg", jpeg(&palette::channel(&e.ground.structure, 0))),
        ("map-quadrupled.jpg", jpeg(&palette::channel(&e.ground.structure, 1))),
    ];
    pages.extend(surface(e).map(|svg| ("surface.svg", svg.into_bytes())));
    pages.push(("windows.svg", windows(e).into_bytes()));
    pages.extend(footprint(e).map(|svg| ("footprint.svg", svg.into_bytes())));
    let html = index(e, pages.iter().any(|p| p.0 == "surface.svg"));
    pages.push(("index.html", html.into_bytes()));
    pages
}

fn jpeg(colour: &Colour) -> Vec<u8> {
    let mut bytes = Vec::new();
    let side = |n: usize| u16::try_from(n).expect("pictures are at most a few thousand pixels wide");
    jpeg_encoder::Encoder::new(&mut bytes, 82)
        .encode(colour.values(), side(colour.width_px()), side(colour.height_px()), jpeg_encoder::ColorType::Rgb)
        .expect("writing to memory does not fail");
    bytes
}

/// Every n-th pixel, where a picture is wider than it need be.
fn shrunk(colour: &Colour) -> Colour {
    let step = colour.width_px().max(colour.height_px()).div_ceil(MOST_WIDTH_PX).max(1);
    let (width, height) = (colour.width_px().div_ceil(step), colour.height_px().div_ceil(step));
    let values = (0..width * height).flat_map(|i| colour.at(i % width * step, i / width * step)).collect();
    Colour::from_values(width, height, values).expect("three values a pixel")
}

/// An SVG of a picture's own pixels, `scale` times as large, with marks over it.
fn over(colour: &Colour, scale: f64, is_sharp: bool, marks: &str) -> String {
    let (width, height) = (colour.width_px(), colour.height_px());
    let rendering = if is_sharp { r#" style="image-rendering:pixelated""# } else { "" };
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{:.0}" height="{:.0}" font-family="sans-serif"><image width="{width}" height="{height}"{rendering} href="data:image/jpeg;base64,{}"/>{marks}</svg>"#,
        width as f64 * scale,
        height as f64 * scale,
        base64::engine::general_purpose::STANDARD.encode(jpeg(colour)),
    )
}

/// The coarse surface, its best peak ringed in white, the next ones in blue, each with its height.
fn surface(e: &Explanation<'_>) -> Option<String> {
    let s = e.surface.as_ref()?;
    let picture = s.picture();
    let scale = 560.0 / picture.width_px().max(picture.height_px()) as f64;
    // All in the picture's own pixels.
    let unit = 1.0 / scale;
    let mut marks = String::new();
    for (rank, ([x, y], score)) in s.peaks.iter().enumerate().rev() {
        let (cx, cy) = (*x as f64 + 0.5, *y as f64 + 0.5);
        let colour = if rank == 0 { "#fff" } else { "#7fd3ff" };
        let beside = if cx > 0.8 * picture.width_px() as f64 { (-14.0, "end") } else { (14.0, "start") };
        let _ = write!(
            marks,
            r##"<circle cx="{cx}" cy="{cy}" r="{:.3}" fill="none" stroke="{colour}" stroke-width="{:.3}"/><text x="{:.2}" y="{:.2}" font-size="{:.2}" text-anchor="{}" fill="{colour}" stroke="#000" stroke-width="{:.3}" paint-order="stroke">{score:.1}</text>"##,
            9.0 * unit,
            2.0 * unit,
            cx + beside.0 * unit,
            cy + 5.0 * unit,
            15.0 * unit,
            beside.1,
            3.0 * unit,
        );
    }
    Some(over(&picture, scale, true, &marks))
}

/// Every window over the map with its own displacement: green where it agrees with the similarity.
fn windows(e: &Explanation<'_>) -> String {
    let mut marks = String::new();
    let inliers: &[usize] = e.fit.as_ref().map_or(&[], |f| &f.inliers);
    let edge = e.window_px as f64 - 2.0;
    for (i, window) in e.windows.iter().enumerate() {
        let [x, y] = window.centre_px.map(|v| v + MARGIN_PX as f64);
        let (dx, dy) = (window.displacement_px.x * LONGER, window.displacement_px.y * LONGER);
        let colour = if inliers.contains(&i) { "#2ee6a8" } else { "#ff5a4f" };
        let _ = write!(
            marks,
            r#"<rect x="{:.1}" y="{:.1}" width="{edge:.0}" height="{edge:.0}" fill="{colour}" fill-opacity="0.13" stroke="{colour}" stroke-width="1.1"/><circle cx="{x:.1}" cy="{y:.1}" r="1.4" fill="{colour}"/><path d="{}" stroke="{colour}" stroke-width="1.8" fill="none" stroke-linecap="round"/>"#,
            x - edge / 2.0,
            y - edge / 2.0,
            arrow([x, y], [dx, dy]),
        );
    }
    over(&e.ground.colour, 1.6, false, &marks)
}

/// A line with a head that is no longer than half of it.
fn arrow([x, y]: [f64; 2], [dx, dy]: [f64; 2]) -> String {
    let length = dx.hypot(dy).max(1e-9);
    let head = (0.5 * length).min(5.0);
    let (ux, uy) = (dx / length * head, dy / length * head);
    let (tx, ty) = (x + dx, y + dy);
    let barb = |side: f64| (tx - 0.87 * ux - 0.5 * side * uy, ty - 0.87 * uy + 0.5 * side * ux);
    let ((ax, ay), (bx, by)) = (barb(1.0), barb(-1.0));
    format!("M{x:.2},{y:.2}L{tx:.2},{ty:.2}M{ax:.2},{ay:.2}L{tx:.2},{ty:.2}L{bx:.2},{by:.2}")
}

/// Half axes of the fix's 95 % ellipse, metres, and how many times as large it is drawn.
fn ellipse(e: &Explanation<'_>) -> Option<([f64; 2], f64)> {
    let ErrorEllipse { semi_major_m, semi_minor_m, .. } = EnuCovariance::from(e.found()?.covariance_m2).ellipse_95();
    let half_m = [semi_major_m, semi_minor_m];
    let fits = |n: &f64| n * half_m[0] / e.gsd.mean_m_per_px() <= 40.0;
    Some((half_m, [50.0, 20.0, 10.0, 5.0, 2.0].into_iter().find(fits).unwrap_or(1.0)))
}

/// The frame's outline over the map, its upper edge bold, the nadir, and the 95 % ellipse, drawn larger.
fn footprint(e: &Explanation<'_>) -> Option<String> {
    let fix = e.found()?;
    let frame = BodyFrame::from_heading_rad(e.pose.heading_rad);
    let nadir = [e.pose.nadir.x_px - e.ground.corner[0] as f64, e.pose.nadir.y_px - e.ground.corner[1] as f64];
    let corners = e.camera.footprint_in_body()?.map(|corner| {
        let Enu { east_m, north_m } = frame.enu_from_body(corner);
        [nadir[0] + east_m / e.gsd.east_m_per_px, nadir[1] - north_m / e.gsd.north_m_per_px]
    });
    let path = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ");
    let [a, b] = [corners[0], corners[1]];
    let ellipse_95 = EnuCovariance::from(fix.covariance_m2).ellipse_95();
    let (half_m, larger) = ellipse(e)?;
    let half_px = half_m.map(|v| v / e.gsd.mean_m_per_px());
    // On the picture y runs down.
    let turn_deg = -ellipse_95.semi_major_from_east_rad.to_degrees();
    let [x, y] = nadir;
    let marks = format!(
        r##"<polygon points="{path}" fill="none" stroke="#ffd54a" stroke-width="1.6"/><path d="M{:.1},{:.1}L{:.1},{:.1}" stroke="#ffd54a" stroke-width="4"/><ellipse cx="{x:.2}" cy="{y:.2}" rx="{:.2}" ry="{:.2}" transform="rotate({turn_deg:.2} {x:.2} {y:.2})" fill="#ffffff55" stroke="#fff" stroke-width="1.2"/><path d="M{:.1},{y:.1}h12M{x:.1},{:.1}v12" stroke="#e0362c" stroke-width="1.4"/>"##,
        a[0],
        a[1],
        b[0],
        b[1],
        half_px[0] * larger,
        half_px[1] * larger,
        x - 6.0,
        y - 6.0,
    );
    Some(over(&e.ground.colour, 1.6, false, &marks))
}

fn index(e: &Explanation<'_>, has_surface: bool) -> String {
    let figure = |file: &str, caption: &str| {
        format!(r#"<figure><img src="{file}" alt=""><figcaption>{caption}</figcaption></figure>"#)
    };
    let verdict = match e.answer {
        Answer::Fix(f) => format!(
            "Fix at {:.7}, {:.7}, heading {:.2} degrees, {:.4} m a pixel: {} windows agree, expected accidents 10^{:.0}.",
            f.latitude_deg,
            f.longitude_deg,
            f.heading_deg,
            f.gsd_m_per_px,
            f.inliers,
            f.log10_false_alarms.unwrap_or(0.0)
        ),
        Answer::NoFix(n) => {
            let said = n.detail.replace('&', "&amp;").replace('<', "&lt;");
            format!("No fix: {said}. Below, the frame stands in the middle of the region, under the stated heading.")
        }
    };
    let agreeing = e.fit.as_ref().map_or(0, |f| f.inliers.len());
    let mut body = String::new();
    body.push_str("<h2>What was seen</h2><div>");
    body.push_str(&figure("frame.jpg", "The frame."));
    body.push_str(&figure("view.jpg", "The same from above, north up, on the map's own pixels."));
    body.push_str(&figure("map.jpg", "The map there."));
    body.push_str("</div><h2>What is compared</h2><p>The direction of edges: hue is the angle, doubled (where edges run) and quadrupled (where corners and crossings are); brightness is how clear it is. Contrast and its sign are forgotten.</p><div>");
    body.push_str(&figure("view-doubled.jpg", "View, doubled angle."));
    body.push_str(&figure("map-doubled.jpg", "Map, doubled angle."));
    body.push_str(&figure("view-quadrupled.jpg", "View, quadrupled angle."));
    body.push_str(&figure("map-quadrupled.jpg", "Map, quadrupled angle."));
    body.push_str("</div><h2>Where it stands out</h2><div>");
    if let (true, Some(s)) = (has_surface, &e.surface) {
        let caption = format!(
            "The coarse search under the answer's heading and scale: every place of the region, {:.1} m a pixel, in standard deviations; the best five are marked.",
            s.gsd_m_per_px
        );
        body.push_str(&figure("surface.svg", &caption));
    }
    let caption = format!(
        "Small windows, each finding its own place anew: {agreeing} of {} agree on one similarity (green). Arrows are {LONGER:.0} times as long as the displacement left.",
        e.windows.len()
    );
    body.push_str(&figure("windows.svg", &caption));
    if let Some(([long, short], larger)) = ellipse(e) {
        let caption = format!(
            "The frame's outline, its upper edge bold, and the nadir in its 95 % ellipse of {long:.2} and {short:.2} m half axes, drawn {larger:.0} times as large."
        );
        body.push_str(&figure("footprint.svg", &caption));
    }
    format!(
        r#"<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>One registration</title><style>body{{font:16px/1.5 system-ui,sans-serif;max-width:1180px;margin:2rem auto;padding:0 1rem;color:#1b2330;background:#fafaf7}}h1,h2{{line-height:1.2}}div{{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}}figure{{margin:0;max-width:100%}}img{{max-width:min(100%,560px);height:auto;border-radius:4px;display:block}}figcaption{{color:#566;font-size:.88rem;max-width:34rem}}@media(prefers-color-scheme:dark){{body{{color:#dde;background:#14181f}}figcaption{{color:#9ab}}}}</style><h1>One registration</h1><p>{verdict}</p>{body}</div></html>"#
    )
}
