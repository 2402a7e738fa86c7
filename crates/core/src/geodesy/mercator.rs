//! Web Mercator (EPSG:3857): the plane of the tile matrix, and the true length on the ground of its metres.

use super::{GeodesyError, Geodetic, MAX_LATITUDE_DEG, SEMI_MAJOR_M, meridian_radius_m, normal_radius_m};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A point of the Web Mercator plane, metres of the projection (not of the ground), x east, y north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MercatorPoint {
    /// Distance east of Greenwich, in [-WORLD_M / 2, WORLD_M / 2) for points made from a `Geodetic`.
    pub x_m: f64,
    /// Distance north of the equator.
    pub y_m: f64,
}

impl MercatorPoint {
    /// Projects a point.
    ///
    /// # Errors
    /// [`GeodesyError::BeyondMercator`] beyond 85.05 degrees.
    pub fn from_geodetic(point: Geodetic) -> Result<Self, GeodesyError> {
        if point.latitude_deg().abs() > MAX_LATITUDE_DEG {
            return Err(GeodesyError::BeyondMercator { latitude_deg: point.latitude_deg() });
        }
        let y_m = SEMI_MAJOR_M * (FRAC_PI_4 + point.latitude_rad() / 2.0).tan().ln();
        Ok(Self { x_m: SEMI_MAJOR_M * point.longitude_rad(), y_m })
    }

    /// The point on the ellipsoid. x may lie any number of worlds away, because the longitude wraps.
    ///
    /// # Errors
    /// [`GeodesyError::Longitude`] where a coordinate is not finite.
    pub fn to_geodetic(self) -> Result<Geodetic, GeodesyError> {
        if !self.x_m.is_finite() || !self.y_m.is_finite() {
            return Err(GeodesyError::Longitude { longitude_deg: f64::NAN });
        }
        let latitude_rad = 2.0 * (self.y_m / SEMI_MAJOR_M).exp().atan() - FRAC_PI_2;
        let longitude_rad = (self.x_m / SEMI_MAJOR_M + PI).rem_euclid(2.0 * PI) - PI;
        Geodetic::from_radians(latitude_rad, longitude_rad)
    }
}

/// True ground metres per metre of the projection, separately towards east and north. They differ by up to 0.7 %, because
/// the Web Mercator projection of an ellipsoid is not conformal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundScale {
    /// Ground metres per projected metre towards east.
    pub east: f64,
    /// Ground metres per projected metre towards north.
    pub north: f64,
}

/// The ground scale at a latitude in radians, from the ellipsoid's radii.
///
/// # Example
/// At the equator the scale is 1 towards east and 1 - e^2 towards north.
/// ```
/// let s = overfly_core::geodesy::ground_scale(0.0);
/// assert!((s.east - 1.0).abs() < 1e-12 && (s.north - 0.993_305_62).abs() < 1e-8);
/// ```
pub fn ground_scale(latitude_rad: f64) -> GroundScale {
    let cos_lat = latitude_rad.cos();
    GroundScale {
        east: normal_radius_m(latitude_rad) * cos_lat / SEMI_MAJOR_M,
        north: meridian_radius_m(latitude_rad) * cos_lat / SEMI_MAJOR_M,
    }
}

/// Longitude and latitude, degrees, of a Mercator position, metres. Unlike in [`MercatorPoint::to_geodetic`], x = half a world stays 180
/// degrees.
pub fn degrees_from_mercator(x_m: f64, y_m: f64) -> [f64; 2] {
    let latitude_rad = (y_m / SEMI_MAJOR_M).sinh().atan();
    [(x_m / SEMI_MAJOR_M).to_degrees().clamp(-180.0, 180.0), latitude_rad.to_degrees()]
}

#[cfg(test)]
mod tests {
    use super::super::geodesic_between;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn comes_back_from_the_plane(lat in -85.0..85.0f64, lon in -180.0..180.0f64) {
            let p = Geodetic::from_degrees(lat, lon).unwrap();
            let q = MercatorPoint::from_geodetic(p).unwrap().to_geodetic().unwrap();
            prop_assert!(geodesic_between(p, q).distance_m < 1e-6);
        }

        #[test]
        fn a_projected_metre_is_as_long_on_the_ground_as_stated(lat in -84.0..84.0f64) {
            let p = Geodetic::from_degrees(lat, 7.0).unwrap();
            let m = MercatorPoint::from_geodetic(p).unwrap();
            let scale = ground_scale(p.latitude_rad());
            for (dx, dy, expected) in [(50.0, 0.0, scale.east), (0.0, 50.0, scale.north)] {
                let a = MercatorPoint { x_m: m.x_m - dx, y_m: m.y_m - dy }.to_geodetic().unwrap();
                let b = MercatorPoint { x_m: m.x_m + dx, y_m: m.y_m + dy }.to_geodetic().unwrap();
                prop_assert!((geodesic_between(a, b).distance_m / 100.0 - expected).abs() < 1e-6);
            }
        }
    }
}
