//! `Geodetic`: a point on the ellipsoid's surface. Checked at construction, so a `Geodetic` is always finite.

use super::GeodesyError;
use std::f64::consts::{PI, TAU};

/// A point on the WGS84 ellipsoid, height zero. Latitude in [-pi/2, pi/2], longitude in [-pi, pi).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    latitude_rad: f64,
    longitude_rad: f64,
}

impl Geodetic {
    /// The point at geodetic latitude and longitude in degrees; longitude is wrapped to [-180, 180).
    ///
    /// # Errors
    /// Latitude outside [-90, 90], longitude outside [-360, 360], or either not finite.
    ///
    /// # Example
    /// ```
    /// let p = crate::geodesy::Geodetic::from_degrees(47.0, 190.0).unwrap();
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

    /// The point at geodetic latitude and longitude in radians; longitude is wrapped to [-pi, pi).
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
    fn refuses_what_is_not_a_position() {
        assert!(Geodetic::from_degrees(f64::NAN, 0.0).is_err());
        assert!(Geodetic::from_degrees(90.1, 0.0).is_err());
        assert!(Geodetic::from_degrees(0.0, f64::INFINITY).is_err());
        assert!(Geodetic::from_degrees(0.0, 361.0).is_err());
    }
}
