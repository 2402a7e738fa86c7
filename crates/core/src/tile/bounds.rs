//! Axis-aligned extents in the two coordinate systems that tiles have.

use serde::Serialize;

/// An extent of the Web Mercator plane, metres of the projection. `max_x_m` may exceed half a world for an extent
/// that crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MercatorBounds {
    /// Western edge.
    pub min_x_m: f64,
    /// Southern edge.
    pub min_y_m: f64,
    /// Eastern edge.
    pub max_x_m: f64,
    /// Northern edge.
    pub max_y_m: f64,
}

impl MercatorBounds {
    /// Whether the interiors meet (touching edges do not count).
    pub fn intersects(&self, other: &Self) -> bool {
        self.min_x_m < other.max_x_m
            && other.min_x_m < self.max_x_m
            && self.min_y_m < other.max_y_m
            && other.min_y_m < self.max_y_m
    }
}

/// An extent in degrees, west to east; never crosses the antimeridian (a tile cannot).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, utoipa::ToSchema)]
pub struct GeodeticBounds {
    /// Western edge, degrees.
    pub west: f64,
    /// Southern edge, degrees.
    pub south: f64,
    /// Eastern edge, degrees.
    pub east: f64,
    /// Northern edge, degrees.
    pub north: f64,
}
