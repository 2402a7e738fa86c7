//! `GeodesyError`: why a position cannot be stated.

use super::world::MAX_LATITUDE_DEG;

/// Why a position cannot be stated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeodesyError {
    /// Latitude is NaN, infinite, or outside [-90, 90] degrees.
    #[error("latitude {latitude_deg} is not a number of degrees in [-90, 90]")]
    Latitude {
        /// The given latitude, degrees.
        latitude_deg: f64,
    },
    /// Longitude is NaN, infinite, or beyond one full turn.
    #[error("longitude {longitude_deg} is not a number of degrees in [-360, 360]")]
    Longitude {
        /// The given longitude, degrees.
        longitude_deg: f64,
    },
    /// Web Mercator ends at 85.05 degrees.
    #[error(
        "latitude {latitude_deg:.6} is beyond the tile matrix, which ends at {MAX_LATITUDE_DEG:.6} degrees; overfly does not serve the poles"
    )]
    BeyondMercator {
        /// The given latitude, degrees.
        latitude_deg: f64,
    },
    /// An offset leads beyond the visible half of the ellipsoid.
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
