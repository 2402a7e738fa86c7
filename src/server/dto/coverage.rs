//! `CoverageJson`: where each layer has imagery.

use super::geometry::GeometryJson;
use overfly_flight::locate::coverage::{Coverage, CoverageProperties, CoveredLayer};
use serde::Serialize;
use utoipa::ToSchema;

/// A GeoJSON feature collection, a feature a finished layer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Coverage)]
pub(crate) struct CoverageJson {
    /// "FeatureCollection".
    r#type: &'static str,
    /// By layer name.
    features: Vec<CoveredLayerJson>,
}

/// A GeoJSON feature.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = CoveredLayer)]
pub(crate) struct CoveredLayerJson {
    /// "Feature".
    r#type: &'static str,
    /// Disjoint rectangles that together are the layer's tiles.
    geometry: GeometryJson,
    /// What is covered.
    properties: CoveragePropertiesJson,
}

/// What a feature of the coverage says of its layer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = CoverageProperties)]
pub(crate) struct CoveragePropertiesJson {
    /// The layer.
    layer: String,
    /// The level whose tiles are drawn: the base level, or a coarser one where that is too ragged.
    zoom: u8,
    /// Tiles at that level.
    tiles: usize,
    /// Earliest and latest acquisition date, where known.
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
