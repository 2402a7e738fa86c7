//! `CoverageJson`: where each layer has imagery.

use super::geometry::GeometryJson;
use overfly_flight::locate::coverage::{Coverage, CoverageProperties, CoveredLayer};
use serde::Serialize;
use utoipa::ToSchema;

/// A GeoJSON feature collection with one feature for each finished layer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Coverage)]
pub(crate) struct CoverageJson {
    /// "FeatureCollection".
    r#type: &'static str,
    /// The layers, by name.
    features: Vec<CoveredLayerJson>,
}

/// A GeoJSON feature.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = CoveredLayer)]
pub(crate) struct CoveredLayerJson {
    /// "Feature".
    r#type: &'static str,
    /// Disjoint rectangles that together cover the layer's tiles.
    geometry: GeometryJson,
    /// What the feature covers.
    properties: CoveragePropertiesJson,
}

/// The layer of a feature.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = CoverageProperties)]
pub(crate) struct CoveragePropertiesJson {
    /// Name of the layer.
    layer: String,
    /// The level whose tiles are drawn: the base level, or a coarser one if the base level has too many rectangles.
    zoom: u8,
    /// Number of tiles at that level.
    tiles: usize,
    /// Earliest and latest acquisition date, if known.
    acquired: Option<(String, String)>,
}

impl From<Coverage> for CoverageJson {
    fn from(coverage: Coverage) -> Self {
        let features = coverage.features.into_iter().map(CoveredLayerJson::from).collect();
        Self { r#type: coverage.r#type, features }
    }
}

impl From<CoveredLayer> for CoveredLayerJson {
    fn from(layer: CoveredLayer) -> Self {
        Self { r#type: layer.r#type, geometry: layer.geometry.into(), properties: layer.properties.into() }
    }
}

impl From<CoverageProperties> for CoveragePropertiesJson {
    fn from(properties: CoverageProperties) -> Self {
        let CoverageProperties { layer, zoom, tiles, acquired } = properties;
        Self { layer, zoom, tiles, acquired }
    }
}
