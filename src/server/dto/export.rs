//! What an export is asked, what it would take, its progress, and how it is listed.

use crate::server::problem_code::ProblemCode;
use overfly_ingest::export::Preview;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use utoipa::ToSchema;

/// What to export, with the options of `overfly export`.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExportParameters {
    /// GeoJSON with LineStrings, longitude first: the planned route, then its alternates.
    #[schema(value_type = HashMap<String, Value>)]
    pub route: Box<RawValue>,
    /// W: the corridor on each side of the route, metres.
    #[schema(example = 1500.0)]
    pub corridor_m: f64,
    /// Layers to export; all layers if the list is empty.
    #[serde(default)]
    pub layers: Vec<String>,
    /// Largest size of the file, bytes.
    #[schema(minimum = 0)]
    pub max_bytes: Option<i64>,
    /// Encode the imagery again with this JPEG quality, 1 to 100.
    #[schema(minimum = 1, maximum = 100)]
    pub jpeg_quality: Option<u8>,
    /// The last day on which the export may be flown, YYYY-MM-DD.
    pub valid_until: Option<String>,
    /// The mission's name, which the manifest states.
    pub name: Option<String>,
    /// The serial number; an export that is to be signed needs one.
    #[schema(minimum = 0)]
    pub serial: Option<i64>,
    /// Answer what would be exported, and export nothing.
    #[serde(default)]
    pub dry_run: bool,
}

/// Whether an export has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ExportStatus {
    /// It is being written.
    UnderWay,
    /// Its file can be fetched.
    Done,
}

/// The `status` of the answer to a dry run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum PreviewStatus {
    Preview,
}

/// The progress of an export.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ExportProgress {
    /// "under_way" or "done".
    pub status: ExportStatus,
    /// Name of the export, made from the store's digest and the request: equal requests get the same file.
    pub id: String,
    /// Whether the export has ended: fetch its file.
    pub done: bool,
    /// Number of tiles written.
    pub tiles_done: u64,
    /// Number of tiles to write; 0 while they are being selected.
    pub tiles: u64,
}

/// An export that the service holds.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ExportEntry {
    /// Name of the export.
    pub id: String,
    /// Whether the export has ended.
    pub done: bool,
    /// Number of tiles written.
    pub tiles_done: u64,
    /// Number of tiles to write; 0 while they are being selected.
    pub tiles: u64,
    /// Size of the finished file, bytes.
    pub bytes: Option<u64>,
    /// Why the export failed, as a stable code word.
    #[schema(value_type = Option<ProblemCode>)]
    pub error: Option<&'static str>,
    /// Time since the export ended, seconds.
    pub age_s: Option<f64>,
}

/// The answer to a request for an export: its progress, or what it would take (`dry_run`). `status` says which.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(discriminator(property_name = "status", mapping(
    ("under_way" = "#/components/schemas/ExportProgress"),
    ("done" = "#/components/schemas/ExportProgress"),
    ("preview" = "#/components/schemas/ExportPreview"),
)))]
#[serde(untagged)]
pub(crate) enum ExportAnswer {
    Begun(ExportProgress),
    Preview(ExportPreview),
}

/// What an export would take: the answer to a dry run.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ExportPreview {
    /// "preview".
    status: PreviewStatus,
    /// Always true.
    dry_run: bool,
    /// The levels, by layer.
    parts: Vec<ExportPart>,
    /// Bytes of their content. Footprints, indexes and partly filled pages add to the size of the file.
    bytes: u64,
    /// How much of the corridor the map shows, by layer.
    coverage: Vec<ExportCoverage>,
    /// The corridor's width at its widest place, metres on each side.
    widest_m: f64,
}

/// What an export would take of one level of a layer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
struct ExportPart {
    /// The layer.
    layer: String,
    /// The zoom of the level.
    zoom: u8,
    /// Tiles taken.
    tiles: usize,
    /// Bytes of imagery.
    imagery: u64,
    /// Bytes of keypoint descriptors.
    descriptors: u64,
    /// Bytes of the wide search's cells.
    cells: u64,
}

/// How much of the corridor a layer shows.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
struct ExportCoverage {
    /// The layer.
    layer: String,
    /// Mean over the route, in [0, 1].
    mean: f64,
    /// Least along the route, in [0, 1].
    least: f64,
    /// Share of the route along which less than half is shown.
    poor_share: f64,
}

impl From<Preview> for ExportPreview {
    fn from(preview: Preview) -> Self {
        let part = |p: overfly_ingest::export::ExportedLevel| ExportPart {
            layer: p.layer,
            zoom: p.zoom,
            tiles: p.tiles,
            imagery: p.bytes.imagery,
            descriptors: p.bytes.descriptors,
            cells: p.bytes.cells,
        };
        let coverage = |c: overfly_ingest::export::CorridorCoverage| ExportCoverage {
            layer: c.layer,
            mean: c.mean,
            least: c.least,
            poor_share: c.poor_share,
        };
        Self {
            status: PreviewStatus::Preview,
            dry_run: true,
            parts: preview.parts.into_iter().map(part).collect(),
            bytes: preview.bytes,
            coverage: preview.coverage.into_iter().map(coverage).collect(),
            widest_m: preview.widest_m,
        }
    }
}
