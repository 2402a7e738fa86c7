//! `Union`: a layer of several stores. It has the sources of all; a tile is taken unchanged where the stores agree, and
//! blended otherwise.

use super::blend::blend;
use super::error::MergeError;
use super::merged::MergedLayer;
use super::request::Conflict;
use super::shard::Shard;
use crate::build::build_plan::{cover, tile_inputs};
use crate::build::composite::TileFailure;
use crate::build::overview::shrink;
use overfly_core::tile::TileId;
use overfly_store::{Extract, LayerHead, Source, StoreError, StoredTile, Terms, Terrain};
use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap, HashSet};

/// A merged layer to write.
pub struct Union<'a> {
    head: LayerHead,
    shards: Vec<Shard<'a>>,
    conflict: Conflict,
    /// All sources, in covering order.
    sources: Vec<Source>,
    /// Base tiles and the sources that meet each, in covering order.
    cover: BTreeMap<TileId, Vec<usize>>,
    /// The hash of each tile's inputs in a build of all sources.
    required: HashMap<TileId, [u8; 32]>,
    /// Overviews by level, finest first.
    levels: Vec<Vec<TileId>>,
}

/// The part of a layer that is written.
#[derive(Default)]
struct WrittenPart {
    contents: HashMap<TileId, [u8; 32]>,
    /// Tiles that a build of all sources would make equally.
    exact: HashSet<TileId>,
    summary: MergedLayer,
}

impl<'a> Union<'a> {
    /// Makes the union of the stores' parts of a layer, in the order in which the stores were named.
    ///
    /// # Errors
    /// [`MergeError`] where zooms or declarations of a source differ, or tiles do and the request refuses that.
    pub fn new(name: &str, shards: Vec<Shard<'a>>, conflict: Conflict) -> Result<Self, MergeError> {
        let base_zoom = common_zoom(name, &shards)?;
        let sources = all_sources(name, &shards)?;
        let cover = cover(&sources, base_zoom)?;
        let terrain = common_terrain(name, &shards)?;
        let (required, levels) = tile_inputs(&sources, &cover, terrain.is_some());
        let stated = shards.iter().any(|s| s.zoom_override.is_some());
        let min_zoom = base_zoom - levels.len() as u8;
        let terms = shards.iter().fold(Terms::default(), |terms, shard| terms.or(&shard.layer.terms));
        let zoom_override = stated.then_some(base_zoom);
        let head = LayerHead { name: name.into(), base_zoom, min_zoom, zoom_override, terms, terrain };
        let union = Self { head, shards, conflict, sources, cover, required, levels };
        if conflict == Conflict::Refuse {
            union.refuse_conflicts()?;
        }
        Ok(union)
    }

    /// Returns the number of tiles to process.
    pub fn jobs(&self) -> u64 {
        (self.cover.len() + self.levels.iter().map(Vec::len).sum::<usize>()) as u64
    }

    /// Writes the layer; `progress` is called after each tile.
    ///
    /// # Errors
    /// [`MergeError`] where a tile is damaged or the disk is full.
    pub fn write(&self, to: &Extract, progress: &mut dyn FnMut()) -> Result<MergedLayer, MergeError> {
        let mut written = WrittenPart::default();
        (written.summary.layer, written.summary.stores) = (self.head.name.clone(), self.shards.len());
        to.begin_layer(&self.head)?;
        for (tile, met_by) in &self.cover {
            self.base(*tile, met_by, to, &mut written)?;
            progress();
        }
        for tile in self.levels.iter().flatten() {
            self.overview(*tile, to, &mut written)?;
            progress();
        }
        for tile in &written.exact {
            to.put_inputs(&self.head.name, *tile, &self.required[tile])?;
        }
        to.end_layer(&self.head, self.sources.clone())?;
        Ok(written.summary)
    }

    fn base(&self, tile: TileId, met_by: &[usize], to: &Extract, written: &mut WrittenPart) -> Result<(), MergeError> {
        let holders = self.holders(tile);
        let mut exact = self.is_current(tile, met_by);
        let Some(first) = holders.first() else {
            if exact {
                written.exact.insert(tile);
            }
            return Ok(());
        };
        let stored = if holders.iter().all(|h| h.content(tile) == first.content(tile)) {
            written.summary.taken_tiles += 1;
            first.stored(tile)?
        } else {
            let blended = blend(tile, &holders, self.head.terrain.is_some())?;
            exact &= blended.exact;
            written.summary.blended_tiles += 1;
            blended.tile
        };
        if exact && self.is_ordered(&holders, met_by) {
            written.exact.insert(tile);
        }
        Ok(self.put(to, stored, written)?)
    }

    /// Writes an overview: a store's, where the tiles below it are the same there, or a new one.
    fn overview(&self, tile: TileId, to: &Extract, written: &mut WrittenPart) -> Result<(), MergeError> {
        let children = tile.children().expect("an overview has children");
        if children.iter().all(|c| !self.required.contains_key(c) || written.exact.contains(c)) {
            written.exact.insert(tile);
        }
        let below = children.map(|child| written.contents.get(&child).copied());
        if below.iter().all(Option::is_none) {
            return Ok(());
        }
        let same = |s: &&Shard<'_>| s.content(tile).is_some() && children.map(|child| s.content(child)) == below;
        let stored = match self.shards.iter().find(same) {
            Some(shard) => {
                written.summary.taken_tiles += 1;
                shard.stored(tile)?
            }
            None => {
                let mut found = [None, None, None, None];
                for (slot, child) in found.iter_mut().zip(children) {
                    *slot = to.child(&self.head.name, child)?;
                }
                let Some(content) = shrink(tile, &found).map_err(failure)? else { return Ok(()) };
                written.summary.remade_overviews += 1;
                StoredTile::from_content(tile, content)
            }
        };
        Ok(self.put(to, stored, written)?)
    }

    fn put(&self, to: &Extract, stored: StoredTile, written: &mut WrittenPart) -> Result<(), StoreError> {
        to.put(&self.head.name, &stored)?;
        written.contents.insert(stored.footprint.tile, stored.footprint.content_hash);
        Ok(())
    }

    /// Returns the shards that have a tile, the covering one first.
    fn holders(&self, tile: TileId) -> Vec<&Shard<'a>> {
        let mut holders: Vec<_> = self.shards.iter().filter(|s| s.content(tile).is_some()).collect();
        if self.conflict != Conflict::First {
            // The sort is stable: shards with equal newest sources keep the order in which they were named.
            holders.sort_by(|a, b| by_newest_source(a, tile, b));
        }
        holders
    }

    /// Whether each shard's tile is what the current program makes of the shard's sources.
    fn is_current(&self, tile: TileId, met_by: &[usize]) -> bool {
        self.shards.iter().all(|s| s.is_current(tile, met_by.iter().map(|&i| &self.sources[i])))
    }

    /// Whether every source of a shard that meets the tile covers those of the shards below. Then one shard over the other is
    /// what a build of all sources makes.
    fn is_ordered(&self, holders: &[&Shard<'a>], met_by: &[usize]) -> bool {
        met_by.iter().filter_map(|&i| holders.iter().position(|h| h.has(&self.sources[i]))).is_sorted()
    }

    fn refuse_conflicts(&self) -> Result<(), MergeError> {
        let differs = |tile: &&TileId| {
            let mut contents = self.shards.iter().filter_map(|s| s.content(**tile));
            let first = contents.next();
            contents.any(|c| Some(c) != first)
        };
        let found: Vec<_> = self.cover.keys().filter(differs).collect();
        let Some(first) = found.first() else { return Ok(()) };
        Err(MergeError::Conflict { layer: self.head.name.clone(), tiles: found.len(), first: **first })
    }
}

/// The order in which two shards cover a tile that both have: that of the newest sources that it shows.
fn by_newest_source(a: &Shard<'_>, tile: TileId, b: &Shard<'_>) -> Ordering {
    match (a.seen(tile).first(), b.seen(tile).first()) {
        (Some(a), Some(b)) => a.covering_order(b),
        (a, b) => b.is_some().cmp(&a.is_some()),
    }
}

/// What the stores state of a layer's heights, which must be the same; `None` for imagery.
fn common_terrain(name: &str, shards: &[Shard<'_>]) -> Result<Option<Terrain>, MergeError> {
    let first = &shards[0];
    match shards.iter().find(|s| s.layer.terrain != first.layer.terrain) {
        None => Ok(first.layer.terrain),
        Some(other) => Err(MergeError::Terrain {
            layer: name.into(),
            first: first.reader.path().into(),
            other: other.reader.path().into(),
        }),
    }
}

fn common_zoom(name: &str, shards: &[Shard<'_>]) -> Result<u8, MergeError> {
    let first = &shards[0];
    match shards.iter().find(|s| s.layer.base_zoom != first.layer.base_zoom) {
        None => Ok(first.layer.base_zoom),
        Some(other) => Err(MergeError::Zooms {
            layer: name.into(),
            first: first.reader.path().into(),
            first_zoom: first.layer.base_zoom,
            other: other.reader.path().into(),
            other_zoom: other.layer.base_zoom,
        }),
    }
}

/// Returns every source once, in covering order.
fn all_sources(name: &str, shards: &[Shard<'_>]) -> Result<Vec<Source>, MergeError> {
    let mut all: Vec<Source> = Vec::new();
    for shard in shards {
        for source in &shard.sources {
            match all.iter().find(|s| s.content_hash == source.content_hash) {
                None => all.push(source.clone()),
                // The same orthophoto may have another path on another machine.
                Some(known) if *known == (Source { path: known.path.clone(), ..source.clone() }) => {}
                Some(known) => {
                    let (layer, source_path) = (name.into(), known.path.clone());
                    return Err(MergeError::Declared { layer, source_path, other: shard.reader.path().into() });
                }
            }
        }
    }
    all.sort_by(Source::covering_order);
    Ok(all)
}

fn failure(failure: TileFailure) -> MergeError {
    match failure {
        TileFailure::Store(error) => error.into(),
        TileFailure::Source { .. } => unreachable!("no source is read"),
    }
}
