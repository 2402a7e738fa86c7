//! `BuildPlan`: the required content of a layer, and the tiles that differ from it.
//!
//! A layer is a function of its set of sources, so adding, replacing and removing sources and resuming a build are one
//! reconciliation.

use super::declare::{DeclaredSource, natural_zoom};
use super::error::{BuildError, MAX_TILES, Rejected};
use super::outline::Outline;
use super::recipe;
use super::request::Request;
use crate::raster::content_hash;
use overfly_core::tile::TileId;
use overfly_store::{Declaration, LayerState, Source, StoreError};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// The coarsest overview level of a layer has at most this many tiles.
const COARSEST_TILES: usize = 4;

/// What a build has to do.
#[derive(Debug)]
pub struct BuildPlan {
    /// The declaration of the layer, its sources in covering order.
    pub declaration: Declaration,
    /// Every tile that the layer is to have (or that is known to be empty), and the hash of its inputs.
    pub required: HashMap<TileId, [u8; 32]>,
    /// Base tiles to compute, neighbours together, each with the sources that meet it, in covering order.
    pub base: Vec<(TileId, Vec<usize>)>,
    /// Overviews to compute, by level, finest first.
    pub overviews: Vec<Vec<TileId>>,
    /// Number of tiles to remove.
    pub obsolete: usize,
    /// Levels by which the base zoom is finer than the finest source.
    pub finer_by: u8,
    /// Levels by which the base zoom is coarser than the layer has been: they are removed.
    pub coarser_by: u8,
    /// Whether nothing has to be done.
    pub up_to_date: bool,
}

/// Heights are kept no finer than 5 m: what stands on the ground is none of it, and a survey of 1 m would outweigh the imagery.
const FINEST_TERRAIN_ZOOM: u8 = 14;

impl BuildPlan {
    /// Makes a plan from the store's layer and the given sources.
    ///
    /// # Errors
    /// [`BuildError`] where heights are built into a layer of imagery or the reverse, a source to remove is unknown, no source remains, the tiles are too many, or an old source that
    /// is needed again is gone or altered.
    pub fn new(request: &Request, draft: &LayerState, given: &[DeclaredSource]) -> Result<Self, BuildError> {
        require_same_kind(request, draft)?;
        let sources = required_sources(request, draft, given)?;
        let kept = if request.replace_layer { None } else { draft.zoom_override };
        let zoom_override = request.zoom.or(kept);
        let finest = request.terrain.map_or(u8::MAX, |_| FINEST_TERRAIN_ZOOM);
        let natural = sources.iter().map(natural_zoom).max().unwrap_or(0).min(finest);
        let base_zoom = zoom_override.unwrap_or(natural);
        let cover = cover(&sources, base_zoom)?;
        let (required, levels) = tile_inputs(&sources, &cover, request.terrain.is_some());
        let stale = |tile: &TileId| draft.inputs.get(tile) != required.get(tile);
        let mut base: Vec<_> = cover.into_iter().filter(|(tile, _)| stale(tile)).collect();
        base.sort_by_key(|(tile, _)| morton(*tile));
        require_old_sources(request, &sources, given, &base)?;
        let min_zoom = base_zoom - levels.len() as u8;
        let overviews: Vec<Vec<TileId>> =
            levels.into_iter().map(|level| level.into_iter().filter(stale).collect()).collect();
        let obsolete = draft.inputs.keys().filter(|tile| !required.contains_key(tile)).count();
        let nothing_to_do = base.is_empty() && overviews.iter().all(Vec::is_empty) && obsolete == 0;
        let terms = if request.replace_layer { request.terms.clone() } else { request.terms.or(&draft.terms) };
        let same_layer =
            zoom_override == draft.zoom_override && terms == draft.terms && request.terrain == draft.terrain;
        let same = same_sources(&draft.sources, &sources) && same_layer;
        let up_to_date = draft.complete && !draft.pending && nothing_to_do && same;
        let layer = request.layer.clone();
        let terrain = request.terrain;
        let declaration = Declaration { layer, sources, zoom_override, base_zoom, min_zoom, terms, terrain };
        let finer_by = base_zoom.saturating_sub(natural);
        let before = draft.inputs.keys().map(|tile| tile.zoom()).max().filter(|_| draft.complete);
        let coarser_by = before.unwrap_or(base_zoom).saturating_sub(base_zoom);
        Ok(Self { declaration, required, base, overviews, obsolete, finer_by, coarser_by, up_to_date })
    }

    /// Returns the number of sources without an acquisition date.
    pub fn undated_sources(&self) -> usize {
        self.declaration.sources.iter().filter(|source| source.acquired.is_none()).count()
    }

    /// Returns the number of sources whose position error nothing states.
    pub fn unknown_errors(&self) -> usize {
        self.declaration.sources.iter().filter(|source| source.horizontal_error_m.is_none()).count()
    }

    /// Returns the number of tiles to compute.
    pub fn jobs(&self) -> usize {
        self.base.len() + self.overviews.iter().map(Vec::len).sum::<usize>()
    }
}

/// Refuses imagery for a finished layer of heights, and heights for one of imagery.
///
/// # Errors
/// [`StoreError::Heights`], [`StoreError::LayerExists`].
fn require_same_kind(request: &Request, draft: &LayerState) -> Result<(), BuildError> {
    let (path, name) = (request.db.clone(), request.layer.clone());
    match (request.terrain, draft.terrain) {
        (None, Some(_)) => Err(StoreError::Heights { path, name }.into()),
        (Some(_), None) if draft.complete => Err(StoreError::LayerExists { path, name }.into()),
        _ => Ok(()),
    }
}

/// Returns the set of sources of the layer after the build, in covering order.
fn required_sources(
    request: &Request,
    draft: &LayerState,
    given: &[DeclaredSource],
) -> Result<Vec<Source>, BuildError> {
    let layer = || request.layer.clone();
    let mut sources = if request.replace_layer { Vec::new() } else { draft.sources.clone() };
    for name in &request.remove_sources {
        let before = sources.len();
        sources.retain(|source| !is_named(source, name));
        if sources.len() == before {
            return Err(BuildError::NoSuchSource { layer: layer(), name: name.clone() });
        }
    }
    if request.terrain.is_some() && draft.terrain.is_none() {
        // A killed build kept its sources, and not the surface that their heights are above.
        let is_given = |old: &Source| given.iter().any(|one| one.source.content_hash == old.content_hash);
        if let Some(old) = sources.iter().find(|old| !is_given(old)) {
            return Err(BuildError::DatumLost { path: old.path.clone() });
        }
    }
    for one in given {
        let new = &one.source;
        sources.retain(|old| old.content_hash != new.content_hash && old.path != new.path);
        sources.push(new.clone());
    }
    if sources.is_empty() {
        return Err(if request.remove_sources.is_empty() {
            BuildError::NoSources { layer: layer(), unfinished: Vec::new() }
        } else {
            BuildError::LastSource { layer: layer() }
        });
    }
    sources.sort_by(Source::covering_order);
    Ok(sources)
}

/// Whether `name` is the source's path, or at least 8 digits of its hash.
fn is_named(source: &Source, name: &str) -> bool {
    let path = Path::new(name);
    let absolute = path.canonicalize().or_else(|_| std::path::absolute(path));
    let by_hash = name.len() >= 8 && overfly_store::hex(&source.content_hash).starts_with(&name.to_ascii_lowercase());
    source.path == path || absolute.is_ok_and(|p| p == source.path) || by_hash
}

/// Whether two sets of sources are equal, paths included.
fn same_sources(a: &[Source], b: &[Source]) -> bool {
    let sorted = |sources: &[Source]| {
        let mut sources = sources.to_vec();
        sources.sort_by_key(|s| s.content_hash);
        sources
    };
    sorted(a) == sorted(b)
}

/// Returns the base tiles and the sources that meet each, in covering order.
///
/// # Errors
/// [`BuildError`] where a source lies beyond the tile matrix or spans too many tiles.
pub fn cover(sources: &[Source], zoom: u8) -> Result<BTreeMap<TileId, Vec<usize>>, BuildError> {
    let mut cover: BTreeMap<TileId, Vec<usize>> = BTreeMap::new();
    for (index, source) in sources.iter().enumerate() {
        let outline = Outline::new(&source.outline_deg, zoom).map_err(|e| BuildError::NothingUsable {
            rejected: vec![Rejected {
                path: source.path.clone(),
                code: "beyond_the_matrix",
                message: format!("{}: {e}", source.path.display()),
                remedy: None,
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

/// Returns the hash of each tile's inputs, and the overview levels, finest first: none of heights.
pub fn tile_inputs(
    sources: &[Source],
    cover: &BTreeMap<TileId, Vec<usize>>,
    heights: bool,
) -> (HashMap<TileId, [u8; 32]>, Vec<Vec<TileId>>) {
    let mut required: HashMap<TileId, [u8; 32]> = cover
        .iter()
        .map(|(tile, indices)| (*tile, recipe::base_inputs(indices.iter().map(|&i| &sources[i]), heights)))
        .collect();
    let mut levels = Vec::new();
    let mut finer: Vec<TileId> = cover.keys().copied().collect();
    while finer.len() > COARSEST_TILES && !heights {
        let mut level: Vec<TileId> = finer.iter().filter_map(|tile| tile.parent()).collect();
        level.sort();
        level.dedup();
        if level.is_empty() {
            break;
        }
        for tile in &level {
            let children = tile.children().expect("coarser than the finest zoom");
            let hash = recipe::overview_inputs(children.map(|child| required.get(&child).copied()));
            required.insert(*tile, hash);
        }
        finer = level.clone();
        levels.push(level);
    }
    (required, levels)
}

/// Checks, before anything is written, that the old sources of the tiles to compute are there and unaltered.
///
/// # Errors
/// [`BuildError::SourceGone`].
fn require_old_sources(
    request: &Request,
    sources: &[Source],
    given: &[DeclaredSource],
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

/// Returns the Morton code: column and row interleaved, so that neighbours in this order are neighbours on the ground.
fn morton(tile: TileId) -> u64 {
    let spread = |v: u32| (0..32).fold(0u64, |acc, bit| acc | (u64::from(v >> bit & 1) << (2 * bit)));
    spread(tile.column()) | spread(tile.row()) << 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::VerticalDatum;
    use overfly_store::Terrain;

    fn source(name: &str) -> Source {
        Source {
            content_hash: [name.len() as u8; 32],
            path: name.into(),
            acquired: None,
            crs_epsg: None,
            stretch: None,
            horizontal_error_m: None,
            gsd_m_per_px: 30.0,
            outline_deg: Vec::new(),
        }
    }

    #[test]
    fn heights_that_a_killed_build_left_are_named_again_before_others_join_them() {
        let terrain = Some(Terrain { vertical_datum: VerticalDatum::Egm2008, vertical_error_m: None });
        let request = Request { terrain, ..Request::default() };
        let killed = LayerState { pending: true, sources: vec![source("a.tif")], ..LayerState::default() };
        let given = |name: &str| [DeclaredSource { source: source(name), pixels: 81, overridden_crs: None }];
        let refused = required_sources(&request, &killed, &given("other.tif")).unwrap_err();
        assert!(matches!(&refused, BuildError::DatumLost { path } if path == Path::new("a.tif")), "{refused}");
        assert_eq!(required_sources(&request, &killed, &given("a.tif")).unwrap().len(), 1);
        let finished = LayerState { terrain, complete: true, ..killed.clone() };
        assert_eq!(required_sources(&request, &finished, &given("other.tif")).unwrap().len(), 2);
        let anew = Request { replace_layer: true, ..request };
        assert_eq!(required_sources(&anew, &killed, &given("other.tif")).unwrap().len(), 1);
    }
}
