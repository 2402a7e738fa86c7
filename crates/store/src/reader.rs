//! `Reader`: a store that is open for reading. No method writes.

use super::cache_limits::CacheLimits;
use super::cells::CellCache;
use super::connection::{self, Access, OpenedStore};
use super::contract::require_contract;
use super::damage::{Damage, DamageLog};
use super::file_stamp::FileStamp;
use super::footprint::Footprint;
use super::footprint_proof::FootprintProof;
use super::footprint_rows;
use super::ground_cache::GroundCache;
use super::hashing;
use super::layer::{self, Layer};
use super::layer_state::LayerState;
use super::source::{self, Source, SourceTable};
use super::{StoreError, digest, geopackage, manifest};
use overfly_core::tile::TileId;
use parking_lot::Mutex;
use rusqlite::{Connection, Params};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A store that is open for reading. Threads can share it: it holds a pool of connections.
///
/// # Example
/// ```
/// use overfly_core::feature::keypoint::CONTRACT;
/// use overfly_core::pixels::{Colour, Mask, MaskedColour};
/// use overfly_core::tile::TileId;
/// use overfly_store::{BuiltTile, Declaration, Reader, Terms, TileContent, Writer};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("map.gpkg");
/// let tile = TileId::new(14, 8580, 5733)?;
/// let grey = Colour::from_values(512, 512, vec![120; 512 * 512 * 3]).expect("three values a pixel");
/// let pixels = MaskedColour { colour: grey, mask: Mask::filled(512, 512, true) };
/// let content = Some(TileContent::encode(tile, &pixels, &[], None)?);
/// let layer = "ortho".to_owned();
/// let declaration = Declaration {
///     layer,
///     sources: Vec::new(),
///     zoom_override: None,
///     base_zoom: 14,
///     min_zoom: 14,
///     terms: Terms::default(),
///     terrain: None,
/// };
/// let mut writer = Writer::begin(&path, CONTRACT, declaration)?;
/// writer.put(&BuiltTile { tile, inputs_hash: [0; 32], content })?;
/// assert_eq!(writer.finish(&|_| true)?, Some(1));
///
/// let store = Reader::open(&path)?;
/// let layer = store.layer("ortho")?;
/// assert_eq!((layer.base_zoom, layer.tiles), (14, 1));
/// assert_eq!(store.footprints(layer, 14)?[0].tile, tile);
/// let stored = store.tile(layer, tile)?.expect("the tile was put");
/// assert!(stored.colour.values()[0].abs_diff(120) <= 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    access: Access,
    is_onboard: bool,
    limits: CacheLimits,
    idle: Mutex<Vec<Connection>>,
    layers: Vec<Layer>,
    version: u32,
    contract: String,
    digest: String,
    bytes: u64,
    /// The stamp of the file when its digest was last found to be `digest`.
    stamp: Mutex<FileStamp>,
    /// Caches of decoded and described tiles.
    pub(super) ground: GroundCache,
    pub(super) cells: CellCache,
    /// The digests of the cells by layer and zoom, if the manifest of an exported store states them.
    pub(super) stated_cells: HashMap<(String, u8), [u8; 32]>,
    manifest: Option<String>,
    /// Onboard only: every footprint, proved by the digest of its layer.
    proof: Option<FootprintProof>,
    pub(super) damage: DamageLog,
}

impl Reader {
    /// Opens a store for reading. Reads only a few rows, however large the store is. Reading leaves no `-wal` or `-shm` file, not even
    /// beside a store that another program left in WAL mode.
    ///
    /// # Errors
    /// Where the file does not exist, is not a store, has another format or contract, is damaged, or has no finished layer, and
    /// [`StoreError::LeftInWal`].
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        Self::open_with(path, Access::Shared)
    }

    /// Opens a store as the aircraft does: immutable, without locks and side files. Reads every footprint and proves the digest
    /// of each layer. Later answers of the indexes are compared with these footprints. A search skips a damaged tile, and
    /// [`Reader::damage`] reports it.
    ///
    /// # Errors
    /// As [`Reader::open`]; [`StoreError::SideFile`] beside a non-empty `-wal` or `-journal` file; where the footprints do not have
    /// the digests of the layers.
    pub fn open_onboard(path: &Path) -> Result<Self, StoreError> {
        Self::open_with(path, Access::Immutable)
    }

    /// Opens a store for reading, and proves its footprints as [`Reader::open_onboard`] does. Another program may write to the file.
    ///
    /// # Errors
    /// As [`Reader::open`], and where the footprints do not have the digests of the layers.
    pub fn open_proved(path: &Path) -> Result<Self, StoreError> {
        let mut reader = Self::open(path)?;
        reader.proof = Some(reader.read_proof()?);
        Ok(reader)
    }

    /// Proves the footprints by the digests of the layers, unless that was done when the store was opened.
    ///
    /// # Errors
    /// As [`Reader::open_proved`].
    pub fn prove(&self) -> Result<(), StoreError> {
        if self.proof.is_none() {
            self.read_proof()?;
        }
        Ok(())
    }

    fn read_proof(&self) -> Result<FootprintProof, StoreError> {
        let connection = self.reopen()?;
        FootprintProof::read(&connection, &self.layers, self.version, &self.path)
    }

    fn open_with(path: &Path, wanted: Access) -> Result<Self, StoreError> {
        let stamp = FileStamp::read(path)?;
        let OpenedStore { connection, version, access } = connection::open_read(path, wanted)?;
        let is_onboard = wanted == Access::Immutable;
        let contract = require_contract(&connection, path)?;
        let layers = layer::load_all(&connection, version, path)?;
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
        let proof = is_onboard.then(|| FootprintProof::read(&connection, &layers, version, path)).transpose()?;
        let (idle, bytes) = (Mutex::new(vec![connection]), stamp.bytes());
        let (digest, stamp) = (hashing::hex(&digest), Mutex::new(stamp));
        Ok(Self {
            path: path.into(),
            access,
            is_onboard,
            limits: CacheLimits::default(),
            idle,
            layers,
            version,
            contract,
            digest,
            bytes,
            stamp,
            ground: GroundCache::new(&CacheLimits::default()),
            cells: CellCache::new(CacheLimits::default().cells_bytes),
            stated_cells: HashMap::new(),
            manifest,
            proof,
            damage: DamageLog::default(),
        })
    }

    /// Returns the reader with the digests of the cells by layer and zoom ([`super::LevelDigests::cells`]). Cells are then compared
    /// with them.
    pub fn with_stated_cells(self, stated: HashMap<(String, u8), [u8; 32]>) -> Self {
        Self { stated_cells: stated, ..self }
    }

    /// Returns the reader with other cache limits and empty caches.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn with_cache_limits(self, limits: CacheLimits) -> Result<Self, StoreError> {
        {
            let mut idle = self.idle.lock();
            idle.truncate(limits.connections);
            for connection in idle.iter() {
                connection::limit_pages(connection, limits.pages_bytes)
                    .map_err(|e| StoreError::sqlite(&self.path, e))?;
            }
        }
        Ok(Self { ground: GroundCache::new(&limits), cells: CellCache::new(limits.cells_bytes), limits, ..self })
    }

    /// The manifest of an exported store, as stored: `None` for a built store.
    pub fn manifest(&self) -> Option<&str> {
        self.manifest.as_deref()
    }

    /// The damaged tiles found so far. Only a store opened onboard records them.
    pub fn damage(&self) -> Damage {
        self.damage.summary()
    }

    /// Whether the store was opened with [`Reader::open_onboard`].
    pub(super) fn is_onboard(&self) -> bool {
        self.is_onboard
    }

    /// The proved footprints, onboard only.
    pub(super) fn footprint_proof(&self) -> Option<&FootprintProof> {
        self.proof.as_ref()
    }

    /// Checks that the file still holds the store that was opened. Costs one `stat` unless the file was written.
    ///
    /// A pending build may write to the file. The check fails if a finished layer has changed, the file was replaced, or a store
    /// that was opened onboard, or is in WAL mode, was written at all.
    ///
    /// # Errors
    /// [`StoreError::Changed`], and where the store is damaged.
    pub fn check_unchanged(&self) -> Result<(), StoreError> {
        let changed = || StoreError::Changed { path: self.path.clone() };
        let now = FileStamp::read(&self.path).map_err(|_| changed())?;
        let seen = *self.stamp.lock();
        if now == seen {
            return Ok(());
        }
        // A store that came into WAL mode must be opened anew: these connections would create side files.
        if self.access == Access::Immutable || !now.same_file(&seen) || connection::is_in_wal_mode(&self.path)? {
            return Err(changed());
        }
        // A store that was copied over this one may have the change counter that SQLite's caches are checked by.
        self.check_readable()?;
        *self.stamp.lock() = now;
        Ok(())
    }

    /// Reads the file on a new connection with an empty cache: cached pages would answer even if the medium were gone.
    ///
    /// # Errors
    /// Where the file cannot be opened or read, and [`StoreError::Changed`].
    pub fn check_readable(&self) -> Result<(), StoreError> {
        let connection = self.reopen()?;
        let found = stored_digest(&connection, &self.contract).map_err(|e| StoreError::sqlite(&self.path, e))?;
        if hashing::hex(&found) == self.digest { Ok(()) } else { Err(StoreError::Changed { path: self.path.clone() }) }
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The digest of the store over its finished layers, hexadecimal. Equal inputs give equal digests.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The contract that the descriptors follow (`feature::keypoint::CONTRACT`).
    pub fn descriptor_contract(&self) -> &str {
        &self.contract
    }

    /// The format version of the store: the version of its last migration.
    pub fn format_version(&self) -> u32 {
        self.version
    }

    /// Size of the file when it was opened, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The layers by name, including unfinished ones (see [`Layer::complete`]).
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The finished layers by name. Only these answer queries.
    pub fn finished_layers(&self) -> impl Iterator<Item = &Layer> {
        self.layers.iter().filter(|l| l.complete)
    }

    /// Checks that no build is pending: no digest covers the tiles of a pending build.
    ///
    /// # Errors
    /// [`StoreError::Unfinished`].
    pub fn require_no_pending_build(&self) -> Result<(), StoreError> {
        for layer in &self.layers {
            if !layer.complete || LayerState::read(&self.path, &layer.name)?.pending {
                return Err(StoreError::Unfinished { path: self.path.clone(), layer: layer.name.clone() });
            }
        }
        Ok(())
    }

    /// Returns a finished layer by name.
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

    /// Returns the sources of a layer in covering order: the first covers the others.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn sources(&self, layer: &Layer) -> Result<Vec<Source>, StoreError> {
        let mut sources = self.with(|c| source::load(c, &layer.name, SourceTable::Finished, self.version))?;
        sources.sort_by(Source::covering_order);
        Ok(sources)
    }

    /// Returns the text that describes a layer to people, if there is one. No digest proves it.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn description(&self, layer: &Layer) -> Result<Option<String>, StoreError> {
        let text = self.with(|c| geopackage::description(c, &layer.name))?;
        Ok(text.filter(|text| text != geopackage::NO_DESCRIPTION))
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

    /// Opens one more connection. Fails if another file has taken the path.
    fn reopen(&self) -> Result<Connection, StoreError> {
        let connection = connection::reopen_read(&self.path, self.access, self.limits.pages_bytes)?;
        let opened = *self.stamp.lock();
        if FileStamp::read(&self.path)?.same_file(&opened) {
            Ok(connection)
        } else {
            Err(StoreError::Changed { path: self.path.clone() })
        }
    }

    /// Runs a query on a connection of the pool.
    pub(super) fn with<T>(&self, query: impl FnOnce(&Connection) -> rusqlite::Result<T>) -> Result<T, StoreError> {
        let idle = self.idle.lock().pop();
        let connection = match idle {
            Some(connection) => connection,
            None => self.reopen()?,
        };
        let outcome = query(&connection).map_err(|e| StoreError::sqlite(&self.path, e));
        let mut idle = self.idle.lock();
        if idle.len() < self.limits.connections {
            idle.push(connection);
        }
        outcome
    }
}

/// Reads footprints with a query.
pub(super) fn collect(connection: &Connection, sql: &str, parameters: impl Params) -> rusqlite::Result<Vec<Footprint>> {
    connection.prepare_cached(sql)?.query_map(parameters, footprint_rows::read)?.collect()
}

/// Reads name and digest of each finished layer, by name.
pub(super) fn layer_digests(connection: &Connection) -> rusqlite::Result<Vec<(String, [u8; 32])>> {
    let mut statement = connection
        .prepare("SELECT name, digest FROM overfly_layers WHERE complete = 1 AND digest NOT NULL ORDER BY name")?;
    statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}

/// Computes the digest of a store from the stored digests of its layers.
pub(super) fn stored_digest(connection: &Connection, contract: &str) -> rusqlite::Result<[u8; 32]> {
    let rows = layer_digests(connection)?;
    Ok(digest::store_digest(contract, rows.iter().map(|(name, digest)| (name.as_str(), *digest))))
}
