//! Frames beside what the map shows from where they were located.

use super::{Report, data_url, escaped};
use overfly_core::camera::Camera;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::Answer;

/// A figure per shown frame with a fix: the frame, and the map as its camera would see it from the fix.
pub(super) fn gallery(report: &Report) -> String {
    report.shown.iter().filter_map(|(index, colour)| figure(report, *index, colour)).collect()
}

fn figure(report: &Report, index: usize, colour: &overfly_core::pixels::Colour) -> Option<String> {
    let (outcome, frame) = (report.outcomes.get(index)?, report.flight.frames.get(index)?);
    let Answer::Fix(fix) = &outcome.answer else { return None };
    let size = |n: usize| u32::try_from(n).ok();
    let view = frame.view(&report.flight.camera);
    let camera = Camera::new(&view, size(colour.width_px())?, size(colour.height_px())?).ok()?;
    let camera = camera.at_height_ratio(fix.gsd_m_per_px / camera.gsd_m_per_px());
    // A frame of many megapixels is shown small.
    let (width, height) = (colour.width_px(), colour.height_px());
    let shown_width = width.min(480);
    let camera = camera.resized(shown_width, height * shown_width / width);
    let nadir = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).ok()?;
    let map = report.mosaic.seen_by(&camera, nadir, fix.heading_deg.to_radians());
    let error_m = outcome.error.map_or(f64::NAN, |e| e.length_m());
    Some(format!(
        r#"<figure class="pair"><div><img alt="camera frame" src="{}"><span>camera</span></div><div><img alt="map from the fix" src="{}"><span>map from the fix</span></div><figcaption>{} &middot; {error_m:.2} m off, {} windows agree</figcaption></figure>"#,
        data_url(colour, 85),
        data_url(&map, 85),
        escaped(&outcome.image),
        fix.inliers,
    ))
}
