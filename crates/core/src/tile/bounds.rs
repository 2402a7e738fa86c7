//! `MercatorBounds`: an axis-aligned extent of the Web Mercator plane.

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
    /// Whether the interiors overlap. Extents that only share an edge do not.
    pub fn intersects(&self, other: &Self) -> bool {
        self.min_x_m < other.max_x_m
            && other.min_x_m < self.max_x_m
            && self.min_y_m < other.max_y_m
            && other.min_y_m < self.max_y_m
    }
}
