//! `AnswerJson`: a fix, or no fix and why.

use super::hint::HintJson;
use super::stable_word::stable_word;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::{Answer, Fix, Hints, NoFix, PositionOf, Reason};
use serde::Serialize;
use utoipa::ToSchema;

/// A fix, or no fix with the reason. `status` is "fix" or "no_fix".
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Answer, discriminator(property_name = "status", mapping(
    ("fix" = "#/components/schemas/Fix"), ("no_fix" = "#/components/schemas/NoFix"),
)))]
#[serde(untagged)]
pub(crate) enum AnswerJson {
    Fix(FixJson),
    NoFix(NoFixJson),
}

/// The `status` of a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum FixStatus {
    Fix,
}

/// The `status` of an answer without a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum NoFixStatus {
    NoFix,
}

/// A position on the ground, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = Point)]
pub(crate) struct PointJson {
    /// Degrees north.
    latitude_deg: f64,
    /// Degrees east.
    longitude_deg: f64,
}

/// Where the camera was.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Fix)]
pub(crate) struct FixJson {
    /// "fix".
    status: FixStatus,
    /// Latitude of the point that `position_of` names, degrees north.
    latitude_deg: f64,
    /// Longitude of that point, degrees east.
    longitude_deg: f64,
    /// The point that position and covariance are of.
    position_of: PositionOfJson,
    /// Azimuth of the image's upper edge, degrees clockwise from true north, [0, 360).
    heading_deg: f64,
    /// One standard deviation of the heading, degrees.
    heading_sigma_deg: f64,
    /// Estimated ground sample distance of the frame, metres per pixel.
    gsd_m_per_px: f64,
    /// One standard deviation of the scale, as a ratio.
    scale_sigma_ratio: f64,
    /// [[east-east, east-north], [east-north, north-north]], m^2; the map's own error and the attitude's included.
    #[schema(min_items = 2, max_items = 2)]
    covariance_m2: [[f64; 2]; 2],
    /// The standard deviation of pitch and roll that `covariance_m2` carries, degrees, stated or assumed; null if no height is known.
    attitude_sigma_deg: Option<f64>,
    /// z-score of the best peak: its height in standard deviations of the correlation surface.
    score: f64,
    /// Probability that a fix with this evidence is wrong: by chance, or because the frame lies at a place that fits almost as well.
    /// Never below 1.5e-4, which is what trials prove.
    false_fix_probability: f64,
    /// The radius around the position that its error exceeds without warning at most with the probability `integrity_risk`, metres; null
    /// where the fix is false more often than that.
    protection_level_m: Option<f64>,
    /// The risk that `protection_level_m` is stated for.
    integrity_risk: f64,
    /// log10 of the number of equally good matches expected by chance in a search of this size (a contrario), all layers that might
    /// have been searched included.
    log10_false_alarms: Option<f64>,
    /// The ground at the centre of the image.
    image_centre: PointJson,
    /// Covariance of `image_centre`, m^2, as `covariance_m2`; what registration measures, whatever the attitude.
    #[schema(min_items = 2, max_items = 2)]
    image_centre_covariance_m2: [[f64; 2]; 2],
    /// Number of local windows that agree.
    inliers: usize,
    /// Number of base tiles whose imagery was searched.
    tiles_searched: usize,
    /// The paper's count for this search.
    nominal_count: f64,
    /// The map's own error that the covariances carry, one standard deviation per axis, metres.
    map_error_m: f64,
    /// Whether the map states that error. If not, `map_error_m` is a default: half a pixel of the map, at least 3 m.
    map_error_known: bool,
    /// Newest acquisition date of the map there, if known.
    map_epoch: Option<String>,
    /// The layer that the answer is from: that of the fix, or, of several layers without a fix, the one that came nearest to one.
    layer: String,
    /// Newest acquisition date of the sources of that layer, if known.
    layer_date: Option<String>,
    /// Digest of the store, hexadecimal.
    store_digest: String,
    /// The layers that were searched, in this order. One, unless the request asks for `any`.
    layers_searched: Vec<String>,
    /// Number of layers that might have been searched: `log10_false_alarms` counts all of them.
    layers_charged: usize,
    /// The image time of the request.
    time_s: Option<f64>,
    /// Time from the decoded frame to this answer, milliseconds.
    elapsed_ms: f64,
}

/// Which point of the ground a fix's position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = PositionOf)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PositionOfJson {
    /// The point straight below the camera.
    Nadir,
    /// The point at the centre of the image, if no height is known.
    ImageCentre,
}

/// No fix.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = NoFix)]
pub(crate) struct NoFixJson {
    /// "no_fix".
    status: NoFixStatus,
    /// A stable word for the reason.
    reason: ReasonJson,
    /// The figures behind the reason, for people.
    detail: String,
    /// The best score, if a search was made.
    score: Option<f64>,
    /// log10 of the number of equally good matches expected by chance in a search of this size; absent if no place had windows that
    /// agree.
    log10_false_alarms: Option<f64>,
    /// Number of base tiles whose imagery was searched.
    tiles_searched: usize,
    /// The paper's count for this search.
    nominal_count: f64,
    /// The layer that the answer is from: that of the fix, or, of several layers without a fix, the one that came nearest to one.
    layer: String,
    /// Newest acquisition date of the sources of that layer, if known.
    layer_date: Option<String>,
    /// Digest of the store, hexadecimal.
    store_digest: String,
    /// The layers that were searched, in this order. One, unless the request asks for `any`.
    layers_searched: Vec<String>,
    /// Number of layers that might have been searched: `log10_false_alarms` counts all of them.
    layers_charged: usize,
    /// The image time of the request.
    time_s: Option<f64>,
    /// Time from the decoded frame to this answer, milliseconds, without the search for hints.
    elapsed_ms: f64,
    /// What to check in the request: absent unless hints were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    hints: Option<Vec<HintJson>>,
    /// Whether all hints were tried: false if the time was up or another registration waited. Absent without `hints`.
    #[serde(skip_serializing_if = "Option::is_none")]
    hints_complete: Option<bool>,
}

/// Why there is no fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = Reason)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ReasonJson {
    /// There is no map in the search region.
    OutsideMap,
    /// The frame shows too little structure.
    TooLittleStructure,
    /// The best place is not clearly better than the others.
    Ambiguous,
    /// Too few local windows agree on one similarity.
    TooFewAgreeingWindows,
    /// The camera sees the horizon.
    HorizonInView,
    /// The estimated similarity, or the size of the frame on the map, contradicts the given scale.
    InconsistentScale,
    /// The estimated similarity contradicts the given heading.
    InconsistentHeading,
    /// The tilt that the windows show contradicts the given attitude, or its default.
    InconsistentAttitude,
}

impl AnswerJson {
    /// Makes the reply of an answer that took `elapsed_ms` milliseconds, with the protection level for a risk.
    pub(crate) fn new(answer: Answer, elapsed_ms: f64, integrity_risk: f64) -> Self {
        match answer {
            Answer::Fix(fix) => Self::Fix(FixJson::new(fix, elapsed_ms, integrity_risk)),
            Answer::NoFix(no_fix) => Self::NoFix(NoFixJson::new(no_fix, elapsed_ms)),
        }
    }

    /// Why there is no fix, as a stable word; `None` for a fix.
    pub(crate) fn no_fix_reason(&self) -> Option<String> {
        match self {
            Self::Fix(_) => None,
            Self::NoFix(no_fix) => Some(stable_word(&no_fix.reason)),
        }
    }

    /// Time from the decoded frame to this answer, seconds.
    pub(crate) fn elapsed_s(&self) -> f64 {
        let (Self::Fix(FixJson { elapsed_ms, .. }) | Self::NoFix(NoFixJson { elapsed_ms, .. })) = self;
        elapsed_ms / 1e3
    }

    /// The same reply with hints, if they were searched for; a fix has none. `spell` gives the name of a parameter as the user knows it.
    pub(crate) fn with_hints(self, hints: Option<Hints>, spell: impl Fn(&str) -> String) -> Self {
        match (self, hints) {
            (Self::NoFix(no_fix), Some(hints)) => Self::NoFix(NoFixJson {
                hints: Some(hints.found.into_iter().map(|hint| HintJson::new(hint, &spell)).collect()),
                hints_complete: Some(hints.is_complete),
                ..no_fix
            }),
            (answer, _) => answer,
        }
    }
}

impl From<Geodetic> for PointJson {
    fn from(point: Geodetic) -> Self {
        Self { latitude_deg: point.latitude_deg(), longitude_deg: point.longitude_deg() }
    }
}

impl FixJson {
    fn new(fix: Fix, elapsed_ms: f64, integrity_risk: f64) -> Self {
        Self {
            protection_level_m: fix.protection_level_m(integrity_risk),
            integrity_risk,
            status: FixStatus::Fix,
            latitude_deg: fix.position.latitude_deg(),
            longitude_deg: fix.position.longitude_deg(),
            position_of: fix.position_of.into(),
            heading_deg: fix.heading.degrees(),
            heading_sigma_deg: fix.heading_sigma_rad.to_degrees(),
            gsd_m_per_px: fix.gsd_m_per_px,
            scale_sigma_ratio: fix.scale_sigma_ratio,
            covariance_m2: fix.covariance.into(),
            attitude_sigma_deg: fix.attitude_sigma_rad.map(f64::to_degrees),
            score: fix.score,
            false_fix_probability: fix.false_fix_probability,
            log10_false_alarms: fix.log10_false_alarms,
            image_centre: fix.image_centre.into(),
            image_centre_covariance_m2: fix.image_centre_covariance.into(),
            inliers: fix.inliers,
            tiles_searched: fix.tiles_searched,
            nominal_count: fix.nominal_count,
            map_error_m: fix.map_error_m,
            map_error_known: fix.map_error_known,
            map_epoch: fix.map_epoch,
            layer: fix.map.layer,
            layer_date: fix.map.layer_date,
            store_digest: fix.map.store_digest,
            layers_searched: fix.map.layers_searched,
            layers_charged: fix.map.layers_charged,
            time_s: fix.time_s,
            elapsed_ms,
        }
    }
}

impl NoFixJson {
    fn new(no_fix: NoFix, elapsed_ms: f64) -> Self {
        Self {
            status: NoFixStatus::NoFix,
            reason: no_fix.reason.into(),
            detail: no_fix.detail,
            score: no_fix.score,
            log10_false_alarms: no_fix.log10_false_alarms,
            tiles_searched: no_fix.tiles_searched,
            nominal_count: no_fix.nominal_count,
            layer: no_fix.map.layer,
            layer_date: no_fix.map.layer_date,
            store_digest: no_fix.map.store_digest,
            layers_searched: no_fix.map.layers_searched,
            layers_charged: no_fix.map.layers_charged,
            time_s: no_fix.time_s,
            elapsed_ms,
            hints: None,
            hints_complete: None,
        }
    }
}

impl From<PositionOf> for PositionOfJson {
    fn from(point: PositionOf) -> Self {
        match point {
            PositionOf::Nadir => Self::Nadir,
            PositionOf::ImageCentre => Self::ImageCentre,
        }
    }
}

impl From<Reason> for ReasonJson {
    fn from(reason: Reason) -> Self {
        match reason {
            Reason::OutsideMap => Self::OutsideMap,
            Reason::TooLittleStructure => Self::TooLittleStructure,
            Reason::Ambiguous => Self::Ambiguous,
            Reason::TooFewAgreeingWindows => Self::TooFewAgreeingWindows,
            Reason::HorizonInView => Self::HorizonInView,
            Reason::InconsistentScale => Self::InconsistentScale,
            Reason::InconsistentHeading => Self::InconsistentHeading,
            Reason::InconsistentAttitude => Self::InconsistentAttitude,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_one_word() {
        let reasons = [
            Reason::OutsideMap,
            Reason::TooLittleStructure,
            Reason::Ambiguous,
            Reason::TooFewAgreeingWindows,
            Reason::HorizonInView,
            Reason::InconsistentScale,
            Reason::InconsistentHeading,
            Reason::InconsistentAttitude,
        ];
        for reason in reasons {
            assert_eq!(stable_word(&ReasonJson::from(reason)), reason.word());
            assert_eq!(stable_word(&reason), reason.word());
        }
    }
}
