//! The square world of Web Mercator: its width and the latitude at which it ends.

use super::wgs84::SEMI_MAJOR_M;
use std::f64::consts::PI;

/// The latitude at which the square world ends: atan(sinh(pi)), degrees.
pub const MAX_LATITUDE_DEG: f64 = 85.051_128_779_806_6;
/// Width of the world, metres of the projection: 2 pi a.
pub const WORLD_M: f64 = 2.0 * PI * SEMI_MAJOR_M;
