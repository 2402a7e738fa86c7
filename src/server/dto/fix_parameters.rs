//! `FixParametersJson`: the `request` part of a fix, with the names of the command line's flags. The library checks the values.

use super::intrinsics::IntrinsicsJson;
use overfly_core::camera::Intrinsics;
use overfly_flight::locate::{FixParameters, ViewParameters};
use serde::Deserialize;
use utoipa::ToSchema;

/// What is known of a frame besides its pixels. Unknown keys are refused. Without a position, the whole layer is
/// searched; without a heading, all headings.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, ToSchema)]
#[schema(as = FixParameters)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct FixParametersJson {
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
    /// One standard deviation of the heading, degrees in (0, 180]; 3 by default.
    pub heading_sigma_deg: Option<f64>,
    /// Ground metres per pixel of the frame, for a camera looking straight down. Or `height_m` and `camera`.
    #[schema(exclusive_minimum = 0.0, example = 5.5)]
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; needs `camera`.
    pub height_m: Option<f64>,
    /// Instead of `height_m`: height above mean sea level (EGM2008), metres; needs `camera`, and a store with terrain.
    pub height_msl_m: Option<f64>,
    /// Instead of `height_m`: height above the WGS84 ellipsoid, metres; needs `camera`, and a store with terrain.
    pub height_ellipsoidal_m: Option<f64>,
    /// The camera.
    #[schema(nullable = false)]
    pub camera: Option<IntrinsicsJson>,
    /// Pitch off nadir, degrees in [-45, 45], positive ahead; needs `camera`. Not stated is unknown, not 0.
    pub pitch_deg: Option<f64>,
    /// Roll off nadir, degrees in [-45, 45], positive to the left; needs `camera`. Not stated is unknown, not 0.
    pub roll_deg: Option<f64>,
    /// One standard deviation of pitch and of roll, degrees; needs `camera`. By default 2 where both are stated, else 5.
    #[schema(minimum = 0.0, maximum = 20.0)]
    pub attitude_sigma_deg: Option<f64>,
    /// One standard deviation of the height (or ground sample distance) as a ratio; 0.03 by default.
    pub height_sigma_ratio: Option<f64>,
    /// The risk for which the answer states a protection level: 0.001 by default.
    #[schema(minimum = 1e-9, maximum = 0.5, example = 0.001)]
    pub integrity_risk: Option<f64>,
    /// The layer to search; by default the only one, or `ortho`. `any` (fixes only): all layers, the newest first,
    /// older ones only on no fix.
    #[schema(example = "any")]
    pub layer: Option<String>,
    /// When the image was taken, seconds; repeated in the answer.
    pub time_s: Option<f64>,
    /// On no fix, search on for what was stated wrongly: heading, scale or layer. The hints are no fix.
    pub hints: bool,
    /// Search for hints for at most so many seconds; 2 by default, 0 for none; needs `hints`. Ends early when another fix or motion
    /// waits for its turn.
    #[schema(minimum = 0.0, maximum = 10.0)]
    pub hints_limit_s: Option<f64>,
}

impl From<&FixParametersJson> for FixParameters {
    fn from(given: &FixParametersJson) -> Self {
        Self {
            latitude_deg: given.latitude_deg,
            longitude_deg: given.longitude_deg,
            sigma_m: given.sigma_m,
            sigma_east_m: given.sigma_east_m,
            sigma_north_m: given.sigma_north_m,
            correlation: given.correlation,
            heading_deg: given.heading_deg,
            heading_sigma_deg: given.heading_sigma_deg,
            view: ViewParameters {
                gsd_m_per_px: given.gsd_m_per_px,
                height_m: given.height_m,
                height_msl_m: given.height_msl_m,
                height_ellipsoidal_m: given.height_ellipsoidal_m,
                camera: given.camera.as_ref().map(Intrinsics::from),
                pitch_deg: given.pitch_deg,
                roll_deg: given.roll_deg,
                attitude_sigma_deg: given.attitude_sigma_deg,
            },
            height_sigma_ratio: given.height_sigma_ratio,
            time_s: given.time_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::View;
    use overfly_flight::locate::PositionPrior;

    fn refusal(json: &str) -> String {
        let parameters: FixParametersJson = serde_json::from_str(json).unwrap();
        FixParameters::from(&parameters).request("ortho").unwrap_err().parameter().unwrap().to_owned()
    }

    #[test]
    fn takes_the_two_ways_of_stating_scale() {
        let nadir: FixParametersJson = serde_json::from_str(r#"{"gsd_m_per_px": 5.5}"#).unwrap();
        let request = FixParameters::from(&nadir).request("ortho").unwrap();
        assert_eq!((request.position, request.heading), (PositionPrior::WholeLayer, None));
        let posed: FixParametersJson = serde_json::from_str(
            r#"{"latitude_deg": 47, "longitude_deg": 8, "sigma_m": 100, "heading_deg": 90, "height_m": 500, "pitch_deg": 3,
                "camera": {"width_px": 640, "height_px": 480, "focal_length_px": 700, "principal_point_px": [320, 240]}}"#,
        )
        .unwrap();
        assert!(matches!(FixParameters::from(&posed).request("ortho").unwrap().view, View::Posed { .. }));
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
            (r#"{"gsd_m_per_px": 1, "attitude_sigma_deg": 3}"#, "attitude_sigma_deg"),
        ] {
            assert_eq!(refusal(json), name, "{json}");
        }
        assert!(serde_json::from_str::<FixParametersJson>(r#"{"gsd": 1}"#).is_err());
    }
}
