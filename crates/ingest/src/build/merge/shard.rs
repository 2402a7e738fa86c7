//! `Shard`: one store's part of a layer that is merged.

use crate::build::recipe::base_inputs;
use overfly_core::tile::TileId;
use overfly_store::{Footprint, Layer, LayerState, Reader, Source, StoreError, StoredTile, hex};
use std::collections::{HashMap, HashSet};

/// One store's part of a layer.
#[derive(Debug)]
pub struct Shard<'a> {
    pub reader: &'a Reader,
    pub layer: &'a Layer,
    /// Its sources, in covering order.
    pub sources: Vec<Source>,
    /// The base zoom that the user stated, if any.
    pub zoom_override: Option<u8>,
    /// The footprint of each of its tiles, overviews included.
    pub footprints: HashMap<TileId, Footprint>,
    /// The hash of each tile's inputs, empty tiles included.
    inputs: HashMap<TileId, [u8; 32]>,
    /// The content hashes of its sources.
    own: HashSet<[u8; 32]>,
    /// Indices of `sources` by hash, hexadecimal.
    indices: HashMap<String, usize>,
}

impl<'a> Shard<'a> {
    /// Reads a store's part of a layer; `None` where the store has no such layer.
    ///
    /// # Errors
    /// [`StoreError`] where the store is damaged.
    pub fn open(reader: &'a Reader, name: &str) -> Result<Option<Self>, StoreError> {
        let Some(layer) = reader.finished_layers().find(|l| l.name == name) else { return Ok(None) };
        let LayerState { inputs, zoom_override, .. } = LayerState::read(reader.path(), name)?;
        let footprints = reader.all_footprints(name)?.into_iter().map(|f| (f.tile, f)).collect();
        let sources = reader.sources(layer)?;
        let own = sources.iter().map(|s| s.content_hash).collect();
        let indices = sources.iter().enumerate().map(|(index, s)| (hex(&s.content_hash), index)).collect();
        Ok(Some(Self { reader, layer, sources, zoom_override, footprints, inputs, own, indices }))
    }

    /// The hash of a tile's content; `None` where the shard has no such tile.
    pub fn content(&self, tile: TileId) -> Option<[u8; 32]> {
        self.footprints.get(&tile).map(|f| f.content_hash)
    }

    /// Reads a tile that the shard has.
    ///
    /// # Errors
    /// [`StoreError`] where the tile is damaged.
    pub fn stored(&self, tile: TileId) -> Result<StoredTile, StoreError> {
        let gone = || StoreError::Changed { path: self.reader.path().into() };
        self.reader.stored_tile(self.layer, tile)?.ok_or_else(gone)
    }

    /// The sources whose pixels a tile shows, in covering order.
    pub fn seen(&self, tile: TileId) -> Vec<&Source> {
        let named = self.footprints.get(&tile).map_or("", |f| &f.sources).split(' ');
        let mut indices: Vec<usize> = named.filter_map(|name| self.indices.get(name).copied()).collect();
        indices.sort_unstable();
        indices.into_iter().map(|index| &self.sources[index]).collect()
    }

    /// Whether a source is one of the shard's.
    pub fn has(&self, source: &Source) -> bool {
        self.own.contains(&source.content_hash)
    }

    /// Whether a base tile, which may be empty, is what the current program makes of the shard's sources. `met_by` are the
    /// sources of all shards that meet the tile.
    pub fn is_current<'b>(&self, tile: TileId, met_by: impl Iterator<Item = &'b Source>) -> bool {
        let mut met = met_by.filter(|s| self.has(s)).peekable();
        met.peek().is_none() || self.inputs.get(&tile) == Some(&base_inputs(met, self.layer.terrain.is_some()))
    }
}
