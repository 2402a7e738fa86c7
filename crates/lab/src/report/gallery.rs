//! Frames beside the map as the camera would see it from the fix.

use super::data_url::data_url;
use super::flight_report::{FlightReport, fix_of};
use maud::{Markup, html};
use overfly_core::camera::Camera;
use overfly_core::pixels::Colour;

/// The widest picture, pixels. A frame of many megapixels is shown small.
const WIDTH_PX: usize = 480;

/// A figure for each shown frame with a fix: the frame, and the map as its camera would see it from the fix.
pub fn gallery(report: &FlightReport) -> Markup {
    let figures = report.shown.iter().filter_map(|(index, colour)| figure(report, *index, colour));
    html! { @for figure in figures { (figure) } }
}

fn figure(report: &FlightReport, index: usize, colour: &Colour) -> Option<Markup> {
    let (outcome, frame) = (report.outcomes.get(index)?, report.flight.frames.get(index)?);
    let fix = fix_of(outcome)?;
    let size = |n: usize| u32::try_from(n).ok();
    let view = frame.view(&report.flight.camera);
    let camera = Camera::new(&view, size(colour.width_px())?, size(colour.height_px())?).ok()?;
    let camera = camera.at_height_ratio(fix.gsd_m_per_px / camera.gsd_m_per_px());
    let (width, height) = (colour.width_px(), colour.height_px());
    let shown_width = width.min(WIDTH_PX);
    let camera = camera.resized(shown_width, height * shown_width / width);
    let map = report.mosaic.seen_by(&camera, fix.position, fix.heading.radians());
    let error_m = outcome.error.map_or(f64::NAN, |e| e.length_m());
    Some(html! {
        figure class="pair" {
            div { img alt="camera frame" src=(data_url(colour, 85)); span { "camera" } }
            div { img alt="map from the fix" src=(data_url(&map, 85)); span { "map from the fix" } }
            figcaption { (outcome.image) " · " (format!("{error_m:.2}")) " m off, " (fix.inliers) " windows agree" }
        }
    })
}
