//! The map of located frames as SVG: imagery, true track, fixes with their ellipses, priors.

use super::flight_report::{FlightReport, fix_of};
use crate::trial::FixOutcome;
use maud::{Markup, html};
use overfly_core::geodesy::{ErrorEllipse, Geodetic};
use overfly_flight::locate::Fix;

/// The map, and how many times larger than true it draws the ellipses. `background` is the URL of the mosaic, which was shrunk by
/// `factor` to `width` x `height` pixels.
pub fn map(report: &FlightReport, factor: f64, (width, height): (usize, usize), background: &str) -> (Markup, u32) {
    let drawing = Drawing { report, factor, width: width as f64 };
    let enlargement = drawing.enlargement();
    let map = html! {
        svg class="map" viewBox={ "0 0 " (width) " " (height) } role="img" aria-label="map of the flight" {
            image width=(width) height=(height) href=(background) {}
            (track(report.outcomes.iter().filter_map(|o| drawing.at(o.truth))))
            @for (index, outcome) in report.outcomes.iter().enumerate() {
                (drawing.frame(index, outcome, enlargement))
            }
            (drawing.scale_bar(height as f64))
        }
    };
    (map, enlargement)
}

/// The 95 % ellipse of a fix.
fn ellipse_95(fix: &Fix) -> ErrorEllipse {
    fix.covariance.ellipse_95()
}

/// The true track through points of the map.
pub fn track(points: impl Iterator<Item = [f64; 2]>) -> Markup {
    let points: Vec<String> = points.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let points = points.join(" ");
    html! { polyline class="track-edge" points=(points) {} polyline class="track" points=(points) {} }
}

/// The attribute that turns a shape about a point of the map, degrees clockwise from east.
pub fn rotation(turn_deg: f64, [x, y]: [f64; 2]) -> String {
    format!("rotate({turn_deg:.1} {x:.1} {y:.1})")
}

/// A coordinate of the map, to a tenth of a pixel.
pub fn tenth(value: f64) -> String {
    format!("{value:.1}")
}

struct Drawing<'a> {
    report: &'a FlightReport<'a>,
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

    /// The round factor that makes the median ellipse about a hundredth as wide as the map.
    fn enlargement(&self) -> u32 {
        let axis_px = |o: &FixOutcome| Some(ellipse_95(fix_of(o)?).semi_major_m * self.px_per_m(o.truth));
        let mut axes: Vec<f64> = self.report.outcomes.iter().filter_map(axis_px).collect();
        axes.sort_by(f64::total_cmp);
        let Some(middle) = axes.get(axes.len() / 2).filter(|a| **a > 0.0) else { return 1 };
        let largest = 0.01 * self.width / middle;
        [50, 20, 10, 5, 2].into_iter().find(|n| f64::from(*n) <= largest).unwrap_or(1)
    }

    /// One frame: its prior, and its fix or a ring where it has none.
    fn frame(&self, index: usize, outcome: &FixOutcome, enlargement: u32) -> Markup {
        let (Some([tx, ty]), Some([px, py])) = (self.at(outcome.truth), self.at(outcome.prior)) else {
            return html! {};
        };
        let half = self.report.prior_error_m * self.px_per_m(outcome.truth);
        let place = fix_of(outcome).and_then(|fix| Some((fix, self.at(fix.position)?)));
        html! {
            g class="frame" id={ "frame-" (index) } {
                g class="prior" {
                    rect x=(tenth(px - half)) y=(tenth(py - half)) width=(tenth(2.0 * half)) height=(tenth(2.0 * half)) {}
                    line x1=(tenth(px)) y1=(tenth(py)) x2=(tenth(tx)) y2=(tenth(ty)) {}
                }
                @match place {
                    Some((fix, at)) => { (self.fix(outcome, fix, at, enlargement)) }
                    None => { circle class="fix none" cx=(tenth(tx)) cy=(tenth(ty)) r="6" {} }
                }
            }
        }
    }

    fn fix(&self, outcome: &FixOutcome, fix: &Fix, at: [f64; 2], enlargement: u32) -> Markup {
        let is_false = outcome.error.is_some_and(|e| e.length_m() > self.report.score.right_m);
        let class = if is_false { "false" } else { "right" };
        let scale = self.px_per_m(outcome.truth);
        let ellipse = ellipse_95(fix);
        let [long, short] = [ellipse.semi_major_m, ellipse.semi_minor_m].map(|a| a * scale * f64::from(enlargement));
        let turn = rotation(-ellipse.semi_major_from_east_rad.to_degrees(), at);
        let [x, y] = at.map(tenth);
        let error_m = outcome.error.map_or(0.0, |e| e.length_m());
        html! {
            ellipse class={ "ellipse " (class) } cx=(x) cy=(y) rx=(tenth(long)) ry=(tenth(short)) transform=(turn) {}
            circle class={ "fix " (class) } cx=(x) cy=(y) r="5" {
                title { (outcome.image) ": " (format!("{error_m:.2}")) " m off" }
            }
        }
    }

    fn scale_bar(&self, height: f64) -> Markup {
        let Some(first) = self.report.outcomes.first() else { return html! {} };
        let scale = self.px_per_m(first.truth);
        let longest_m = 0.2 * self.width / scale;
        let power = 10f64.powf(longest_m.log10().floor());
        let length_m = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|m| *m <= longest_m).unwrap_or(power);
        let (x, y, length) = (28.0, height - 30.0, length_m * scale);
        let whole = |value: f64| format!("{value:.0}");
        html! {
            g class="scale" {
                rect x=(whole(x - 14.0)) y=(whole(y - 26.0)) width=(whole(length + 28.0)) height="44" rx="6" {}
                path d={ "M" (x) " " (y) " v8 h" (tenth(length)) " v-8" } {}
                text x=(x) y=(whole(y - 6.0)) { (length_m) " m" }
            }
        }
    }
}
