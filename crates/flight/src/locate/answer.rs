//! What `locate` answers, as JSON spells it.

use serde::{Deserialize, Serialize};

/// A fix, or none and why. `status` is "fix" or "no_fix".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Answer {
    /// Located.
    Fix(Fix),
    /// Not located.
    NoFix(NoFix),
}

/// A position on the ground, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
}

/// Where the camera was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fix {
    /// Of the nadir, degrees.
    pub latitude_deg: f64,
    /// Of the nadir, degrees.
    pub longitude_deg: f64,
    /// Azimuth of the image's upper edge, degrees clockwise from true north, [0, 360).
    pub heading_deg: f64,
    /// One standard deviation, degrees.
    pub heading_sigma_deg: f64,
    /// Ground sample distance of the frame as found, metres per pixel.
    pub gsd_m_per_px: f64,
    /// One standard deviation of the scale, as a ratio.
    pub scale_sigma_ratio: f64,
    /// [[east-east, east-north], [east-north, north-north]], m^2; the map's own error included.
    pub covariance_m2: [[f64; 2]; 2],
    /// Strength of the evidence, in standard deviations of the correlation surface.
    pub score: f64,
    /// Probability that an accepted fix of this evidence is wrong.
    pub false_fix_probability: f64,
    /// log10 of the number of accidents as good as this one to expect in a search of this size.
    pub log10_false_alarms: Option<f64>,
    /// The ground in the middle of the image.
    pub image_centre: Point,
    /// Local windows that agree.
    pub inliers: usize,
    /// Base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// The paper's count for this search.
    pub nominal_count: f64,
    /// Newest acquisition date of the map there, where known.
    pub map_epoch: Option<String>,
    /// The request's image time.
    pub time_s: Option<f64>,
    /// From the decoded frame to this answer, milliseconds.
    pub elapsed_ms: f64,
}

/// No fix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoFix {
    /// A stable word.
    pub reason: Reason,
    /// For people: the figures behind the reason.
    pub detail: String,
    /// Best score seen, where a search was made.
    pub score: Option<f64>,
    /// log10 of the number of accidents as good as the best place to expect in a search of this size; absent where no
    /// place had windows that agree.
    pub log10_false_alarms: Option<f64>,
    /// Base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// The paper's count for this search.
    pub nominal_count: f64,
    /// The request's image time.
    pub time_s: Option<f64>,
    /// From the decoded frame to this answer, milliseconds.
    pub elapsed_ms: f64,
}

impl Answer {
    /// The answer for a frame of which `reduction` x `reduction` pixels were made one.
    pub fn in_pixels_of(self, reduction: u32) -> Self {
        match self {
            Self::Fix(fix) => Self::Fix(Fix { gsd_m_per_px: fix.gsd_m_per_px / f64::from(reduction), ..fix }),
            none @ Self::NoFix(_) => none,
        }
    }
}

/// Why there is no fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The search region holds no map.
    OutsideMap,
    /// The frame shows too little structure.
    TooLittleStructure,
    /// The best place is not clearly better than the rest.
    Ambiguous,
    /// Too few local windows agree on one similarity.
    TooFewAgreeingWindows,
    /// The similarity found contradicts the stated scale.
    InconsistentScale,
    /// The similarity found contradicts the stated heading.
    InconsistentHeading,
}
