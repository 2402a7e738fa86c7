//! Geodesics of the ellipsoid, by Karney's algorithm (`geographiclib-rs`).

use super::{GeodesyError, Geodetic};
use geographiclib_rs::{DirectGeodesic, InverseGeodesic};

/// The shortest line between two points of the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodesic {
    /// Length, metres.
    pub distance_m: f64,
    /// Azimuth at its start, radians clockwise from true north, in (-pi, pi].
    pub azimuth_rad: f64,
}

/// The geodesic from `start` to `end`. For equal points the azimuth is zero or pi.
///
/// # Example
/// From JFK to LHR, by GeographicLib's own documentation: 5551.759 km.
/// ```
/// use overfly_core::geodesy::{Geodetic, geodesic_between};
/// let jfk = Geodetic::from_degrees(40.6, -73.8).unwrap();
/// let lhr = Geodetic::from_degrees(51.6, -0.5).unwrap();
/// assert!((geodesic_between(jfk, lhr).distance_m - 5_551_759.4).abs() < 0.1);
/// ```
///
/// # References
/// C. F. F. Karney, Algorithms for geodesics, J. Geodesy 87, 43-55 (2013).
pub fn geodesic_between(start: Geodetic, end: Geodetic) -> Geodesic {
    let (distance_m, azimuth_deg, _, _) = geographiclib_rs::Geodesic::wgs84().inverse(
        start.latitude_deg(),
        start.longitude_deg(),
        end.latitude_deg(),
        end.longitude_deg(),
    );
    Geodesic { distance_m, azimuth_rad: f64::to_radians(azimuth_deg) }
}

/// The point reached from `start` after `geodesic.distance_m` metres at its azimuth.
///
/// # Errors
/// [`GeodesyError`] where the distance or azimuth is not finite.
pub fn destination(start: Geodetic, geodesic: Geodesic) -> Result<Geodetic, GeodesyError> {
    let (latitude_deg, longitude_deg) = geographiclib_rs::Geodesic::wgs84().direct(
        start.latitude_deg(),
        start.longitude_deg(),
        geodesic.azimuth_rad.to_degrees(),
        geodesic.distance_m,
    );
    Geodetic::from_degrees(latitude_deg, longitude_deg)
}
