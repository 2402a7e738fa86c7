//! The answer of `overfly fix` as text.

use overfly_flight::locate::{Answer, Fix, PositionOf, SearchedMap};

/// The answer as lines.
pub fn text(answer: &Answer, elapsed_ms: f64, integrity_risk: f64) -> String {
    match answer {
        Answer::Fix(f) => {
            let ellipse = f.covariance.ellipse();
            let centre = f.image_centre_covariance.ellipse();
            let point = match f.position_of {
                PositionOf::Nadir => "straight below the camera",
                PositionOf::ImageCentre => "at the image's centre",
            };
            format!(
                "fix        {:.7} {:.7} (degrees, {point})\nellipse    {:.2} x {:.2} m (one standard deviation)\nprotection {}\n\
                 centre     {:.7} {:.7} (ground at the image's centre), ellipse {:.2} x {:.2} m\n\
                 heading    {:.2} +- {:.2} degrees\nscale      {:.4} m/px +- {:.2} %\nevidence   score {:.1}, {} windows agree, \
                 false with probability {:.1e}\nsearched   {} tiles (nominal {:.1}), {:.0} ms\n{}\n{}",
                f.position.latitude_deg(),
                f.position.longitude_deg(),
                ellipse.semi_major_m,
                ellipse.semi_minor_m,
                protection_text(f, integrity_risk),
                f.image_centre.latitude_deg(),
                f.image_centre.longitude_deg(),
                centre.semi_major_m,
                centre.semi_minor_m,
                f.heading.degrees(),
                f.heading_sigma_rad.to_degrees(),
                f.gsd_m_per_px,
                100.0 * f.scale_sigma_ratio,
                f.score,
                f.inliers,
                f.false_fix_probability,
                f.tiles_searched,
                f.nominal_count,
                elapsed_ms,
                map_text(&f.map),
                map_error_text(f),
            )
        }
        Answer::NoFix(n) => format!(
            "no fix     {}: {}\nsearched   {} tiles (nominal {:.1}), {:.0} ms\n{}",
            n.reason.word(),
            n.detail,
            n.tiles_searched,
            n.nominal_count,
            elapsed_ms,
            map_text(&n.map)
        ),
    }
}

/// The protection level of a fix.
fn protection_text(fix: &Fix, integrity_risk: f64) -> String {
    match fix.protection_level_m(integrity_risk) {
        Some(level_m) => format!("{level_m:.1} m at a risk of {integrity_risk:e}"),
        None => format!("none at a risk of {integrity_risk:e}: one fix alone is false more often"),
    }
}

/// The map that the answer is from; where several layers may be searched, those that were.
fn map_text(map: &SearchedMap) -> String {
    let date = match map.layer_date.as_deref() {
        Some(date) => format!(" of {}", date.get(..10).unwrap_or(date)),
        None => " of unknown date".into(),
    };
    let more = if map.layers_charged > 1 {
        let searched = map.layers_searched.join(", ");
        format!("; searched {searched} of {} layers, and the evidence counts all of them", map.layers_charged)
    } else {
        String::new()
    };
    format!("map        layer {}{date}, store {}{more}", map.layer, map.store_digest)
}

/// The map's own error, and whether anything states it.
fn map_error_text(fix: &Fix) -> String {
    let stated = if fix.map_error_known { "as the map states" } else { "a default: nothing states the map's error" };
    format!("map error  {:.2} m per axis, {stated}; it is part of the ellipses", fix.map_error_m)
}
