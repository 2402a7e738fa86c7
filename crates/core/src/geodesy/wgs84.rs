//! The WGS84 ellipsoid: its constants and radii of curvature.

/// Semi-major axis a, metres (NGA.STND.0036, table 3.1).
pub const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening f (NGA.STND.0036, table 3.1).
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Semi-minor axis b = a (1 - f), metres.
pub const SEMI_MINOR_M: f64 = SEMI_MAJOR_M * (1.0 - FLATTENING);
/// First eccentricity squared, e^2 = f (2 - f).
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);

/// Radius of curvature in the prime vertical (east-west), metres, at a latitude in radians.
pub fn normal_radius_m(latitude_rad: f64) -> f64 {
    SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * latitude_rad.sin().powi(2)).sqrt()
}

/// Radius of curvature in the meridian (north-south), metres, at a latitude in radians.
pub fn meridian_radius_m(latitude_rad: f64) -> f64 {
    let w_squared = 1.0 - ECCENTRICITY_SQUARED * latitude_rad.sin().powi(2);
    SEMI_MAJOR_M * (1.0 - ECCENTRICITY_SQUARED) / (w_squared * w_squared.sqrt())
}
