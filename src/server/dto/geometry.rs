//! `GeometryJson`: a GeoJSON geometry.

use overfly_flight::locate::candidates::Geometry;
use serde::Serialize;
use utoipa::ToSchema;

/// A GeoJSON geometry (RFC 7946) in WGS84 degrees, longitude first.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Geometry)]
#[serde(tag = "type", content = "coordinates")]
pub(crate) enum GeometryJson {
    /// The rings of one polygon.
    Polygon(Vec<Vec<[f64; 2]>>),
    /// Several polygons; a region that crosses the antimeridian is cut there.
    MultiPolygon(Vec<Vec<Vec<[f64; 2]>>>),
}

impl From<Geometry> for GeometryJson {
    fn from(geometry: Geometry) -> Self {
        match geometry {
            Geometry::Polygon(rings) => Self::Polygon(rings),
            Geometry::MultiPolygon(polygons) => Self::MultiPolygon(polygons),
        }
    }
}
