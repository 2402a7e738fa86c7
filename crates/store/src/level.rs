//! `LevelDigests`: the digests of one level of a layer, so that a level can be verified alone.

use super::cells::TileCells;
use super::digest::{self, LevelOf};
use super::footprint::Footprint;
use super::hashing::hex;
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

impl LevelDigests {
    /// Computes the digests from footprints and cells, each by row and column.
    pub(super) fn from_rows(level: &LevelOf<'_>, footprints: &[Footprint], cells: &[TileCells]) -> Self {
        Self {
            zoom: level.zoom,
            tiles: footprints.len() as u64,
            footprints: hex(&digest::footprints_digest(level, footprints.iter())),
            cells: hex(&digest::cells_digest(cells)),
        }
    }
}
