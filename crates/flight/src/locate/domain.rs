//! `Domain`: the values that a parameter accepts, and the words for them.

use super::error::LocateError;
use overfly_core::camera::MAX_ATTITUDE_SIGMA_DEG;
use overfly_core::geodesy::MAX_LATITUDE_DEG;

/// An interval of accepted values.
#[derive(Debug, Clone, Copy)]
pub struct Domain {
    from: f64,
    to: f64,
    /// Whether `from` itself is refused.
    excludes_from: bool,
    /// Whether `to` itself is refused.
    excludes_to: bool,
    expected: &'static str,
}

impl Domain {
    const fn closed(from: f64, to: f64, expected: &'static str) -> Self {
        Self { from, to, excludes_from: false, excludes_to: false, expected }
    }

    /// Refuses a value outside the domain, NaN included.
    ///
    /// # Errors
    /// [`LocateError::Parameter`] with the parameter's name.
    pub fn check(&self, name: &'static str, value: f64) -> Result<(), LocateError> {
        let above = if self.excludes_from { value > self.from } else { value >= self.from };
        let below = if self.excludes_to { value < self.to } else { value <= self.to };
        if above && below {
            return Ok(());
        }
        Err(LocateError::Parameter { name, value, expected: self.expected })
    }
}

/// Latitude, degrees.
pub const LATITUDE: Domain = Domain::closed(
    -MAX_LATITUDE_DEG,
    MAX_LATITUDE_DEG,
    "must be degrees in [-85.051128, 85.051128], where the tile matrix ends",
);
/// Longitude, degrees.
pub const LONGITUDE: Domain = Domain::closed(-180.0, 180.0, "must be degrees in [-180, 180]");
/// Standard deviation of a position, or half the edge of a region, metres.
pub const METRES: Domain = Domain::closed(1e-3, 1e7, "must be metres in [0.001, 10000000]");
/// Correlation of east and north.
pub const CORRELATION: Domain = Domain::closed(-0.999, 0.999, "must lie in [-0.999, 0.999]");
/// Heading, degrees.
pub const HEADING: Domain =
    Domain { excludes_to: true, ..Domain::closed(0.0, 360.0, "must be degrees clockwise from true north in [0, 360)") };
/// Standard deviation of a heading, degrees. The bound allows for rounding from radians.
pub const HEADING_SIGMA: Domain =
    Domain { excludes_from: true, ..Domain::closed(0.0, 180.0 + 1e-9, "must be degrees in (0, 180]") };
/// Standard deviation of pitch and roll, degrees. The bound allows for rounding from radians.
pub const ATTITUDE_SIGMA: Domain = Domain::closed(0.0, MAX_ATTITUDE_SIGMA_DEG + 1e-9, "must be degrees in [0, 20]");
/// Standard deviation of height or ground sample distance, as a ratio.
pub const HEIGHT_SIGMA: Domain = Domain { excludes_from: true, ..Domain::closed(0.0, 0.3, "must lie in (0, 0.3]") };
/// Height above sea or ellipsoid, metres.
pub const ALTITUDE: Domain = Domain::closed(-1000.0, 100_000.0, "must be metres in [-1000, 100000]");
/// Ground sample distance and height: any positive number.
pub const POSITIVE: Domain =
    Domain { excludes_from: true, ..Domain::closed(0.0, f64::MAX, "must be a positive finite number") };
