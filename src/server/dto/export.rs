//! `ExportParameters` and `ExportProgress`: what an export is asked, and how far it is.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What shall be exported: as `overfly export` takes it.
#[derive(Debug, Clone, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExportParameters {
    /// GeoJSON with LineStrings, longitude first: the planned route, then its alternates.
    #[schema(value_type = Object)]
    pub route: serde_json::Value,
    /// W: the corridor on each side of the route, metres.
    #[schema(example = 1500.0)]
    pub corridor_m: f64,
    /// Layers to take; all where none is named.
    #[serde(default)]
    pub layers: Vec<String>,
    /// Most bytes of the file.
    pub max_bytes: Option<u64>,
    /// The JPEG quality, 1 to 100, to encode imagery with anew.
    #[schema(minimum = 1, maximum = 100)]
    pub jpeg_quality: Option<u8>,
    /// The last day on which it may be flown, YYYY-MM-DD.
    pub valid_until: Option<String>,
}

/// How far an export is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ExportProgress {
    /// Its name: of the store's digest and the request, so that asking for the same again is answered by the same file.
    pub id: String,
    /// Whether the file is there to be fetched.
    pub done: bool,
    /// Tiles written.
    pub tiles_done: u64,
    /// Tiles to write; 0 while they are being chosen.
    pub tiles: u64,
}
