//! `GeometryJson`: a GeoJSON geometry.

use overfly_flight::locate::candidates::Geometry;
use serde::Serialize;
use utoipa::ToSchema;

/// A GeoJSON geometry (RFC 7946) in WGS84 degrees, longitude first.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Geometry, discriminator(property_name = "type", mapping(
    ("Polygon" = "#/components/schemas/Polygon"), ("MultiPolygon" = "#/components/schemas/MultiPolygon"),
)))]
#[serde(untagged)]
pub(crate) enum GeometryJson {
    Polygon(PolygonJson),
    MultiPolygon(MultiPolygonJson),
}

/// One polygon.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Polygon)]
pub(crate) struct PolygonJson {
    /// "Polygon".
    r#type: PolygonType,
    /// The rings, closed: positions as longitude, latitude.
    coordinates: Vec<Vec<[f64; 2]>>,
}

/// Several polygons; a region that crosses the antimeridian is cut there.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = MultiPolygon)]
pub(crate) struct MultiPolygonJson {
    /// "MultiPolygon".
    r#type: MultiPolygonType,
    /// The rings of each polygon, closed: positions as longitude, latitude.
    coordinates: Vec<Vec<Vec<[f64; 2]>>>,
}

/// The `type` of one polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
enum PolygonType {
    Polygon,
}

/// The `type` of several polygons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
enum MultiPolygonType {
    MultiPolygon,
}

impl From<Geometry> for GeometryJson {
    fn from(geometry: Geometry) -> Self {
        match geometry {
            Geometry::Polygon(coordinates) => Self::Polygon(PolygonJson { r#type: PolygonType::Polygon, coordinates }),
            Geometry::MultiPolygon(coordinates) => {
                Self::MultiPolygon(MultiPolygonJson { r#type: MultiPolygonType::MultiPolygon, coordinates })
            }
        }
    }
}
