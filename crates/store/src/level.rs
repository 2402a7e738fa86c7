//! `LevelDigests`: the digests of one level of a layer, so that a level can be verified alone.

use super::cells::TileCells;
use super::digest;
use super::footprint::Footprint;
use serde::{Deserialize, Serialize};

/// The digests of one level of a layer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelDigests {
    /// Zoom of the level.
    pub zoom: u8,
    /// Number of tiles.
    pub tiles: u64,
    /// Digest of the footprints, hexadecimal. Each footprint states the content hash of its tile.
    pub footprints: String,
    /// Digest of the cells, hexadecimal.
    pub cells: String,
}

/// A level of a layer, in a store of a format version.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelOf<'a> {
    pub layer: &'a str,
    pub zoom: u8,
    pub version: u32,
}

impl LevelDigests {
    /// Computes the digests from footprints and cells, each by row and column.
    pub(super) fn from_rows(level: &LevelOf<'_>, footprints: &[Footprint], cells: &[TileCells]) -> Self {
        Self {
            zoom: level.zoom,
            tiles: footprints.len() as u64,
            footprints: digest::hex(&digest::footprints_digest(level, footprints.iter())),
            cells: digest::hex(&digest::cells_digest(cells)),
        }
    }
}
