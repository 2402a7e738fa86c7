//! `Geodetic`: a point on the ellipsoid's surface. Construction checks it, so a `Geodetic` is always finite.

use super::GeodesyError;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// A point on the WGS84 ellipsoid, height zero. Latitude in [-pi/2, pi/2], longitude in [-pi, pi). JSON spells it
/// `{"latitude_deg": 47.0, "longitude_deg": -99.1}`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Degrees", into = "Degrees")]
pub struct Geodetic {
    latitude_rad: f64,
    longitude_rad: f64,
}

/// A position as files and answers spell it.
#[derive(Serialize, Deserialize)]
struct Degrees {
    latitude_deg: f64,
    longitude_deg: f64,
}

impl TryFrom<Degrees> for Geodetic {
    type Error = GeodesyError;

    fn try_from(degrees: Degrees) -> Result<Self, GeodesyError> {
        Self::from_degrees(degrees.latitude_deg, degrees.longitude_deg)
    }
}

impl From<Geodetic> for Degrees {
    fn from(point: Geodetic) -> Self {
        Self { latitude_deg: point.latitude_deg(), longitude_deg: point.longitude_deg() }
    }
}

impl Geodetic {
    /// Makes the point at a geodetic latitude and longitude in degrees. Wraps the longitude to [-180, 180).
    ///
    /// # Errors
    /// [`GeodesyError::Latitude`] outside [-90, 90], [`GeodesyError::Longitude`] outside [-360, 360]; so for values that
    /// are not finite.
    ///
    /// # Example
    /// ```
    /// let p = overfly_core::geodesy::Geodetic::from_degrees(47.0, 190.0).unwrap();
    /// assert_eq!(p.longitude_deg(), -170.0);
    /// ```
    pub fn from_degrees(latitude_deg: f64, longitude_deg: f64) -> Result<Self, GeodesyError> {
        if !(-90.0..=90.0).contains(&latitude_deg) {
            return Err(GeodesyError::Latitude { latitude_deg });
        }
        if !(-360.0..=360.0).contains(&longitude_deg) {
            return Err(GeodesyError::Longitude { longitude_deg });
        }
        let wrapped_deg = (longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
        Ok(Self { latitude_rad: latitude_deg.to_radians(), longitude_rad: wrapped_deg.to_radians() })
    }

    /// Makes the point at a geodetic latitude and longitude in radians. Wraps the longitude to [-pi, pi).
    ///
    /// # Errors
    /// As [`Geodetic::from_degrees`].
    pub fn from_radians(latitude_rad: f64, longitude_rad: f64) -> Result<Self, GeodesyError> {
        const HALF_TURN: f64 = PI / 2.0;
        if !(-HALF_TURN..=HALF_TURN).contains(&latitude_rad) {
            return Err(GeodesyError::Latitude { latitude_deg: latitude_rad.to_degrees() });
        }
        if !(-TAU..=TAU).contains(&longitude_rad) {
            return Err(GeodesyError::Longitude { longitude_deg: longitude_rad.to_degrees() });
        }
        Ok(Self { latitude_rad, longitude_rad: (longitude_rad + PI).rem_euclid(TAU) - PI })
    }

    /// Latitude in radians, positive north.
    pub fn latitude_rad(self) -> f64 {
        self.latitude_rad
    }

    /// Longitude in radians, positive east, in [-pi, pi).
    pub fn longitude_rad(self) -> f64 {
        self.longitude_rad
    }

    /// Latitude in degrees, positive north.
    pub fn latitude_deg(self) -> f64 {
        self.latitude_rad.to_degrees()
    }

    /// Longitude in degrees, positive east, in [-180, 180).
    pub fn longitude_deg(self) -> f64 {
        self.longitude_rad.to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_written_and_read_in_degrees() {
        #[derive(Serialize, Deserialize)]
        struct Fix {
            #[serde(flatten)]
            position: Geodetic,
            score: f64,
        }
        let position = Geodetic::from_degrees(45.0, -90.0).unwrap();
        let text = toml::to_string(&Fix { position, score: 2.0 }).unwrap();
        assert_eq!(text, "latitude_deg = 45.0\nlongitude_deg = -90.0\nscore = 2.0\n");
        assert_eq!(toml::from_str::<Fix>(&text).unwrap().position, position);
        assert!(toml::from_str::<Fix>(&text.replace("45", "95")).is_err());
    }

    #[test]
    fn refuses_what_is_not_a_position() {
        assert!(Geodetic::from_degrees(f64::NAN, 0.0).is_err());
        assert!(Geodetic::from_degrees(90.1, 0.0).is_err());
        assert!(Geodetic::from_degrees(0.0, f64::INFINITY).is_err());
        assert!(Geodetic::from_degrees(0.0, 361.0).is_err());
    }
}
