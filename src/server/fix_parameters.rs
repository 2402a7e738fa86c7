//! `FixParameters`: the `request` part of a fix, with the names of the command line's flags.

use super::dto::IntrinsicsJson;
use super::error::ServerError;
use overfly_core::camera::{Intrinsics, View};
use overfly_core::geodesy::{Geodetic, MAX_LATITUDE_DEG};
use overfly_flight::locate::{FixRequest, HeadingPrior, LocateError, PositionPrior};
use serde::Deserialize;
use utoipa::ToSchema;

/// What is known of a frame besides its pixels. Unknown keys are refused. Without a position, the whole layer is
/// searched; without a heading, all headings.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FixParameters {
    /// Most likely latitude of the nadir, degrees north.
    #[schema(minimum = -85.051128, maximum = 85.051128, example = 47.66)]
    pub latitude_deg: Option<f64>,
    /// Most likely longitude of the nadir, degrees east.
    #[schema(minimum = -180.0, maximum = 180.0, example = -99.27)]
    pub longitude_deg: Option<f64>,
    /// One standard deviation of the position per axis, metres.
    #[schema(exclusive_minimum = 0.0, example = 250.0)]
    pub sigma_m: Option<f64>,
    /// Instead of `sigma_m`: one standard deviation towards east, metres.
    pub sigma_east_m: Option<f64>,
    /// One standard deviation towards north, metres.
    pub sigma_north_m: Option<f64>,
    /// Correlation of east and north, in (-1, 1); 0 by default.
    pub correlation: Option<f64>,
    /// Direction of the image's upper edge, degrees clockwise from true north, [0, 360).
    #[schema(minimum = 0.0, exclusive_maximum = 360.0, example = 90.0)]
    pub heading_deg: Option<f64>,
    /// One standard deviation of the heading, degrees; 3 by default.
    pub heading_sigma_deg: Option<f64>,
    /// Ground metres per pixel of the frame, for a camera looking straight down. Or `height_m` and `camera`.
    #[schema(exclusive_minimum = 0.0, example = 5.5)]
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; needs `camera`.
    pub height_m: Option<f64>,
    /// The camera.
    pub camera: Option<IntrinsicsJson>,
    /// Pitch off nadir, degrees, positive ahead; needs `camera`; 0 by default.
    pub pitch_deg: Option<f64>,
    /// Roll off nadir, degrees, positive to the left; needs `camera`; 0 by default.
    pub roll_deg: Option<f64>,
    /// One standard deviation of the height (or ground sample distance) as a ratio; 0.03 by default.
    pub height_sigma_ratio: Option<f64>,
    /// The layer to search; by default the only one, or `ortho`.
    pub layer: Option<String>,
    /// When the image was taken, seconds; repeated in the answer.
    pub time_s: Option<f64>,
}

impl FixParameters {
    /// The request for the layer `layer`.
    ///
    /// # Errors
    /// The parameter that is missing, out of range or contradictory.
    pub(super) fn request(&self, layer: &str) -> Result<FixRequest, ServerError> {
        let request = FixRequest {
            layer: layer.to_owned(),
            position: self.position()?,
            heading: self.heading()?,
            view: self.view()?,
            scale_sigma_ratio: self.height_sigma_ratio.unwrap_or(0.03),
            time_s: self.time_s,
        };
        request.check()?;
        Ok(request)
    }

    fn position(&self) -> Result<PositionPrior, ServerError> {
        let sigmas =
            [("sigma_m", self.sigma_m), ("sigma_east_m", self.sigma_east_m), ("sigma_north_m", self.sigma_north_m)];
        let (latitude_deg, longitude_deg) = match (self.latitude_deg, self.longitude_deg) {
            (Some(latitude_deg), Some(longitude_deg)) => (latitude_deg, longitude_deg),
            (Some(_), None) => return refuse("longitude_deg", "is missing beside latitude_deg"),
            (None, Some(_)) => return refuse("latitude_deg", "is missing beside longitude_deg"),
            (None, None) => {
                return match sigmas.iter().find(|(_, value)| value.is_some()) {
                    Some((name, _)) => refuse(name, "requires latitude_deg and longitude_deg"),
                    None => Ok(PositionPrior::WholeLayer),
                };
            }
        };
        let latitude_deg = ranged("latitude_deg", latitude_deg, -MAX_LATITUDE_DEG, MAX_LATITUDE_DEG)?;
        let longitude_deg = ranged("longitude_deg", longitude_deg, -180.0, 180.0)?;
        let centre = Geodetic::from_degrees(latitude_deg, longitude_deg)
            .map_err(|e| ServerError::Parameter { name: "latitude_deg", reason: e.to_string() })?;
        let (sigma_east_m, sigma_north_m) = match (self.sigma_m, self.sigma_east_m, self.sigma_north_m) {
            (Some(both), None, None) if self.correlation.is_none() => (both, both),
            (Some(_), None, None) => {
                return refuse("correlation", "goes with sigma_east_m and sigma_north_m, not with sigma_m");
            }
            (None, Some(east), Some(north)) => (east, north),
            (None, None, None) => {
                return refuse("sigma_m", "is missing: one standard deviation of the position, metres");
            }
            (Some(_), _, _) => return refuse("sigma_m", "does not go with sigma_east_m, sigma_north_m"),
            (None, None, Some(_)) => return refuse("sigma_east_m", "is missing beside sigma_north_m"),
            (None, Some(_), None) => return refuse("sigma_north_m", "is missing beside sigma_east_m"),
        };
        Ok(PositionPrior::Gaussian {
            centre,
            sigma_east_m: length("sigma_m", "sigma_east_m", self.sigma_m, sigma_east_m)?,
            sigma_north_m: length("sigma_m", "sigma_north_m", self.sigma_m, sigma_north_m)?,
            correlation: self.correlation.unwrap_or(0.0),
        })
    }

    fn heading(&self) -> Result<Option<HeadingPrior>, ServerError> {
        let Some(heading_deg) = self.heading_deg else {
            return match self.heading_sigma_deg {
                Some(_) => refuse("heading_sigma_deg", "requires heading_deg"),
                None => Ok(None),
            };
        };
        if !(0.0..360.0).contains(&heading_deg) {
            return refuse("heading_deg", "must be degrees in [0, 360)");
        }
        let sigma_deg = self.heading_sigma_deg.unwrap_or(3.0);
        if !(sigma_deg > 0.0 && sigma_deg <= 180.0) {
            return refuse("heading_sigma_deg", "must be degrees in (0, 180]");
        }
        Ok(Some(HeadingPrior { heading_rad: heading_deg.to_radians(), sigma_rad: sigma_deg.to_radians() }))
    }

    fn view(&self) -> Result<View, ServerError> {
        let scale = stated_view(self.gsd_m_per_px, self.height_m, self.camera.as_ref())?;
        let tilted = [("pitch_deg", self.pitch_deg), ("roll_deg", self.roll_deg)];
        match scale {
            None => refuse("gsd_m_per_px", "is missing: give it, or height_m and camera"),
            Some(View::Nadir { gsd_m_per_px }) => {
                match tilted.iter().find(|(_, angle)| angle.is_some_and(|a| a != 0.0)) {
                    Some((name, _)) => refuse(name, "needs height_m and camera instead of gsd_m_per_px"),
                    None => Ok(View::Nadir { gsd_m_per_px }),
                }
            }
            Some(View::Posed { intrinsics, height_agl_m, .. }) => Ok(View::Posed {
                intrinsics,
                height_agl_m,
                pitch_rad: ranged("pitch_deg", self.pitch_deg.unwrap_or(0.0), -45.0, 45.0)?.to_radians(),
                roll_rad: ranged("roll_deg", self.roll_deg.unwrap_or(0.0), -45.0, 45.0)?.to_radians(),
            }),
        }
    }
}

/// The camera's view from either way of stating the scale, looking straight down; `None` if no scale is given.
pub(super) fn stated_view(
    gsd_m_per_px: Option<f64>,
    height_m: Option<f64>,
    camera: Option<&IntrinsicsJson>,
) -> Result<Option<View>, ServerError> {
    match (gsd_m_per_px, height_m, camera) {
        (None, None, None) => Ok(None),
        (Some(gsd), None, None) if (0.001..=1000.0).contains(&gsd) => Ok(Some(View::Nadir { gsd_m_per_px: gsd })),
        (Some(_), None, None) => refuse("gsd_m_per_px", "must be metres per pixel in [0.001, 1000]"),
        (None, Some(height_agl_m), Some(camera)) => {
            if !(height_agl_m > 0.0 && height_agl_m <= 100_000.0) {
                return refuse("height_m", "must be metres in (0, 100000]");
            }
            let intrinsics = Intrinsics::from(camera);
            intrinsics.check().map_err(LocateError::from)?;
            Ok(Some(View::Posed { intrinsics, height_agl_m, pitch_rad: 0.0, roll_rad: 0.0 }))
        }
        (None, Some(_), None) => refuse("camera", "is missing beside height_m"),
        (None, None, Some(_)) => refuse("height_m", "is missing beside camera"),
        (Some(_), _, _) => refuse("gsd_m_per_px", "does not go with height_m and camera"),
    }
}

fn refuse<T>(name: &'static str, reason: &str) -> Result<T, ServerError> {
    Err(ServerError::Parameter { name, reason: reason.to_owned() })
}

fn ranged(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, ServerError> {
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(ServerError::Parameter { name, reason: format!("{value} is outside [{low}, {high}]") })
    }
}

/// A standard deviation, blamed on the name it was given by.
fn length(both: &'static str, one: &'static str, given: Option<f64>, value: f64) -> Result<f64, ServerError> {
    let name = if given.is_some() { both } else { one };
    if value > 0.0 && value <= 100_000.0 {
        Ok(value)
    } else {
        Err(ServerError::Parameter { name, reason: format!("{value} is not metres in (0, 100000]") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(json: &str) -> String {
        let parameters: FixParameters = serde_json::from_str(json).unwrap();
        parameters.request("ortho").unwrap_err().parameter().unwrap()
    }

    #[test]
    fn takes_the_two_ways_of_stating_scale() {
        let nadir: FixParameters = serde_json::from_str(r#"{"gsd_m_per_px": 5.5}"#).unwrap();
        let request = nadir.request("ortho").unwrap();
        assert_eq!((request.position, request.heading), (PositionPrior::WholeLayer, None));
        let posed: FixParameters = serde_json::from_str(
            r#"{"latitude_deg": 47, "longitude_deg": 8, "sigma_m": 100, "heading_deg": 90, "height_m": 500, "pitch_deg": 3,
                "camera": {"width_px": 640, "height_px": 480, "focal_length_px": 700, "principal_point_px": [320, 240]}}"#,
        )
        .unwrap();
        assert!(matches!(posed.request("ortho").unwrap().view, View::Posed { .. }));
    }

    #[test]
    fn names_what_is_wrong() {
        for (json, name) in [
            (r#"{}"#, "gsd_m_per_px"),
            (r#"{"gsd_m_per_px": 0}"#, "gsd_m_per_px"),
            (r#"{"gsd_m_per_px": 1, "height_m": 3}"#, "gsd_m_per_px"),
            (r#"{"height_m": 3}"#, "camera"),
            (r#"{"gsd_m_per_px": 1, "latitude_deg": 3}"#, "longitude_deg"),
            (r#"{"gsd_m_per_px": 1, "latitude_deg": 3, "longitude_deg": 4}"#, "sigma_m"),
            (r#"{"gsd_m_per_px": 1, "latitude_deg": 86, "longitude_deg": 4, "sigma_m": 5}"#, "latitude_deg"),
            (r#"{"gsd_m_per_px": 1, "latitude_deg": 3, "longitude_deg": 4, "sigma_m": -5}"#, "sigma_m"),
            (r#"{"gsd_m_per_px": 1, "sigma_m": 5}"#, "sigma_m"),
            (r#"{"gsd_m_per_px": 1, "heading_deg": 360}"#, "heading_deg"),
            (r#"{"gsd_m_per_px": 1, "heading_sigma_deg": 3}"#, "heading_sigma_deg"),
            (r#"{"gsd_m_per_px": 1, "pitch_deg": 3}"#, "pitch_deg"),
        ] {
            assert_eq!(refusal(json), name, "{json}");
        }
        assert!(serde_json::from_str::<FixParameters>(r#"{"gsd": 1}"#).is_err());
    }
}
