//! The SVGs over the map: windows and footprint.

use super::map_picture::MapPicture;
use super::picture::svg_over;
use overfly_core::geodesy::{BodyFrame, Enu, ErrorEllipse};
use overfly_core::tile::WorldPixel;
use overfly_flight::locate::{Fix, TracedWindows};
use std::fmt::Write;

/// Arrows are this many times as long as the displacements.
pub const ARROW_SCALE: f64 = 6.0;
/// Screen pixels per pixel of the map.
const MAP_SCALE: f64 = 1.6;
/// The enlarged ellipse's semi-major axis has at most this many pixels.
const MAX_ELLIPSE_PX: f64 = 40.0;

/// The windows over the map, each with its own displacement: green where it agrees with the similarity.
pub fn windows(traced: &TracedWindows, map: &MapPicture) -> String {
    let mut marks = String::new();
    let observation = &traced.observation;
    let corner = [observation.window.left - map.corner[0], observation.window.top - map.corner[1]];
    let offset = corner.map(|v| v as f64 + observation.margin_px as f64);
    let edge = observation.window_size_px as f64 - 2.0;
    for (i, window) in traced.windows.iter().enumerate() {
        let [x, y] = [0, 1].map(|axis| window.centre_px[axis] + offset[axis]);
        let (dx, dy) = (window.displacement_px.x * ARROW_SCALE, window.displacement_px.y * ARROW_SCALE);
        let colour = if traced.inliers.contains(&i) { "#2ee6a8" } else { "#ff5a4f" };
        let _ = write!(
            marks,
            r#"<rect x="{:.1}" y="{:.1}" width="{edge:.0}" height="{edge:.0}" fill="{colour}" fill-opacity="0.13" stroke="{colour}" stroke-width="1.1"/><circle cx="{x:.1}" cy="{y:.1}" r="1.4" fill="{colour}"/><path d="{}" stroke="{colour}" stroke-width="1.8" fill="none" stroke-linecap="round"/>"#,
            x - edge / 2.0,
            y - edge / 2.0,
            arrow([x, y], [dx, dy]),
        );
    }
    svg_over(&map.colour, MAP_SCALE, false, &marks)
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

/// The 95 % ellipse of a fix, and how many times as large it is drawn.
pub struct DrawnEllipse {
    /// The ellipse.
    pub ellipse: ErrorEllipse,
    /// Enlargement.
    pub times: f64,
}

impl DrawnEllipse {
    /// Returns the ellipse of a fix, enlarged to be visible on pixels of a ground sample distance.
    pub fn new(fix: &Fix, gsd_m_per_px: f64) -> Self {
        let ellipse = fix.covariance.ellipse_95();
        let fits = |n: &f64| n * ellipse.semi_major_m / gsd_m_per_px <= MAX_ELLIPSE_PX;
        Self { ellipse, times: [50.0, 20.0, 10.0, 5.0, 2.0].into_iter().find(fits).unwrap_or(1.0) }
    }
}

/// The outline of the frame over the map, its upper edge bold, with the nadir and the enlarged 95 % ellipse.
pub fn footprint(fix: &Fix, traced: &TracedWindows, map: &MapPicture) -> Option<String> {
    let gsd = traced.observation.gsd;
    let nadir = WorldPixel::from_geodetic(fix.position, traced.pose.zoom).ok()?;
    let [x, y] = [nadir.x_px - map.corner[0] as f64, nadir.y_px - map.corner[1] as f64];
    let frame = BodyFrame::from(fix.heading);
    let corners = traced.camera.footprint_in_body()?.map(|corner| {
        let Enu { east_m, north_m } = frame.enu_from_body(corner);
        [x + east_m / gsd.east_m_per_px, y - north_m / gsd.north_m_per_px]
    });
    let outline = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ");
    let [upper_left, upper_right, ..] = corners;
    let DrawnEllipse { ellipse, times } = DrawnEllipse::new(fix, gsd.mean_m_per_px());
    let [rx, ry] = [ellipse.semi_major_m, ellipse.semi_minor_m].map(|v| v / gsd.mean_m_per_px() * times);
    // In the picture y runs down.
    let turn_deg = -ellipse.semi_major_from_east_rad.to_degrees();
    let marks = format!(
        r##"<polygon points="{outline}" fill="none" stroke="#ffd54a" stroke-width="1.6"/><path d="M{:.1},{:.1}L{:.1},{:.1}" stroke="#ffd54a" stroke-width="4"/><ellipse cx="{x:.2}" cy="{y:.2}" rx="{rx:.2}" ry="{ry:.2}" transform="rotate({turn_deg:.2} {x:.2} {y:.2})" fill="#ffffff55" stroke="#fff" stroke-width="1.2"/><path d="M{:.1},{y:.1}h12M{x:.1},{:.1}v12" stroke="#e0362c" stroke-width="1.4"/>"##,
        upper_left[0],
        upper_left[1],
        upper_right[0],
        upper_right[1],
        x - 6.0,
        y - 6.0,
    );
    Some(svg_over(&map.colour, MAP_SCALE, false, &marks))
}
