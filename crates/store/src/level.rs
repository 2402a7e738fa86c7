//! `LevelDigests`: what one level of a layer hashes to, so that it verifies alone.

use super::cells::TileCells;
use super::digest;
use super::footprint::Footprint;
use serde::{Deserialize, Serialize};

/// One level of a layer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelDigests {
    /// Zoom.
    pub zoom: u8,
    /// Tiles.
    pub tiles: u64,
    /// Of its footprints, each of which states its tile's content hash; hexadecimal.
    pub footprints: String,
    /// Of its cells, hexadecimal.
    pub cells: String,
}

impl LevelDigests {
    /// Of footprints and cells of one level, each by row and column.
    pub(super) fn of(zoom: u8, footprints: &[Footprint], cells: &[TileCells]) -> Self {
        Self {
            zoom,
            tiles: footprints.len() as u64,
            footprints: digest::hex(&digest::footprints_digest(footprints.iter())),
            cells: digest::hex(&digest::cells_digest(cells)),
        }
    }
}
