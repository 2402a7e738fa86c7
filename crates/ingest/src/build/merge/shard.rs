//! `Shard`: one store's part of a layer that shall be merged.

use super::super::recipe::base_inputs;
use overfly_core::tile::TileId;
use overfly_store::{Footprint, Layer, LayerState, Reader, Source, StoreError, StoredTile, hex};
use std::collections::{HashMap, HashSet};

/// One store's part of a layer.
#[derive(Debug)]
pub struct Shard<'a> {
    pub reader: &'a Reader,
    pub layer: &'a Layer,
    /// What it is made of, in covering order.
    pub sources: Vec<Source>,
    /// The base zoom that the user stated, where so.
    pub zoom_override: Option<u8>,
    /// What is known of each of its tiles, overviews included.
    pub footprints: HashMap<TileId, Footprint>,
    /// What each of its tiles was made from, empty ones included.
    inputs: HashMap<TileId, [u8; 32]>,
    own: HashSet<[u8; 32]>,
    /// Places in `sources` by hash, hexadecimal.
    places: HashMap<String, usize>,
}

impl<'a> Shard<'a> {
    /// A store's part; `None` where it has no such layer.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn of(reader: &'a Reader, name: &str) -> Result<Option<Self>, StoreError> {
        let Some(layer) = reader.finished_layers().find(|l| l.name == name) else { return Ok(None) };
        let LayerState { inputs, zoom_override, .. } = LayerState::read(reader.path(), name)?;
        let footprints = reader.all_footprints(name)?.into_iter().map(|f| (f.tile, f)).collect();
        let sources = reader.sources(layer)?;
        let own = sources.iter().map(|s| s.content_hash).collect();
        let places = sources.iter().enumerate().map(|(place, s)| (hex(&s.content_hash), place)).collect();
        Ok(Some(Self { reader, layer, sources, zoom_override, footprints, inputs, own, places }))
    }

    /// The hash of a tile's content; `None` where it has no such tile.
    pub fn content(&self, tile: TileId) -> Option<[u8; 32]> {
        self.footprints.get(&tile).map(|f| f.content_hash)
    }

    /// A tile that it has.
    ///
    /// # Errors
    /// Where the tile is damaged.
    pub fn stored(&self, tile: TileId) -> Result<StoredTile, StoreError> {
        let gone = || StoreError::Changed { path: self.reader.path().into() };
        self.reader.stored_tile(self.layer, tile)?.ok_or_else(gone)
    }

    /// Its sources whose pixels are seen in a tile that it has, in covering order.
    pub fn seen(&self, tile: TileId) -> Vec<&Source> {
        let named = self.footprints.get(&tile).map_or("", |f| &f.sources).split(' ');
        let mut places: Vec<usize> = named.filter_map(|name| self.places.get(name).copied()).collect();
        places.sort_unstable();
        places.into_iter().map(|place| &self.sources[place]).collect()
    }

    /// Whether a source is one of its own.
    pub fn has(&self, source: &Source) -> bool {
        self.own.contains(&source.content_hash)
    }

    /// Whether a base tile (or that it is empty) is what its own among these sources make of it by this program's recipe.
    pub fn is_current<'b>(&self, tile: TileId, met_by: impl Iterator<Item = &'b Source>) -> bool {
        let mut met = met_by.filter(|s| self.has(s)).peekable();
        met.peek().is_none() || self.inputs.get(&tile) == Some(&base_inputs(met))
    }
}
