//! `ExportParameters` and `ExportProgress`: what an export is asked, and its progress.

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use utoipa::ToSchema;

/// What to export, with the options of `overfly export`.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExportParameters {
    /// GeoJSON with LineStrings, longitude first: the planned route, then its alternates.
    #[schema(value_type = Object)]
    pub route: Box<RawValue>,
    /// W: the corridor on each side of the route, metres.
    #[schema(example = 1500.0)]
    pub corridor_m: f64,
    /// Layers to export; all layers if the list is empty.
    #[serde(default)]
    pub layers: Vec<String>,
    /// Largest size of the file, bytes.
    pub max_bytes: Option<u64>,
    /// Encode the imagery again with this JPEG quality, 1 to 100.
    #[schema(minimum = 1, maximum = 100)]
    pub jpeg_quality: Option<u8>,
    /// The last day on which the export may be flown, YYYY-MM-DD.
    pub valid_until: Option<String>,
}

/// The progress of an export.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ExportProgress {
    /// Name of the export, made from the store's digest and the request: equal requests get the same file.
    pub id: String,
    /// Whether the export has ended: fetch its file.
    pub done: bool,
    /// Number of tiles written.
    pub tiles_done: u64,
    /// Number of tiles to write; 0 while they are being selected.
    pub tiles: u64,
}
