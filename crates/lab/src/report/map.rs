//! The map: imagery, true track, fixes with their ellipses, priors.

use super::{Report, data_url};
use crate::trial::FixOutcome;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::{Answer, Fix};
use std::fmt::Write;

const WIDTH_PX: usize = 1500;
/// Half axes of a 95 % ellipse per standard deviation: the root of chi-square's 95 % quantile at two degrees.
pub(super) const TO_95: f64 = 2.447_746_8;

/// The map as SVG, and how many times larger than true its ellipses are drawn.
pub(super) fn map(report: &Report) -> (String, u32) {
    let (picture, factor) = report.mosaic.shrunk(WIDTH_PX);
    let (width, height) = (picture.width_px(), picture.height_px());
    let view = Drawing { report, factor: factor as f64, width: width as f64 };
    let larger = view.larger();
    let mut svg = format!(
        r#"<svg class="map" viewBox="0 0 {width} {height}" role="img" aria-label="map of the flight"><image width="{width}" height="{height}" href="{}"/>"#,
        data_url(&picture, 78)
    );
    view.draw_track(&mut svg);
    for (index, outcome) in report.outcomes.iter().enumerate() {
        view.draw_frame(&mut svg, index, outcome, larger);
    }
    view.draw_scale(&mut svg, height as f64);
    svg.push_str("</svg>");
    (svg, larger)
}

struct Drawing<'a> {
    report: &'a Report<'a>,
    factor: f64,
    width: f64,
}

impl Drawing<'_> {
    fn at(&self, point: Geodetic) -> Option<[f64; 2]> {
        self.report.mosaic.pixel_of(point).map(|p| p.map(|v| v / self.factor))
    }

    fn px_per_m(&self, point: Geodetic) -> f64 {
        let [east, north] = self.report.mosaic.pixels_per_m(point);
        (east * north).sqrt() / self.factor
    }

    /// A round number by which the middle ellipse becomes about a hundredth of the map's width.
    fn larger(&self) -> u32 {
        let mut axes: Vec<f64> = self
            .report
            .outcomes
            .iter()
            .filter_map(|o| Some(half_axes_m(fix_of(o)?)[0] * self.px_per_m(o.truth)))
            .collect();
        axes.sort_by(f64::total_cmp);
        let Some(middle) = axes.get(axes.len() / 2).filter(|a| **a > 0.0) else { return 1 };
        let wanted = 0.01 * self.width / middle;
        [50, 20, 10, 5, 2].into_iter().find(|n| f64::from(*n) <= wanted).unwrap_or(1)
    }

    fn draw_track(&self, svg: &mut String) {
        let points: Vec<String> = self
            .report
            .outcomes
            .iter()
            .filter_map(|o| self.at(o.truth))
            .map(|[x, y]| format!("{x:.1},{y:.1}"))
            .collect();
        let points = points.join(" ");
        let _ = write!(
            svg,
            r#"<polyline class="track-edge" points="{points}"/><polyline class="track" points="{points}"/>"#
        );
    }

    fn draw_frame(&self, svg: &mut String, index: usize, outcome: &FixOutcome, larger: u32) {
        let (Some([tx, ty]), Some([px, py])) = (self.at(outcome.truth), self.at(outcome.prior)) else { return };
        let scale = self.px_per_m(outcome.truth);
        let half = self.report.prior_error_m * scale;
        let _ = write!(
            svg,
            r#"<g class="frame" id="frame-{index}"><g class="prior"><rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}"/><line x1="{px:.1}" y1="{py:.1}" x2="{tx:.1}" y2="{ty:.1}"/></g>"#,
            px - half,
            py - half,
            2.0 * half,
            2.0 * half
        );
        let place = fix_of(outcome).and_then(|fix| {
            let point = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).ok()?;
            Some((fix, self.at(point)?))
        });
        match place {
            Some((fix, [x, y])) => {
                let is_false = outcome.error.is_some_and(|e| e.length_m() > self.report.score.right_m);
                let class = if is_false { "false" } else { "right" };
                let [long, short] = half_axes_m(fix).map(|a| a * scale * f64::from(larger));
                let turn_deg = long_axis_deg(fix);
                let _ = write!(
                    svg,
                    r#"<ellipse class="ellipse {class}" cx="{x:.1}" cy="{y:.1}" rx="{long:.1}" ry="{short:.1}" transform="rotate({turn_deg:.1} {x:.1} {y:.1})"/><circle class="fix {class}" cx="{x:.1}" cy="{y:.1}" r="5"><title>{}: {:.2} m off</title></circle>"#,
                    super::escaped(&outcome.image),
                    outcome.error.map_or(0.0, |e| e.length_m()),
                );
            }
            None => {
                let _ = write!(svg, r#"<circle class="fix none" cx="{tx:.1}" cy="{ty:.1}" r="6"/>"#);
            }
        }
        svg.push_str("</g>");
    }

    fn draw_scale(&self, svg: &mut String, height: f64) {
        let Some(first) = self.report.outcomes.first() else { return };
        let scale = self.px_per_m(first.truth);
        let wanted_m = 0.2 * self.width / scale;
        let power = 10f64.powf(wanted_m.log10().floor());
        let length_m = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|m| *m <= wanted_m).unwrap_or(power);
        let (x, y, length) = (28.0, height - 30.0, length_m * scale);
        let _ = write!(
            svg,
            r#"<g class="scale"><rect x="{:.0}" y="{:.0}" width="{:.0}" height="44" rx="6"/><path d="M{x} {y} v8 h{length:.1} v-8"/><text x="{x}" y="{:.0}">{length_m} m</text></g>"#,
            x - 14.0,
            y - 26.0,
            length + 28.0,
            y - 6.0
        );
    }
}

/// The fix of an outcome, where there is one.
pub(super) fn fix_of(outcome: &FixOutcome) -> Option<&Fix> {
    match &outcome.answer {
        Answer::Fix(fix) => Some(fix),
        Answer::NoFix(_) => None,
    }
}

/// Half axes of the 95 % ellipse, metres, the long one first.
pub(super) fn half_axes_m(fix: &Fix) -> [f64; 2] {
    half_axes_of_m(&fix.covariance_m2)
}

/// As [`half_axes_m`], of a covariance in east and north, m^2.
pub(super) fn half_axes_of_m(covariance_m2: &[[f64; 2]; 2]) -> [f64; 2] {
    let [[ee, en], [_, nn]] = *covariance_m2;
    let (middle, spread) = ((ee + nn) / 2.0, ((ee - nn) / 2.0).hypot(en));
    [middle + spread, middle - spread].map(|v| v.max(0.0).sqrt() * TO_95)
}

/// Direction of the long axis in an image whose y runs down: degrees clockwise from east.
fn long_axis_deg(fix: &Fix) -> f64 {
    long_axis_of_deg(&fix.covariance_m2)
}

/// As [`long_axis_deg`], of a covariance in east and north.
pub(super) fn long_axis_of_deg(covariance_m2: &[[f64; 2]; 2]) -> f64 {
    let [[ee, en], [_, nn]] = *covariance_m2;
    -(0.5 * (2.0 * en).atan2(ee - nn)).to_degrees()
}

/// Points around the 95 % ellipse, metres east and north of its middle.
pub(super) fn ellipse_m(fix: &Fix) -> impl Iterator<Item = (f64, f64)> {
    let [long, short] = half_axes_m(fix);
    let (sin, cos) = (-long_axis_deg(fix)).to_radians().sin_cos();
    (0..=48).map(move |i| {
        let (s, c) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
        (long * c * cos - short * s * sin, long * c * sin + short * s * cos)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Spread;

    #[test]
    fn the_drawn_ellipse_is_the_covariances_own() {
        let fix: Fix = serde_json::from_value(serde_json::json!({
            "latitude_deg": 0.0, "longitude_deg": 0.0, "heading_deg": 0.0, "heading_sigma_deg": 0.0, "gsd_m_per_px": 1.0,
            "scale_sigma_ratio": 0.0, "covariance_m2": [[5.0, 2.0], [2.0, 2.0]], "score": 0.0, "false_fix_probability": 0.0, "log10_false_alarms": null,
            "image_centre": {"latitude_deg": 0.0, "longitude_deg": 0.0}, "inliers": 0, "tiles_searched": 0,
            "nominal_count": 0.0, "map_epoch": null, "time_s": null, "elapsed_ms": 0.0
        }))
        .unwrap();
        // Every drawn point is at the same distance in the covariance's own measure: its inverse is [[2, -2], [-2, 5]] / 6.
        let squared: Vec<f64> = ellipse_m(&fix).map(|(e, n)| (2.0 * e * e - 4.0 * e * n + 5.0 * n * n) / 6.0).collect();
        let spread = Spread::of(squared).unwrap();
        assert!((spread.median - 5.9915).abs() < 1e-3 && (spread.max - spread.median).abs() < 1e-9);
    }
}
