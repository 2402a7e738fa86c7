//! The measurements of the navigation filter: sensor readings, visual odometry, fixes.

use nalgebra::Matrix2;
use overfly_core::geodesy::{EnuCovariance, Geodetic, Heading};

/// The readings of compass and altimeter at one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorReading {
    /// Heading by the compass, radians clockwise from true north; not finite: no reading.
    pub heading_rad: f64,
    /// Height by the altimeter, metres above ground; not finite: no reading.
    pub height_m: f64,
}

/// Bounds of heights above ground that an altimeter can read, metres.
const HEIGHT_BOUNDS_M: (f64, f64) = (0.1, 100_000.0);
/// A heading of more turns than this is no heading, radians.
const MAX_HEADING_RAD: f64 = 100.0;

impl SensorReading {
    /// The reading with what no compass or altimeter can read taken out: a height of 0, a negative or a huge one, a heading of
    /// many turns.
    pub fn plausible(self) -> Self {
        let keep = |value: f64, is_kept: bool| if is_kept { value } else { f64::NAN };
        let (low, high) = HEIGHT_BOUNDS_M;
        Self {
            heading_rad: keep(self.heading_rad, self.heading_rad.abs() <= MAX_HEADING_RAD),
            height_m: keep(self.height_m, (low..=high).contains(&self.height_m)),
        }
    }

    /// The reading without what another reading lacks.
    pub(super) fn without(self, other: Self) -> Self {
        let keep = |value: f64, other: f64| if other.is_finite() { value } else { f64::NAN };
        Self { heading_rad: keep(self.heading_rad, other.heading_rad), height_m: keep(self.height_m, other.height_m) }
    }
}

/// Error model of compass and altimeter: a constant offset and white noise each, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorSigmas {
    /// Constant offset of the compass, radians.
    pub heading_offset_rad: f64,
    /// White noise of the compass at each image, radians; more than 0.
    pub heading_noise_rad: f64,
    /// Constant offset of the altimeter (and of the focal length), as a ratio of the height.
    pub height_offset_ratio: f64,
    /// White noise of the altimeter at each image, as a ratio of the height; more than 0.
    pub height_noise_ratio: f64,
}

/// A visual odometry increment: the displacement over ground between two images, in the axes of the first image and scaled
/// to a height of one metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryStep {
    /// Displacement to the right and ahead of the first image, metres per metre of height.
    pub per_height: [f64; 2],
    /// Covariance of [`OdometryStep::per_height`].
    pub covariance: Matrix2<f64>,
    /// Clockwise turn from the first image to the second, radians.
    pub turn_rad: f64,
    /// One standard deviation of the turn, radians.
    pub turn_sigma_rad: f64,
    /// Natural logarithm of the second height over the first.
    pub log_climb: f64,
    /// One standard deviation of [`OdometryStep::log_climb`].
    pub climb_sigma: f64,
}

impl OdometryStep {
    /// The step with the doubt that a turn by another angle, radians, raises: its direction may be wrong by as much.
    pub fn doubted(mut self, by_rad: f64) -> Self {
        let chord = 2.0 * (by_rad / 2.0).sin();
        let length = self.per_height[0].hypot(self.per_height[1]);
        self.covariance += Matrix2::identity() * (chord * length).powi(2);
        self.turn_sigma_rad = self.turn_sigma_rad.hypot(chord);
        self
    }
}

/// What a fix measures, as the navigation filter takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixMeasurement {
    /// The point that the stated attitude puts straight below the camera.
    pub position: Geodetic,
    /// Covariance of the position without the error of the attitude, which is common to all fixes.
    pub covariance: EnuCovariance,
    /// Heading.
    pub heading: Heading,
    /// One standard deviation of the heading, radians.
    pub heading_sigma_rad: f64,
    /// Natural logarithm of the height above ground in metres.
    pub log_height: f64,
    /// One standard deviation of [`FixMeasurement::log_height`].
    pub log_height_sigma: f64,
    /// Probability that the fix is false.
    pub false_probability: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absurd_reading_is_no_reading() {
        let reading = SensorReading { heading_rad: 1.0, height_m: 500.0 };
        assert_eq!(reading.plausible(), reading);
        for height_m in [0.0, -20.0, 1e9, f64::NAN, f64::INFINITY] {
            let kept = SensorReading { height_m, ..reading }.plausible();
            assert!(kept.height_m.is_nan() && kept.heading_rad == 1.0, "{height_m}");
        }
        for heading_rad in [1e6, f64::NAN, f64::NEG_INFINITY] {
            assert!(SensorReading { heading_rad, ..reading }.plausible().heading_rad.is_nan(), "{heading_rad}");
        }
    }
}

/// What tests of filters take for sensors.
#[cfg(test)]
pub mod fixtures {
    use super::{SensorReading, SensorSigmas};

    /// Their standard deviations.
    pub const SENSORS: SensorSigmas = SensorSigmas {
        heading_offset_rad: 0.05,
        heading_noise_rad: 0.05,
        height_offset_ratio: 0.03,
        height_noise_ratio: 0.03,
    };
    /// North, 500 m above ground.
    pub const READING: SensorReading = SensorReading { heading_rad: 0.0, height_m: 500.0 };
}
