//! `Answer`: a fix, or no fix and why.

use overfly_core::geodesy::{EnuCovariance, Geodetic, Heading};
use overfly_core::integrity::ErrorMixture;
use serde::Serialize;

/// A fix, or no fix and why.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// The frame was located.
    Fix(Fix),
    /// The frame was not located.
    NoFix(NoFix),
}

/// The map that an answer is from, and what else was searched for it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SearchedMap {
    /// Digest of the store, hexadecimal.
    pub store_digest: String,
    /// The layer that the answer is from: that of the fix, or, of several layers without a fix, the one that came nearest to one.
    pub layer: String,
    /// Newest acquisition date of the sources of that layer, where known.
    pub layer_date: Option<String>,
    /// The layers that were searched, in this order.
    pub layers_searched: Vec<String>,
    /// Number of layers that might have been searched: the number of false alarms counts all of them.
    pub layers_charged: usize,
}

/// Where the camera was when the frame was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// The point that `position_of` names.
    pub position: Geodetic,
    /// Which point the position is.
    pub position_of: PositionOf,
    /// Azimuth of the image's upper edge.
    pub heading: Heading,
    /// One standard deviation of the heading, radians.
    pub heading_sigma_rad: f64,
    /// Ground sample distance of the frame as measured, metres per pixel.
    pub gsd_m_per_px: f64,
    /// One standard deviation of the scale, as a ratio.
    pub scale_sigma_ratio: f64,
    /// Covariance of the position; the map's own error and the attitude's are included.
    pub covariance: EnuCovariance,
    /// z-score of the correlation peak: its height in standard deviations of the correlation surface.
    pub score: f64,
    /// Probability that a fix with this evidence is wrong: by chance, or because the frame lies at a place that fits almost as well.
    /// Never below 1.5e-4, which is what trials prove.
    pub false_fix_probability: f64,
    /// log10 of the number of false alarms with this evidence expected by chance in a search of this size, all layers that might have
    /// been searched included.
    pub log10_false_alarms: Option<f64>,
    /// The ground point at the centre of the image, which is what registration measures.
    pub image_centre: Geodetic,
    /// Covariance of `image_centre`; the map's own error is included.
    pub image_centre_covariance: EnuCovariance,
    /// The standard deviation of pitch and roll that `covariance` carries, radians; `None` where the position is the image's centre.
    pub attitude_sigma_rad: Option<f64>,
    /// Number of local windows that agree.
    pub inliers: usize,
    /// Number of base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// The paper's nominal count for this search.
    pub nominal_count: f64,
    /// The map's own error that the covariances carry, one standard deviation per axis, metres.
    pub map_error_m: f64,
    /// Whether the map states that error. Otherwise `map_error_m` is a default: half a pixel of the map, at least 3 m.
    pub map_error_known: bool,
    /// Newest acquisition date of the map at the nadir, where known.
    pub map_epoch: Option<String>,
    /// The map that was searched.
    pub map: SearchedMap,
    /// The request's image time, seconds.
    pub time_s: Option<f64>,
}

/// Which point of the ground a fix's position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionOf {
    /// The point straight below the camera.
    Nadir,
    /// The point at the centre of the image: no height is known, so the nadir cannot be told.
    ImageCentre,
}

/// Why the frame was not located.
#[derive(Debug, Clone, PartialEq)]
pub struct NoFix {
    /// The reason, a stable word.
    pub reason: Reason,
    /// The figures behind the reason, for people.
    pub detail: String,
    /// z-score of the best place, where a search was made.
    pub score: Option<f64>,
    /// log10 of the number of false alarms as good as the best place expected by chance in a search of this size, all layers that
    /// might have been searched included; absent where no place had windows that agree.
    pub log10_false_alarms: Option<f64>,
    /// Number of base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// The paper's nominal count for this search.
    pub nominal_count: f64,
    /// The map that was searched.
    pub map: SearchedMap,
    /// The request's image time, seconds.
    pub time_s: Option<f64>,
}

impl Fix {
    /// The radius around the position that its error exceeds without warning at most at an integrity risk, metres; `None` where the fix
    /// is false more often than that.
    pub fn protection_level_m(&self, integrity_risk: f64) -> Option<f64> {
        ErrorMixture::of_fix(self.covariance, self.false_fix_probability).protection_level_m(integrity_risk)
    }
}

impl Answer {
    /// The map that was searched.
    pub fn map(&self) -> &SearchedMap {
        match self {
            Self::Fix(fix) => &fix.map,
            Self::NoFix(none) => &none.map,
        }
    }

    /// The answer for the original of a frame in which `reduction` x `reduction` pixels were averaged to one.
    pub fn for_original(self, reduction: u32) -> Self {
        match self {
            Self::Fix(fix) => Self::Fix(Fix { gsd_m_per_px: fix.gsd_m_per_px / f64::from(reduction), ..fix }),
            none @ Self::NoFix(_) => none,
        }
    }
}

/// Why there is no fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The search region contains no map.
    OutsideMap,
    /// The frame shows too little structure.
    TooLittleStructure,
    /// The best place is not clearly better than a second one.
    Ambiguous,
    /// Too few local windows agree on one similarity.
    TooFewAgreeingWindows,
    /// The camera sees the horizon.
    HorizonInView,
    /// The similarity found, or the size of the frame on the map, contradicts the stated scale.
    InconsistentScale,
    /// The similarity found contradicts the stated heading.
    InconsistentHeading,
    /// The tilt that the windows show contradicts the stated attitude.
    InconsistentAttitude,
}

impl Reason {
    /// Its stable word, as in answers.
    pub fn word(self) -> &'static str {
        match self {
            Self::OutsideMap => "outside_map",
            Self::TooLittleStructure => "too_little_structure",
            Self::Ambiguous => "ambiguous",
            Self::TooFewAgreeingWindows => "too_few_agreeing_windows",
            Self::HorizonInView => "horizon_in_view",
            Self::InconsistentScale => "inconsistent_scale",
            Self::InconsistentHeading => "inconsistent_heading",
            Self::InconsistentAttitude => "inconsistent_attitude",
        }
    }
}
