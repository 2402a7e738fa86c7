//! Positions and frames on the WGS84 ellipsoid.
//!
//! Radians inside; degrees only through `*_deg` constructors and accessors. No I/O. What reads a CRS out of a file
//! lives in `raster`; here a CRS is already a code or a set of parameters.

mod enu;
mod geodesic;
mod geodetic;
mod mercator;
mod sphere;
mod wgs84;

pub use enu::{Enu, LocalFrame};
pub use geodesic::{Geodesic, destination, geodesic_between};
pub use geodetic::Geodetic;
pub use mercator::{GroundScale, MAX_LATITUDE_DEG, MercatorPoint, WORLD_M, ground_scale};
pub use sphere::{Pose, SPHERE_RADIUS_M, Sphere, Step, geocentric_from_image};
pub use wgs84::{ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M, SEMI_MINOR_M, meridian_radius_m, normal_radius_m};

/// Why a position cannot be stated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeodesyError {
    /// Latitude is NaN, infinite, or outside [-90, 90] degrees.
    #[error("latitude {latitude_deg} is not a number of degrees in [-90, 90]")]
    Latitude {
        /// What was given, degrees.
        latitude_deg: f64,
    },
    /// Longitude is NaN, infinite, or beyond one full turn.
    #[error("longitude {longitude_deg} is not a number of degrees in [-360, 360]")]
    Longitude {
        /// What was given, degrees.
        longitude_deg: f64,
    },
    /// Web Mercator ends at 85.05 degrees.
    #[error(
        "latitude {latitude_deg:.6} is beyond the tile matrix, which ends at {MAX_LATITUDE_DEG:.6} degrees; overfly does not serve the poles"
    )]
    BeyondMercator {
        /// What was given, degrees.
        latitude_deg: f64,
    },
    /// An offset that points off the visible half of the ellipsoid.
    #[error("an offset of {east_m:.0} m east, {north_m:.0} m north leaves the local frame")]
    OffLocalFrame {
        /// East component, metres.
        east_m: f64,
        /// North component, metres.
        north_m: f64,
    },
}

impl GeodesyError {
    /// A stable word for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Latitude { .. } => "latitude",
            Self::Longitude { .. } => "longitude",
            Self::BeyondMercator { .. } => "beyond_mercator",
            Self::OffLocalFrame { .. } => "off_local_frame",
        }
    }
}
