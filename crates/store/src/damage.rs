//! `DamageLog`: the damaged tiles that were found while a store was served.

use overfly_core::tile::TileId;
use parking_lot::Mutex;
use serde::Serialize;
use std::collections::BTreeMap;

/// Largest number of tiles that are logged; further ones are not counted.
const LIMIT: usize = 1000;

/// The damaged tiles by layer and tile, each with the reason.
#[derive(Debug, Default)]
pub(super) struct DamageLog(Mutex<BTreeMap<(String, TileId), String>>);

/// The damage found so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Damage {
    /// Number of damaged tiles, counted up to 1000.
    pub tiles: usize,
    /// The first of them by layer, zoom, row and column, and the reason.
    pub first: Option<String>,
}

impl DamageLog {
    /// Records a damaged tile, and logs it the first time.
    pub fn record(&self, layer: &str, tile: TileId, reason: &str) {
        let mut tiles = self.0.lock();
        let key = (layer.to_owned(), tile);
        if tiles.len() < LIMIT && !tiles.contains_key(&key) {
            tracing::error!("tile {tile} of layer {layer} is damaged and no longer used: {reason}");
            tiles.insert(key, reason.to_owned());
        }
    }

    /// Returns a summary.
    pub fn summary(&self) -> Damage {
        let tiles = self.0.lock();
        let first = tiles.iter().next().map(|((layer, tile), why)| format!("tile {tile} of layer {layer}: {why}"));
        Damage { tiles: tiles.len(), first }
    }
}
