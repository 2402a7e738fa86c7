//! `FootprintProof`: the footprints of a store, read once without its indexes and proved by the digests of its layers.
//!
//! Later answers of an index are compared with this proof. So a tile that an index has lost is noticed, and not taken for absent.

use super::digest::LayerHashed;
use super::extent::extent;
use super::footprint::Footprint;
use super::footprint_rows;
use super::hashing;
use super::layer::Layer;
use super::source::{self, SourceTable};
use super::{StoreError, digest, geometry};
use overfly_core::geodesy::WORLD_M;
use overfly_core::tile::{MercatorBounds, TileId};
use rusqlite::Connection;
use std::collections::HashMap;
use std::path::Path;

/// Tile and check of every footprint: 28 bytes each.
#[derive(Debug)]
pub(super) struct FootprintProof {
    /// By layer; sorted by zoom, row and column.
    layers: HashMap<String, Vec<ProvedTile>>,
}

#[derive(Debug, Clone, Copy)]
struct ProvedTile {
    tile: TileId,
    check: [u8; 16],
}

impl FootprintProof {
    /// Reads the footprints of every finished layer in one scan of their table.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if the footprints of a layer do not have the digest that the layer states, or cannot be read.
    pub fn read(connection: &Connection, layers: &[Layer], version: u32, path: &Path) -> Result<Self, StoreError> {
        let fail = |e| StoreError::sqlite(path, e);
        let mut rows = scan(connection, version).map_err(fail)?;
        let mut known = HashMap::new();
        for layer in layers.iter().filter(|l| l.complete) {
            let mut footprints = rows.remove(&layer.name).unwrap_or_default();
            footprints.sort_by_key(|f| f.tile);
            let sources = source::load(connection, &layer.name, SourceTable::Finished, version).map_err(fail)?;
            let found = digest::layer_digest_from(&LayerHashed::from(layer), version, &sources, &footprints);
            if Some(hashing::hex(&found)) != layer.digest || footprints.len() as u64 != layer.tiles {
                let reason = format!("the rows of layer {} do not have the digest that it states", layer.name);
                return Err(StoreError::Damaged { path: path.into(), reason });
            }
            require_stated_extent(layer, &footprints, path)?;
            let kept =
                footprints.iter().map(|f| ProvedTile { tile: f.tile, check: digest::footprint_check(&layer.name, f) });
            known.insert(layer.name.clone(), kept.collect());
        }
        Ok(Self { layers: known })
    }

    fn layer(&self, layer: &str) -> &[ProvedTile] {
        self.layers.get(layer).map_or(&[], Vec::as_slice)
    }

    fn find(&self, layer: &str, tile: TileId) -> Option<ProvedTile> {
        let known = self.layer(layer);
        known.binary_search_by_key(&tile, |k| k.tile).ok().map(|at| known[at])
    }

    /// Whether a layer has a tile.
    pub fn knows(&self, layer: &str, tile: TileId) -> bool {
        self.find(layer, tile).is_some()
    }

    /// Whether a footprint is the proved one.
    pub fn agrees(&self, layer: &str, footprint: &Footprint) -> bool {
        self.find(layer, footprint.tile).is_some_and(|k| k.check == digest::footprint_check(layer, footprint))
    }

    /// Number of tiles of one zoom.
    pub fn count_at(&self, layer: &str, zoom: u8) -> usize {
        level(self.layer(layer), zoom).len()
    }

    /// Number of tiles of one zoom that intersect any of the windows (from `windows_on_the_map`).
    pub fn count_in(&self, layer: &str, zoom: u8, windows: &[MercatorBounds]) -> usize {
        let known = level(self.layer(layer), zoom);
        let span_m = WORLD_M / 2f64.powi(i32::from(zoom));
        let mut met: Vec<TileId> = Vec::new();
        for window in windows {
            // One row and one column more on each side than computed: the exact check decides.
            let index = |v: f64, more: f64| (v / span_m).floor() + more;
            let rows = [index(WORLD_M / 2.0 - window.max_y_m, -1.0), index(WORLD_M / 2.0 - window.min_y_m, 1.0)];
            let columns = [index(window.min_x_m + WORLD_M / 2.0, -1.0), index(window.max_x_m + WORLD_M / 2.0, 1.0)];
            let mut at = known.partition_point(|k| f64::from(k.tile.row()) < rows[0]);
            while at < known.len() && f64::from(known[at].tile.row()) <= rows[1] {
                let row = known[at].tile.row();
                let end = at + known[at..].partition_point(|k| k.tile.row() == row);
                let from = at + known[at..end].partition_point(|k| f64::from(k.tile.column()) < columns[0]);
                let inside = known[from..end].iter().take_while(|k| f64::from(k.tile.column()) <= columns[1]);
                met.extend(inside.map(|k| k.tile).filter(|t| t.mercator_bounds().intersects(window)));
                at = end;
            }
        }
        met.sort_unstable();
        met.dedup();
        met.len()
    }
}

/// Checks that a layer states number and extent of its base tiles as they are.
fn require_stated_extent(layer: &Layer, footprints: &[Footprint], path: &Path) -> Result<(), StoreError> {
    let base: Vec<TileId> = footprints.iter().map(|f| f.tile).filter(|tile| tile.zoom() == layer.base_zoom).collect();
    if base.len() as u64 == layer.base_tiles && extent(&base).1 == layer.bounds_deg {
        return Ok(());
    }
    let reason = format!("layer {} states another number or extent of its base tiles than it has", layer.name);
    Err(StoreError::Damaged { path: path.into(), reason })
}

/// The tiles of one zoom.
fn level(known: &[ProvedTile], zoom: u8) -> &[ProvedTile] {
    let from = known.partition_point(|k| k.tile.zoom() < zoom);
    let count = known[from..].partition_point(|k| k.tile.zoom() == zoom);
    &known[from..from + count]
}

/// Reads every footprint by layer, in a scan of the table itself.
fn scan(connection: &Connection, version: u32) -> rusqlite::Result<HashMap<String, Vec<Footprint>>> {
    let sql = format!("SELECT {}, f.geom FROM footprints f NOT INDEXED", footprint_rows::columns(version));
    let mut statement = connection.prepare(&sql)?;
    let mut rows = statement.query([])?;
    let mut found: HashMap<String, Vec<Footprint>> = HashMap::new();
    while let Some(row) = rows.next()? {
        let layer = row.get_ref(11)?.as_str()?;
        let footprint = footprint_rows::read(row)?;
        let envelope = geometry::envelope(row.get_ref(footprint_rows::COLUMN_COUNT)?.as_blob()?);
        if envelope != Some(geometry::envelope_of(&footprint.tile.mercator_bounds())) {
            let reason = format!("the geometry of tile {} is not its extent", footprint.tile);
            return Err(footprint_rows::malformed(footprint_rows::COLUMN_COUNT, &reason));
        }
        match found.get_mut(layer) {
            Some(footprints) => footprints.push(footprint),
            None => {
                found.insert(layer.to_owned(), vec![footprint]);
            }
        }
    }
    Ok(found)
}
