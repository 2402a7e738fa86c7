//! `Plan`: what a layer shall be, and which of its tiles differ from that. A layer is a function of its set of sources:
//! adding, replacing, removing and going on after a kill are one reconciliation.

use super::declare::{Given, natural_zoom};
use super::outline::Outline;
use super::{BuildError, MAX_TILES, Rejected, Request, recipe};
use crate::raster::content_hash;
use overfly_core::tile::TileId;
use overfly_store::{Declaration, LayerState, Source};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Overviews end where a layer is this many tiles or fewer.
const COARSEST_TILES: usize = 4;

/// What a build shall do.
#[derive(Debug)]
pub struct Plan {
    /// What the layer shall be; its sources in covering order.
    pub declaration: Declaration,
    /// Every tile that the layer shall have (or that shall be known to be empty), and the hash of what decides it.
    pub wanted: HashMap<TileId, [u8; 32]>,
    /// Base tiles to compute, near ones together, each with the sources that meet it, in covering order.
    pub base: Vec<(TileId, Vec<usize>)>,
    /// Overviews to compute, by level, finest first.
    pub overviews: Vec<Vec<TileId>>,
    /// Tiles that go away.
    pub unwanted: usize,
    /// Whether the store is already what it shall be.
    pub up_to_date: bool,
}

impl Plan {
    /// Plans from what the store holds and what was given.
    ///
    /// # Errors
    /// Where a source to remove is unknown, nothing remains, the tiles would be too many, or an old source that is
    /// needed again is gone or altered.
    pub fn make(request: &Request, draft: &LayerState, given: &[Given]) -> Result<Self, BuildError> {
        let sources = wanted_sources(request, draft, given)?;
        let kept = if request.replace_layer { None } else { draft.zoom_override };
        let zoom_override = request.zoom.or(kept);
        let base_zoom = match zoom_override {
            Some(zoom) => zoom,
            None => sources.iter().map(natural_zoom).max().unwrap_or(0),
        };
        let cover = cover(&sources, base_zoom)?;
        let (wanted, levels) = inputs(&sources, &cover);
        let stale = |tile: &TileId| draft.inputs.get(tile) != wanted.get(tile);
        let mut base: Vec<_> = cover.into_iter().filter(|(tile, _)| stale(tile)).collect();
        base.sort_by_key(|(tile, _)| morton(*tile));
        require_old_sources(request, &sources, given, &base)?;
        let min_zoom = base_zoom - levels.len() as u8;
        let overviews: Vec<Vec<TileId>> =
            levels.into_iter().map(|level| level.into_iter().filter(stale).collect()).collect();
        let unwanted = draft.inputs.keys().filter(|tile| !wanted.contains_key(tile)).count();
        let nothing_to_do = base.is_empty() && overviews.iter().all(Vec::is_empty) && unwanted == 0;
        let same = same_sources(&draft.sources, &sources) && zoom_override == draft.zoom_override;
        let up_to_date = draft.complete && !draft.pending && nothing_to_do && same;
        let declaration = Declaration { layer: request.layer.clone(), sources, zoom_override, base_zoom, min_zoom };
        Ok(Self { declaration, wanted, base, overviews, unwanted, up_to_date })
    }

    /// Sources without an acquisition date.
    pub fn undated_sources(&self) -> usize {
        self.declaration.sources.iter().filter(|source| source.acquired.is_none()).count()
    }

    /// Tiles to compute.
    pub fn jobs(&self) -> usize {
        self.base.len() + self.overviews.iter().map(Vec::len).sum::<usize>()
    }
}

/// The set of sources that the layer shall have, in covering order.
fn wanted_sources(request: &Request, draft: &LayerState, given: &[Given]) -> Result<Vec<Source>, BuildError> {
    let layer = || request.layer.clone();
    let mut sources = if request.replace_layer { Vec::new() } else { draft.sources.clone() };
    for name in &request.remove_sources {
        let before = sources.len();
        sources.retain(|source| !is_named(source, name));
        if sources.len() == before {
            return Err(BuildError::NoSuchSource { layer: layer(), name: name.clone() });
        }
    }
    for one in given {
        let new = &one.source;
        sources.retain(|old| old.content_hash != new.content_hash && old.path != new.path);
        sources.push(new.clone());
    }
    if sources.is_empty() {
        return Err(if request.remove_sources.is_empty() {
            BuildError::NoSources
        } else {
            BuildError::LastSource { layer: layer() }
        });
    }
    sources.sort_by(Source::covering_order);
    Ok(sources)
}

fn is_named(source: &Source, name: &str) -> bool {
    let path = Path::new(name);
    let absolute = path.canonicalize().or_else(|_| std::path::absolute(path));
    let by_hash = name.len() >= 8 && overfly_store::hex(&source.content_hash).starts_with(&name.to_ascii_lowercase());
    source.path == path || absolute.is_ok_and(|p| p == source.path) || by_hash
}

/// Equal as sets, paths included.
fn same_sources(a: &[Source], b: &[Source]) -> bool {
    let sorted = |sources: &[Source]| {
        let mut sources = sources.to_vec();
        sources.sort_by_key(|s| s.content_hash);
        sources
    };
    sorted(a) == sorted(b)
}

/// Base tiles and the sources that meet each, in covering order.
pub fn cover(sources: &[Source], zoom: u8) -> Result<BTreeMap<TileId, Vec<usize>>, BuildError> {
    let mut cover: BTreeMap<TileId, Vec<usize>> = BTreeMap::new();
    for (index, source) in sources.iter().enumerate() {
        let outline = Outline::new(&source.outline_deg, zoom).map_err(|e| BuildError::NothingUsable {
            rejected: vec![Rejected {
                path: source.path.clone(),
                code: "beyond_the_matrix",
                message: format!("{}: {e}", source.path.display()),
            }],
        })?;
        let tiles = outline.extent_tiles();
        if tiles > f64::from(MAX_TILES) {
            return Err(BuildError::TooManyTiles { path: source.path.clone(), tiles, zoom });
        }
        for tile in outline.tiles() {
            cover.entry(tile).or_default().push(index);
        }
    }
    Ok(cover)
}

/// The hash of what decides each tile, and the overview levels, finest first.
pub fn inputs(
    sources: &[Source],
    cover: &BTreeMap<TileId, Vec<usize>>,
) -> (HashMap<TileId, [u8; 32]>, Vec<Vec<TileId>>) {
    let mut wanted: HashMap<TileId, [u8; 32]> = cover
        .iter()
        .map(|(tile, indices)| (*tile, recipe::base_inputs(indices.iter().map(|&i| &sources[i]))))
        .collect();
    let mut levels = Vec::new();
    let mut finer: Vec<TileId> = cover.keys().copied().collect();
    while finer.len() > COARSEST_TILES {
        let mut level: Vec<TileId> = finer.iter().filter_map(|tile| tile.parent()).collect();
        level.sort();
        level.dedup();
        if level.is_empty() {
            break;
        }
        for tile in &level {
            let children = tile.children().expect("coarser than the finest zoom");
            let hash = recipe::overview_inputs(children.map(|child| wanted.get(&child).copied()));
            wanted.insert(*tile, hash);
        }
        finer = level.clone();
        levels.push(level);
    }
    (wanted, levels)
}

/// Old sources that a tile to compute needs must be there, unaltered: said before anything is written.
fn require_old_sources(
    request: &Request,
    sources: &[Source],
    given: &[Given],
    base: &[(TileId, Vec<usize>)],
) -> Result<(), BuildError> {
    let fresh: HashSet<[u8; 32]> = given.iter().map(|g| g.source.content_hash).collect();
    let needed: HashSet<usize> = base.iter().flat_map(|(_, indices)| indices.iter().copied()).collect();
    for (index, source) in sources.iter().enumerate() {
        if !needed.contains(&index) || fresh.contains(&source.content_hash) {
            continue;
        }
        let how = match content_hash(&source.path) {
            Ok(hash) if hash == source.content_hash => continue,
            Ok(_) => "was altered since".to_owned(),
            Err(error) => format!("cannot be read: {error}"),
        };
        return Err(BuildError::SourceGone { path: source.path.clone(), layer: request.layer.clone(), how });
    }
    Ok(())
}

/// Interleaves column and row: neighbours in this order are neighbours on the ground.
fn morton(tile: TileId) -> u64 {
    let spread = |v: u32| (0..32).fold(0u64, |acc, bit| acc | (u64::from(v >> bit & 1) << (2 * bit)));
    spread(tile.column()) | spread(tile.row()) << 1
}
