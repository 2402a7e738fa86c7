//! `Union`: a layer of several stores. Its sources are all of theirs; each tile is theirs where they agree, else made of theirs.

use super::super::composite::TileFailure;
use super::super::overview::shrink;
use super::super::plan::{cover, inputs};
use super::blend::blend;
use super::shard::Shard;
use super::{Conflict, MergeError, MergedLayer};
use overfly_core::tile::TileId;
use overfly_store::{Extract, LayerHead, Source, StoreError, StoredTile};
use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap, HashSet};

/// A layer that shall be written.
pub struct Union<'a> {
    head: LayerHead,
    shards: Vec<Shard<'a>>,
    conflict: Conflict,
    /// All sources, in covering order.
    sources: Vec<Source>,
    /// Base tiles and the sources that meet each, in covering order.
    cover: BTreeMap<TileId, Vec<usize>>,
    /// What a build of all sources would make each tile from.
    wanted: HashMap<TileId, [u8; 32]>,
    /// Overviews by level, finest first.
    levels: Vec<Vec<TileId>>,
}

/// What was written of a layer so far.
#[derive(Default)]
struct Written {
    contents: HashMap<TileId, [u8; 32]>,
    /// Tiles that are what a build of all sources would make.
    exact: HashSet<TileId>,
    told: MergedLayer,
}

impl<'a> Union<'a> {
    /// Of the parts that stores have of a layer, in the order in which the stores were named.
    ///
    /// # Errors
    /// Where their zooms or what they say of a source differ, or tiles do and that is to be refused.
    pub fn of(name: &str, shards: Vec<Shard<'a>>, conflict: Conflict) -> Result<Self, MergeError> {
        let base_zoom = common_zoom(name, &shards)?;
        let sources = all_sources(name, &shards)?;
        let cover = cover(&sources, base_zoom)?;
        let (wanted, levels) = inputs(&sources, &cover);
        let stated = shards.iter().any(|s| s.zoom_override.is_some());
        let min_zoom = base_zoom - levels.len() as u8;
        let head = LayerHead { name: name.into(), base_zoom, min_zoom, zoom_override: stated.then_some(base_zoom) };
        let union = Self { head, shards, conflict, sources, cover, wanted, levels };
        if conflict == Conflict::Refuse {
            union.refuse_conflicts()?;
        }
        Ok(union)
    }

    /// Tiles to look at.
    pub fn jobs(&self) -> u64 {
        (self.cover.len() + self.levels.iter().map(Vec::len).sum::<usize>()) as u64
    }

    /// Writes it.
    ///
    /// # Errors
    /// Where a tile is damaged or the disk is full.
    pub fn write(&self, to: &Extract, told: &mut dyn FnMut()) -> Result<MergedLayer, MergeError> {
        let mut written = Written::default();
        (written.told.layer, written.told.stores) = (self.head.name.clone(), self.shards.len());
        to.begin_layer(&self.head)?;
        for (tile, met_by) in &self.cover {
            self.base(*tile, met_by, to, &mut written)?;
            told();
        }
        for tile in self.levels.iter().flatten() {
            self.overview(*tile, to, &mut written)?;
            told();
        }
        for tile in &written.exact {
            to.put_inputs(&self.head.name, *tile, &self.wanted[tile])?;
        }
        to.end_layer(&self.head, self.sources.clone())?;
        Ok(written.told)
    }

    fn base(&self, tile: TileId, met_by: &[usize], to: &Extract, written: &mut Written) -> Result<(), MergeError> {
        let holders = self.holders(tile);
        let mut exact = self.is_current(tile, met_by);
        let Some(first) = holders.first() else {
            if exact {
                written.exact.insert(tile);
            }
            return Ok(());
        };
        let stored = if holders.iter().all(|h| h.content(tile) == first.content(tile)) {
            written.told.taken_tiles += 1;
            first.stored(tile)?
        } else {
            let blended = blend(tile, &holders)?;
            exact &= blended.exact;
            written.told.blended_tiles += 1;
            blended.tile
        };
        if exact && self.is_ordered(&holders, met_by) {
            written.exact.insert(tile);
        }
        Ok(self.put(to, stored, written)?)
    }

    /// A store's overview where what lies below it is what lies below it there, else one made anew.
    fn overview(&self, tile: TileId, to: &Extract, written: &mut Written) -> Result<(), MergeError> {
        let children = tile.children().expect("an overview has children");
        if children.iter().all(|c| !self.wanted.contains_key(c) || written.exact.contains(c)) {
            written.exact.insert(tile);
        }
        let below = children.map(|child| written.contents.get(&child).copied());
        if below.iter().all(Option::is_none) {
            return Ok(());
        }
        let same = |s: &&Shard<'_>| s.content(tile).is_some() && children.map(|child| s.content(child)) == below;
        let stored = match self.shards.iter().find(same) {
            Some(shard) => {
                written.told.taken_tiles += 1;
                shard.stored(tile)?
            }
            None => {
                let mut found = [None, None, None, None];
                for (slot, child) in found.iter_mut().zip(children) {
                    *slot = to.child(&self.head.name, child)?;
                }
                let Some(made) = shrink(tile, &found).map_err(failure)? else { return Ok(()) };
                written.told.remade_overviews += 1;
                StoredTile::from_content(tile, made)
            }
        };
        Ok(self.put(to, stored, written)?)
    }

    fn put(&self, to: &Extract, stored: StoredTile, written: &mut Written) -> Result<(), StoreError> {
        to.put(&self.head.name, &stored)?;
        written.contents.insert(stored.footprint.tile, stored.footprint.content_hash);
        Ok(())
    }

    /// The shards that have a tile, the covering one first.
    fn holders(&self, tile: TileId) -> Vec<&Shard<'a>> {
        let mut holders: Vec<_> = self.shards.iter().filter(|s| s.content(tile).is_some()).collect();
        if self.conflict != Conflict::First {
            // Stable: where dates and newest sources are the same, the order in which they were named.
            holders.sort_by(|a, b| newest(a, tile, b));
        }
        holders
    }

    /// Whether each shard has of a tile what its sources make of it today.
    fn is_current(&self, tile: TileId, met_by: &[usize]) -> bool {
        self.shards.iter().all(|s| s.is_current(tile, met_by.iter().map(|&i| &self.sources[i])))
    }

    /// Whether every source of a shard that meets the tile covers those of the shards below: then one over the other is what a
    /// build of all makes.
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

/// Which of two shards covers the other in a tile that both have: as their newest sources seen in it would.
fn newest(a: &Shard<'_>, tile: TileId, b: &Shard<'_>) -> Ordering {
    match (a.seen(tile).first(), b.seen(tile).first()) {
        (Some(a), Some(b)) => a.covering_order(b),
        (a, b) => b.is_some().cmp(&a.is_some()),
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

/// Every source once, in covering order.
fn all_sources(name: &str, shards: &[Shard<'_>]) -> Result<Vec<Source>, MergeError> {
    let mut all: Vec<Source> = Vec::new();
    for shard in shards {
        for source in &shard.sources {
            match all.iter().find(|s| s.content_hash == source.content_hash) {
                None => all.push(source.clone()),
                // The same orthophoto may stand elsewhere on another machine.
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
