//! `Reader`: a store opened for reading. No method writes.

use super::cells::{self, CellCache};
use super::connection::{self, Access};
use super::footprint::{self, Footprint};
use super::ground::Ground;
use super::imagery::{self, EncodedTile};
use super::layer::{self, Layer};
use super::source::{self, Declared, Source};
use super::stamp::Stamp;
use super::{FORMAT_VERSION, StoreError, digest, require_contract};
use crate::feature::CellMap;
use crate::geodesy::WORLD_M;
use crate::pixels::MaskedColour;
use crate::tile::{MercatorBounds, TileId};
use rusqlite::{Connection, OptionalExtension, Params};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Connections kept open when idle; more are opened as needed.
const IDLE_CONNECTIONS: usize = 16;
/// A bound moved by whole worlds is rounded: it is widened by this before the exact check, metres of the projection.
const ROUNDING_M: f64 = 1e-6;

/// A store opened for reading. `Send + Sync` (a pool of connections within); no method writes.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    access: Access,
    idle: Mutex<Vec<Connection>>,
    layers: Vec<Layer>,
    contract: String,
    digest: String,
    bytes: u64,
    /// Of the file as it was when its digest was last seen to be `digest`.
    stamp: Mutex<Stamp>,
    /// What was worked out of tiles.
    pub(super) ground: Ground,
    cells: CellCache,
}

impl Reader {
    /// Opens a finished store for reading. Reads a few rows, however large the store is.
    ///
    /// # Errors
    /// Where the file is absent, no store, of another format or contract, damaged, or holds no finished layer.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        Self::open_as(path, Access::Shared)
    }

    /// Opens it as the aircraft does: immutable, no locks, no side files, refused beside a non-empty `-wal` or `-journal`.
    ///
    /// # Errors
    /// As [`Reader::open`], and [`StoreError::SideFile`].
    pub fn open_onboard(path: &Path) -> Result<Self, StoreError> {
        Self::open_as(path, Access::Immutable)
    }

    fn open_as(path: &Path, access: Access) -> Result<Self, StoreError> {
        let stamp = Stamp::of(path)?;
        let connection = connection::open_read(path, access)?;
        let contract = require_contract(&connection, path)?;
        let layers = layer::load_all(&connection, path)?;
        if layers.is_empty() {
            return Err(StoreError::NoLayers { path: path.into() });
        }
        if layers.iter().all(|l| !l.complete) {
            let names: Vec<_> = layers.iter().map(|l| l.name.as_str()).collect();
            return Err(StoreError::Unfinished { path: path.into(), layer: names.join(", ") });
        }
        let digest = stored_digest(&connection, &contract).map_err(|e| StoreError::sqlite(path, e))?;
        let (idle, bytes) = (Mutex::new(vec![connection]), stamp.bytes());
        let (digest, stamp) = (digest::hex(&digest), Mutex::new(stamp));
        Ok(Self {
            path: path.into(),
            access,
            idle,
            layers,
            contract,
            digest,
            bytes,
            stamp,
            ground: Ground::new(),
            cells: CellCache::default(),
        })
    }

    /// Checks that the file still is what was opened: layers and digest are read once. A store that is only being added
    /// to is; one whose finished layers have changed, that was replaced, or (opened immutable) written to at all is not.
    /// Cheap: one look at the folder unless the file was written.
    ///
    /// # Errors
    /// [`StoreError::Changed`], and where the store is damaged.
    pub fn check_unchanged(&self) -> Result<(), StoreError> {
        let changed = || StoreError::Changed { path: self.path.clone() };
        let now = Stamp::of(&self.path).map_err(|_| changed())?;
        let seen = *self.stamp.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if now == seen {
            return Ok(());
        }
        if self.access == Access::Immutable || !now.same_file(&seen) {
            return Err(changed());
        }
        let digest = self.with(|c| stored_digest(c, &self.contract))?;
        if digest::hex(&digest) != self.digest {
            return Err(changed());
        }
        *self.stamp.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = now;
        Ok(())
    }

    /// The file it reads.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The whole-store digest over the finished layers, hexadecimal: equal inputs give equal digests.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The contract that its descriptors follow (`feature::keypoint::CONTRACT`).
    pub fn descriptor_contract(&self) -> &str {
        &self.contract
    }

    /// The store format's version: that of its last migration.
    pub fn format_version(&self) -> u32 {
        FORMAT_VERSION
    }

    /// Size of the file when it was opened.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The layers, by name, unfinished ones included (see [`Layer::complete`]).
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// A complete layer by name.
    ///
    /// # Errors
    /// [`StoreError::NoLayer`], [`StoreError::Unfinished`].
    pub fn layer(&self, name: &str) -> Result<&Layer, StoreError> {
        let layer = self.layers.iter().find(|l| l.name == name).ok_or_else(|| {
            let known: Vec<_> = self.layers.iter().map(|l| l.name.as_str()).collect();
            StoreError::NoLayer { path: self.path.clone(), name: name.into(), known: known.join(", ") }
        })?;
        self.require_complete(layer)?;
        Ok(layer)
    }

    /// The orthophotos a layer is made of, in order of covering: the first covers the others.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn sources(&self, layer: &Layer) -> Result<Vec<Source>, StoreError> {
        let mut sources = self.with(|c| source::load(c, &layer.name, Declared::Finished))?;
        sources.sort_by(Source::covering_order);
        Ok(sources)
    }

    /// Footprints of one zoom whose exact bounds meet `bounds` (x may run past the antimeridian), by row and column:
    /// R-tree first, then the exact check. Edges that only touch do not meet. Empty where a bound is not a number.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn footprints_in(
        &self,
        layer: &Layer,
        zoom: u8,
        bounds: &MercatorBounds,
    ) -> Result<Vec<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM rtree_footprints_geom r CROSS JOIN footprints f ON f.fid = r.id
             WHERE r.maxx >= ?1 AND r.minx <= ?2 AND r.maxy >= ?3 AND r.miny <= ?4 AND f.layer = ?5 AND f.zoom = ?6",
            footprint::COLUMNS
        );
        let mut found = Vec::new();
        for window in windows_on_the_map(bounds) {
            let filter = rounded_outward(&window);
            let parameters = (filter[0], filter[1], filter[2], filter[3], &layer.name, zoom);
            let rows = self.with(|c| collect(c, &sql, parameters))?;
            found.extend(rows.into_iter().filter(|f| f.tile.mercator_bounds().intersects(&window)));
        }
        found.sort_by_key(|f| f.tile);
        found.dedup_by_key(|f| f.tile);
        Ok(found)
    }

    /// Every footprint of one zoom (for a resident index), by row and column.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn footprints(&self, layer: &Layer, zoom: u8) -> Result<Vec<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM footprints f WHERE f.layer = ?1 AND f.zoom = ?2 ORDER BY f.tile_row, f.tile_column",
            footprint::COLUMNS
        );
        self.with(|c| collect(c, &sql, (&layer.name, zoom)))
    }

    /// One tile's footprint, or `None` where the layer has no such tile.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn footprint(&self, layer: &Layer, tile: TileId) -> Result<Option<Footprint>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT {} FROM footprints f
             WHERE f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4",
            footprint::COLUMNS
        );
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        self.with(|c| c.prepare_cached(&sql)?.query_row(key, footprint::read).optional())
    }

    /// A tile's imagery as stored, or `None` where the layer has no such tile.
    ///
    /// # Errors
    /// Where the layer is unfinished or the tile damaged.
    pub fn encoded_tile(&self, layer: &Layer, tile: TileId) -> Result<Option<EncodedTile>, StoreError> {
        self.require_complete(layer)?;
        let sql = format!(
            "SELECT t.tile_data, f.content_hash FROM \"{}\" t
             JOIN footprints f ON f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4
             WHERE t.zoom_level = ?2 AND t.tile_row = ?3 AND t.tile_column = ?4",
            layer.name
        );
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        let row = self.with(|c| {
            c.prepare_cached(&sql)?.query_row(key, |row| Ok((row.get::<_, Vec<u8>>(0)?, row.get(1)?))).optional()
        })?;
        let Some((bytes, content_hash)) = row else { return Ok(None) };
        let media_type = imagery::media_type(&bytes)
            .ok_or_else(|| self.damaged(layer, tile, "its imagery is neither JPEG nor PNG".into()))?;
        Ok(Some(EncodedTile { media_type, bytes, content_hash }))
    }

    /// A tile's pixels and mask, decoded.
    ///
    /// # Errors
    /// Where the layer is unfinished or the tile damaged.
    pub fn tile(&self, layer: &Layer, tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        let Some(encoded) = self.encoded_tile(layer, tile)? else { return Ok(None) };
        imagery::decode(&encoded.bytes).map(Some).map_err(|reason| self.damaged(layer, tile, reason))
    }

    /// A tile's descriptor blob (`feature::keypoint::from_blob`); `None` where there is no such tile or it has none
    /// (overviews are not described).
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn descriptors(&self, layer: &Layer, tile: TileId) -> Result<Option<Vec<u8>>, StoreError> {
        self.require_complete(layer)?;
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        self.with(|c| {
            c.prepare_cached(
                "SELECT d.descriptors FROM footprints f JOIN overfly_descriptors d ON d.footprint = f.fid
                 WHERE f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4",
            )?
            .query_row(key, |row| row.get(0))
            .optional()
        })
    }

    /// The cells of one level, merged `pitch` by `pitch` (1, 2 or 3); without blocks where the layer has none of that
    /// level or was built before there were cells. Kept, so that the next frame finds them in memory, within a bound:
    /// the longest unused go first.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn cells(&self, layer: &Layer, zoom: u8, pitch: usize) -> Result<Arc<CellMap>, StoreError> {
        self.require_complete(layer)?;
        let key = (layer.name.clone(), zoom, pitch);
        if let Some(kept) = self.cells.get(&key) {
            return Ok(kept);
        }
        let map = if pitch == 1 {
            CellMap::of_tiles(self.with(|c| cells::load(c, &layer.name, zoom))?)
        } else {
            self.cells(layer, zoom, 1)?.merged(pitch)
        };
        Ok(self.cells.keep(key, map))
    }

    fn require_complete(&self, layer: &Layer) -> Result<(), StoreError> {
        if layer.complete {
            return Ok(());
        }
        Err(StoreError::Unfinished { path: self.path.clone(), layer: layer.name.clone() })
    }

    fn damaged(&self, layer: &Layer, tile: TileId, reason: String) -> StoreError {
        StoreError::DamagedTile { path: self.path.clone(), layer: layer.name.clone(), tile, reason }
    }

    /// One more connection, never to another file that has taken the name.
    fn reopen(&self) -> Result<Connection, StoreError> {
        let connection = connection::reopen_read(&self.path, self.access)?;
        let opened = *self.stamp.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if Stamp::of(&self.path)?.same_file(&opened) {
            Ok(connection)
        } else {
            Err(StoreError::Changed { path: self.path.clone() })
        }
    }

    /// Runs a query on a connection of the pool.
    pub(super) fn with<T>(&self, query: impl FnOnce(&Connection) -> rusqlite::Result<T>) -> Result<T, StoreError> {
        let idle = self.idle.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).pop();
        let connection = match idle {
            Some(connection) => connection,
            None => self.reopen()?,
        };
        let outcome = query(&connection).map_err(|e| StoreError::sqlite(&self.path, e));
        let mut idle = self.idle.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if idle.len() < IDLE_CONNECTIONS {
            idle.push(connection);
        }
        outcome
    }
}

fn collect(connection: &Connection, sql: &str, parameters: impl Params) -> rusqlite::Result<Vec<Footprint>> {
    connection.prepare_cached(sql)?.query_map(parameters, footprint::read)?.collect()
}

/// The store's digest from its layers' stored ones.
pub(super) fn stored_digest(connection: &Connection, contract: &str) -> rusqlite::Result<[u8; 32]> {
    let mut statement = connection
        .prepare("SELECT name, digest FROM overfly_layers WHERE complete = 1 AND digest NOT NULL ORDER BY name")?;
    let rows: Vec<(String, [u8; 32])> =
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect::<rusqlite::Result<_>>()?;
    Ok(digest::store_digest(contract, rows.iter().map(|(name, digest)| (name.as_str(), *digest))))
}

/// The parts of the map that bounds cover, each with x inside the world: one usually, two across the antimeridian.
fn windows_on_the_map(bounds: &MercatorBounds) -> Vec<MercatorBounds> {
    let half_m = WORLD_M / 2.0;
    if bounds.max_x_m - bounds.min_x_m >= WORLD_M {
        return vec![MercatorBounds { min_x_m: -half_m, max_x_m: half_m, ..*bounds }];
    }
    let world =
        MercatorBounds { min_x_m: -half_m, min_y_m: f64::NEG_INFINITY, max_x_m: half_m, max_y_m: f64::INFINITY };
    let first = ((bounds.min_x_m + half_m) / WORLD_M).floor();
    [first, first + 1.0]
        .into_iter()
        .map(|worlds| {
            let rounding_m = if worlds == 0.0 { 0.0 } else { ROUNDING_M };
            MercatorBounds {
                min_x_m: bounds.min_x_m - worlds * WORLD_M - rounding_m,
                max_x_m: bounds.max_x_m - worlds * WORLD_M + rounding_m,
                ..*bounds
            }
        })
        .filter(|window| window.intersects(&world))
        .collect()
}

/// min x, max x, min y, max y, each moved outward by more than a 32-bit float's rounding (2 m at the world's edge).
fn rounded_outward(bounds: &MercatorBounds) -> [f64; 4] {
    let margin_m = |v: f64| v.abs() * f64::from(f32::EPSILON) + ROUNDING_M;
    [
        bounds.min_x_m - margin_m(bounds.min_x_m),
        bounds.max_x_m + margin_m(bounds.max_x_m),
        bounds.min_y_m - margin_m(bounds.min_y_m),
        bounds.max_y_m + margin_m(bounds.max_y_m),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_at_the_antimeridian() {
        let at = |min_x_m, max_x_m| MercatorBounds { min_x_m, min_y_m: 0.0, max_x_m, max_y_m: 1.0 };
        let half_m = WORLD_M / 2.0;
        assert_eq!(windows_on_the_map(&at(-5.0, 5.0)), [at(-5.0, 5.0)]);
        let across = windows_on_the_map(&at(half_m - 100.0, half_m + 50.0));
        assert_eq!(across.len(), 2);
        assert!((across[1].max_x_m - (-half_m + 50.0)).abs() < 1e-3);
        let west = windows_on_the_map(&at(-half_m - 50.0, -half_m + 100.0));
        assert_eq!(west.len(), 2);
        assert!((west[0].min_x_m - (half_m - 50.0)).abs() < 1e-3);
        assert_eq!(windows_on_the_map(&at(-WORLD_M, WORLD_M)).len(), 1);
        assert!(windows_on_the_map(&at(f64::NAN, 1.0)).is_empty());
    }
}
