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
    r#type: CoverageType,
    /// The layers, by name.
    features: Vec<CoveredLayerJson>,
}

/// A GeoJSON feature.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = CoveredLayer)]
pub(crate) struct CoveredLayerJson {
    /// "Feature".
    r#type: FeatureType,
    /// Disjoint rectangles that together cover the layer's tiles.
    geometry: GeometryJson,
    /// What the feature covers.
    properties: CoveragePropertiesJson,
}

/// The `type` of a feature collection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
enum CoverageType {
    FeatureCollection,
}

/// The `type` of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
enum FeatureType {
    Feature,
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
    #[schema(min_items = 2, max_items = 2)]
    acquired: Option<[String; 2]>,
}

impl From<Coverage> for CoverageJson {
    fn from(coverage: Coverage) -> Self {
        let features = coverage.features.into_iter().map(CoveredLayerJson::from).collect();
        Self { r#type: CoverageType::FeatureCollection, features }
    }
}

impl From<CoveredLayer> for CoveredLayerJson {
    fn from(layer: CoveredLayer) -> Self {
        Self { r#type: FeatureType::Feature, geometry: layer.geometry.into(), properties: layer.properties.into() }
    }
}

impl From<CoverageProperties> for CoveragePropertiesJson {
    fn from(properties: CoverageProperties) -> Self {
        let CoverageProperties { layer, zoom, tiles, acquired } = properties;
        Self { layer, zoom, tiles, acquired: acquired.map(<[String; 2]>::from) }
    }
}
