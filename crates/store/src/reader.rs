//! `Reader`: a store opened for reading. No method writes.

use super::cells::CellCache;
use super::connection::{self, Access};
use super::damage::{Damage, DamageLog};
use super::draft::Draft;
use super::footprint::{self, Footprint};
use super::ground::Ground;
use super::keep::Keep;
use super::layer::{self, Layer};
use super::source::{self, Declared, Source};
use super::stamp::Stamp;
use super::window::{rounded_outward, windows_on_the_map};
use super::witness::Witness;
use super::{FORMAT_VERSION, StoreError, digest, manifest, require_contract};
use overfly_core::tile::{MercatorBounds, TileId};
use rusqlite::{Connection, OptionalExtension, Params};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A store opened for reading. `Send + Sync` (a pool of connections within); no method writes.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    access: Access,
    keep: Keep,
    idle: Mutex<Vec<Connection>>,
    layers: Vec<Layer>,
    contract: String,
    digest: String,
    bytes: u64,
    /// Of the file as it was when its digest was last seen to be `digest`.
    stamp: Mutex<Stamp>,
    /// What was worked out of tiles.
    pub(super) ground: Ground,
    pub(super) cells: CellCache,
    /// What the cells of each layer and level must hash to, where an exported store states it.
    pub(super) stated_cells: HashMap<(String, u8), [u8; 32]>,
    manifest: Option<String>,
    /// Every footprint, proved by its layer's digest; onboard only.
    witness: Option<Witness>,
    pub(super) damage: DamageLog,
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
    /// Every footprint is read, its layer's digest proved, and what the indexes say later is held against it; a tile that
    /// turns out damaged is no tile to searches, and told of in [`Reader::damage`].
    ///
    /// # Errors
    /// As [`Reader::open`], [`StoreError::SideFile`], and where the footprints do not give the layers' digests.
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
        let fail = |e| StoreError::sqlite(path, e);
        let digest = stored_digest(&connection, &contract).map_err(fail)?;
        let manifest = manifest::read(&connection).map_err(fail)?;
        let witness = match access {
            Access::Shared => None,
            Access::Immutable => Some(Witness::of(&connection, &layers, path)?),
        };
        let (idle, bytes) = (Mutex::new(vec![connection]), stamp.bytes());
        let (digest, stamp) = (digest::hex(&digest), Mutex::new(stamp));
        Ok(Self {
            path: path.into(),
            access,
            keep: Keep::default(),
            idle,
            layers,
            contract,
            digest,
            bytes,
            stamp,
            ground: Ground::new(&Keep::default()),
            cells: CellCache::new(Keep::default().cells_bytes),
            stated_cells: HashMap::new(),
            manifest,
            witness,
            damage: DamageLog::default(),
        })
    }

    /// The same, knowing what the cells of each layer and level must hash to ([`super::LevelDigests`]).
    pub fn with_stated_cells(self, stated: HashMap<(String, u8), [u8; 32]>) -> Self {
        Self { stated_cells: stated, ..self }
    }

    /// The same, holding no more in memory than `keep` says; what was held so far is let go.
    ///
    /// # Errors
    /// Where SQLite refuses.
    pub fn keeping(self, keep: Keep) -> Result<Self, StoreError> {
        {
            let mut idle = self.idle.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            idle.truncate(keep.connections);
            for connection in idle.iter() {
                connection::hold_pages(connection, keep.pages_bytes).map_err(|e| StoreError::sqlite(&self.path, e))?;
            }
        }
        Ok(Self { ground: Ground::new(&keep), cells: CellCache::new(keep.cells_bytes), keep, ..self })
    }

    /// The manifest of an exported store, as its row holds it.
    pub fn manifest(&self) -> Option<&str> {
        self.manifest.as_deref()
    }

    /// The tiles found damaged so far, onboard: they are neither served nor matched.
    pub fn damage(&self) -> Damage {
        self.damage.told()
    }

    /// Whether it was opened as the aircraft does.
    pub(super) fn is_onboard(&self) -> bool {
        self.access == Access::Immutable
    }

    /// What the footprints' digest proves of a tile, onboard.
    pub(super) fn witness(&self) -> Option<&Witness> {
        self.witness.as_ref()
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

    /// Reads the file anew, on a connection that holds nothing of it yet: what is kept in memory answers even where the
    /// medium is gone.
    ///
    /// # Errors
    /// Where it cannot be opened or read, or is not the store that was opened.
    pub fn check_readable(&self) -> Result<(), StoreError> {
        let connection = self.reopen()?;
        let found = stored_digest(&connection, &self.contract).map_err(|e| StoreError::sqlite(&self.path, e))?;
        if digest::hex(&found) == self.digest { Ok(()) } else { Err(StoreError::Changed { path: self.path.clone() }) }
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

    /// The layers that answer queries, by name.
    pub fn finished_layers(&self) -> impl Iterator<Item = &Layer> {
        self.layers.iter().filter(|l| l.complete)
    }

    /// Refuses a store in which a build is under way: what was made so far is in no digest.
    ///
    /// # Errors
    /// [`StoreError::Unfinished`].
    pub fn require_settled(&self) -> Result<(), StoreError> {
        for layer in &self.layers {
            if !layer.complete || Draft::read(&self.path, &layer.name)?.pending {
                return Err(StoreError::Unfinished { path: self.path.clone(), layer: layer.name.clone() });
            }
        }
        Ok(())
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
        self.attest(layer, &found, |w| w.count_in(&layer.name, zoom, &windows_on_the_map(bounds)))?;
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
        let found = self.with(|c| collect(c, &sql, (&layer.name, zoom)))?;
        self.attest(layer, &found, |w| w.count_at(&layer.name, zoom))?;
        Ok(found)
    }

    /// Every footprint of a finished layer, by tile; none where there is no such layer.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn all_footprints(&self, name: &str) -> Result<Vec<Footprint>, StoreError> {
        let Some(layer) = self.finished_layers().find(|l| l.name == name) else { return Ok(Vec::new()) };
        let mut all = Vec::new();
        for zoom in layer.min_zoom..=layer.base_zoom {
            all.extend(self.footprints(layer, zoom)?);
        }
        Ok(all)
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
        let found = self.with(|c| c.prepare_cached(&sql)?.query_row(key, footprint::read).optional())?;
        self.attest(layer, found.as_slice(), |w| usize::from(w.knows(&layer.name, tile)))?;
        Ok(found)
    }

    /// Holds what an index gave against what was proved at the start: all of it, and nothing else.
    fn attest(
        &self,
        layer: &Layer,
        found: &[Footprint],
        count: impl FnOnce(&Witness) -> usize,
    ) -> Result<(), StoreError> {
        let Some(witness) = &self.witness else { return Ok(()) };
        if found.len() == count(witness) && found.iter().all(|f| witness.agrees(&layer.name, f)) {
            return Ok(());
        }
        let reason = format!("an index of layer {} leads elsewhere than it did when the store was opened", layer.name);
        Err(StoreError::Damaged { path: self.path.clone(), reason })
    }

    pub(super) fn require_complete(&self, layer: &Layer) -> Result<(), StoreError> {
        if layer.complete {
            return Ok(());
        }
        Err(StoreError::Unfinished { path: self.path.clone(), layer: layer.name.clone() })
    }

    pub(super) fn damaged(&self, layer: &Layer, tile: TileId, reason: String) -> StoreError {
        StoreError::DamagedTile { path: self.path.clone(), layer: layer.name.clone(), tile, reason }
    }

    /// One more connection, never to another file that has taken the name.
    fn reopen(&self) -> Result<Connection, StoreError> {
        let connection = connection::reopen_read(&self.path, self.access, self.keep.pages_bytes)?;
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
        if idle.len() < self.keep.connections {
            idle.push(connection);
        }
        outcome
    }
}

pub(super) fn collect(connection: &Connection, sql: &str, parameters: impl Params) -> rusqlite::Result<Vec<Footprint>> {
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
