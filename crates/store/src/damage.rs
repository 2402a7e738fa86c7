//! `DamageLog`: the tiles that were found damaged while a store was served.

use overfly_core::tile::TileId;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Most tiles that are kept by name; others are counted no more.
const MOST: usize = 1000;

/// Tiles found damaged, by layer and tile.
#[derive(Debug, Default)]
pub(super) struct DamageLog(Mutex<BTreeMap<(String, TileId), String>>);

/// What was found damaged so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, utoipa::ToSchema)]
pub struct Damage {
    /// How many tiles (counted up to 1000).
    pub tiles: usize,
    /// The first of them by layer, zoom, row and column, and what is wrong with it.
    pub first: Option<String>,
}

impl DamageLog {
    /// Notes a tile. Said once in the log.
    pub fn note(&self, layer: &str, tile: TileId, reason: &str) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (layer.to_owned(), tile);
        if kept.len() < MOST && !kept.contains_key(&key) {
            tracing::error!("tile {tile} of layer {layer} is damaged and is used no more: {reason}");
            kept.insert(key, reason.to_owned());
        }
    }

    /// What was noted.
    pub fn told(&self) -> Damage {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let first = kept.iter().next().map(|((layer, tile), why)| format!("tile {tile} of layer {layer}: {why}"));
        Damage { tiles: kept.len(), first }
    }
}
