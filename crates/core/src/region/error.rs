//! `RegionError`: why a region cannot be computed, and the check of its parameters.

use super::uncertainty::{ImageOnGround, Uncertainty};
use crate::geodesy::GeodesyError;

/// The limit of a region's reach from its centre, metres. Within it the local plane is true to 0.04 %, and the pole lies
/// outside even at the last latitude served.
pub const MAX_REACH_M: f64 = 300_000.0;

/// Why a region cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// A length, angle or correlation is out of its range.
    #[error("{name} = {value}: expected {expected}")]
    Parameter {
        /// Its name in requests.
        name: &'static str,
        /// The given value; radians for `heading_rad`.
        value: f64,
        /// The accepted values.
        expected: &'static str,
    },
    /// The region reaches beyond [`MAX_REACH_M`].
    #[error(
        "the region reaches {reach_m:.0} m from its centre, the limit is {MAX_REACH_M} m: state less drift, uncertainty, speed or time"
    )]
    Reach {
        /// Distance from the centre to the farthest point of the region, metres.
        reach_m: f64,
    },
    /// The centre is beyond the tile matrix.
    #[error(transparent)]
    Position(#[from] GeodesyError),
}

impl RegionError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Parameter { .. } => "parameter_out_of_range",
            Self::Reach { .. } => "region_too_large",
            Self::Position(_) => "position_out_of_range",
        }
    }
}

/// Checks that sizes are positive, widths not negative, and all values finite.
pub(super) fn check(image: ImageOnGround, uncertainty: Uncertainty) -> Result<(), RegionError> {
    const LENGTH: &str = "metres, more than 0 and finite";
    const NOT_NEGATIVE: &str = "metres, at least 0 and finite";
    const TIME: &str = "seconds, more than 0 and finite";
    const SPEED: &str = "metres per second, more than 0 and finite";
    let require = |name, value: f64, accepted: bool, expected| {
        if accepted && value.is_finite() { Ok(()) } else { Err(RegionError::Parameter { name, value, expected }) }
    };
    let positive = |name, value: f64| require(name, value, value > 0.0, LENGTH);
    let positive_time = |name, value: f64| require(name, value, value > 0.0, TIME);
    let not_negative = |name, value: f64| require(name, value, value >= 0.0, NOT_NEGATIVE);
    positive("across_m", image.across_m)?;
    positive("along_m", image.along_m)?;
    require("heading_rad", image.heading_rad, true, "a finite angle")?;
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => {
            not_negative("inaccuracy_m", inaccuracy_m)?;
            not_negative("drift_m", drift_m)
        }
        Uncertainty::Parallel { inaccuracy_m, unit_drift_m, execution_s, relative_s } => {
            not_negative("inaccuracy_m", inaccuracy_m)?;
            not_negative("unit_drift_m", unit_drift_m)?;
            positive_time("execution_s", execution_s)?;
            positive_time("relative_s", relative_s)
        }
        Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, min_turn_radius_m } => {
            not_negative("inaccuracy_m", inaccuracy_m)?;
            require("speed_mps", speed_mps, speed_mps > 0.0, SPEED)?;
            positive_time("execution_s", execution_s)?;
            positive("min_turn_radius_m", min_turn_radius_m)
        }
        Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
            positive("sigma_east_m", sigma_east_m)?;
            positive("sigma_north_m", sigma_north_m)?;
            // With a correlation beyond this the ellipse is a line to double precision.
            require("correlation", correlation, correlation.abs() <= 0.999_999, "a number in [-0.999999, 0.999999]")
        }
    }
}
