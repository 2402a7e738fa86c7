//! The store: one GeoPackage. `Reader` asks, `Writer` (used by `build`) writes.

use crate::pixels::MaskedColour;
use crate::tile::{MercatorBounds, TileId};
use serde::Serialize;
use std::path::Path;

/// Why a store cannot be opened, read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The skeleton's placeholder.
    #[error("not built")]
    NotBuilt,
}

/// One epoch of imagery: a tile table of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layer {
    /// Its name, `ortho` by default.
    pub name: String,
    /// The finest level: what sources are warped to.
    pub base_zoom: u8,
    /// The coarsest overview.
    pub min_zoom: u8,
    /// Tiles at the base level.
    pub base_tiles: u64,
    /// Tiles at all levels.
    pub tiles: u64,
    /// Extent, degrees: west, south, east, north. West may exceed east: then it crosses the antimeridian.
    pub bounds_deg: [f64; 4],
    /// Earliest and latest acquisition date of its sources, where known.
    pub acquired: Option<(String, String)>,
    /// Whether its last build was finished; an unfinished layer answers nothing.
    pub complete: bool,
}

/// What is known of one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// Which tile.
    pub tile: TileId,
    /// BLAKE3 of its content.
    pub content_hash: [u8; 32],
    /// Newest acquisition date seen in it, ISO 8601, where known.
    pub acquired: Option<String>,
    /// Share of valid pixels.
    pub valid_fraction: f64,
    /// One standard deviation per axis of the map itself here, metres.
    pub horizontal_error_m: f64,
    /// Keypoints described in it.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
}

/// A tile's imagery as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedTile {
    /// "image/jpeg", "image/png" or "image/webp".
    pub media_type: &'static str,
    /// The file's bytes.
    pub bytes: Vec<u8>,
    /// BLAKE3 of the tile's content, for ETags.
    pub content_hash: [u8; 32],
}

/// A store opened for reading. `Send + Sync` (a pool of connections within); no method writes.
pub struct Reader {}

impl Reader {
    /// Opens a finished store for reading.
    pub fn open(_path: &Path) -> Result<Self, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// Opens it as the aircraft does: immutable, no locks, no side files, refused beside a non-empty `-wal` or `-journal`.
    pub fn open_onboard(_path: &Path) -> Result<Self, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// The layers, by name.
    pub fn layers(&self) -> &[Layer] {
        &[]
    }

    /// A complete layer by name.
    pub fn layer(&self, _name: &str) -> Result<&Layer, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// Footprints of one zoom whose exact bounds meet `bounds` (x may run past the antimeridian), by row and column:
    /// R-tree first, then the exact check.
    pub fn footprints_in(
        &self,
        _layer: &Layer,
        _zoom: u8,
        _bounds: &MercatorBounds,
    ) -> Result<Vec<Footprint>, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// Every footprint of one zoom (for a resident index).
    pub fn footprints(&self, _layer: &Layer, _zoom: u8) -> Result<Vec<Footprint>, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// A tile's imagery as stored, or `None` where the layer has no such tile.
    pub fn encoded_tile(&self, _layer: &Layer, _tile: TileId) -> Result<Option<EncodedTile>, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// A tile's pixels and mask, decoded.
    pub fn tile(&self, _layer: &Layer, _tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        Err(StoreError::NotBuilt)
    }

    /// A tile's descriptor blob (`feature::keypoint::from_blob`).
    pub fn descriptors(&self, _layer: &Layer, _tile: TileId) -> Result<Option<Vec<u8>>, StoreError> {
        Err(StoreError::NotBuilt)
    }
}
