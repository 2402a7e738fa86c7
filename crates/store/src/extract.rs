//! `Extract`: a new store made of tiles of other stores. The same tiles in the same order give the same bytes.

use super::connection::{self, file_uri};
use super::content::{self, Child};
use super::declaration::Declaration;
use super::digest;
use super::digest::LevelOf;
use super::footprint_rows;
use super::geometry;
use super::hashing;
use super::layer::{self, Layer};
use super::level::LevelDigests;
use super::source::{self, SourceTable};
use super::terms::Terms;
use super::terrain::Terrain;
use super::tile_rows::{TileRows, insert_tile};
use super::{
    FORMAT_VERSION, Footprint, Reader, Source, StoreError, StoredTile, cells, finish, geopackage, imagery, manifest,
    migration, reader, tile_rows, verify,
};
use overfly_core::tile::TileId;
use rusqlite::{Connection, OpenFlags, params};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Name and levels of a layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerHead {
    /// Name.
    pub name: String,
    /// Zoom of the finest level.
    pub base_zoom: u8,
    /// Zoom of the coarsest level.
    pub min_zoom: u8,
    /// Base zoom, if the user stated one when the layer was built.
    pub zoom_override: Option<u8>,
    /// Under what terms its imagery may be used.
    #[serde(default, skip_serializing_if = "Terms::is_empty")]
    pub terms: Terms,
    /// What it states of its heights, where it is a layer of heights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<Terrain>,
}

/// The part of a layer to copy.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerPart {
    /// Name of the layer.
    pub name: String,
    /// Zoom of the finest level to copy.
    pub base_zoom: u8,
    /// Zoom of the coarsest level to copy.
    pub min_zoom: u8,
    /// Tiles to copy, by zoom, row and column, each once.
    pub tiles: Vec<TileId>,
    /// Whether to copy descriptors. Without them a tile has another content hash.
    pub with_descriptors: bool,
    /// The JPEG quality, 1 to 100, to encode the imagery again with, to reduce its size. Such a tile has another content hash.
    pub jpeg_quality: Option<u8>,
}

impl LayerPart {
    /// Returns a tile with its size reduced as requested.
    fn reduced(&self, mut tile: StoredTile) -> Result<StoredTile, StoreError> {
        if let Some(quality) = self.jpeg_quality {
            tile.image = imagery::recode(tile.footprint.tile, tile.image, quality)?;
        }
        if !self.with_descriptors {
            tile.descriptors = None;
        }
        let described = tile.descriptors.as_deref().unwrap_or_default();
        tile.footprint.content_hash =
            digest::content_hash(tile.media_type, &tile.image, described, tile.cells.as_deref());
        Ok(tile)
    }
}

/// A store that is being made, in a draft file. The draft is removed when this value is dropped.
#[derive(Debug)]
pub struct Extract {
    draft: DraftFile,
    connection: Connection,
    contract: String,
    version: u32,
}

/// A file that is removed when this value is dropped.
#[derive(Debug)]
struct DraftFile(PathBuf);

impl Drop for DraftFile {
    fn drop(&mut self) {
        // A draft that cannot be removed is overwritten by the next export to the same target.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Extract {
    /// Begins a store of this program's format in the file `draft`, which is overwritten.
    ///
    /// # Errors
    /// Where the folder does not exist or cannot be written, or the disk is full.
    pub fn begin(draft: &Path, contract: &str) -> Result<Self, StoreError> {
        Self::begin_version(draft, contract, FORMAT_VERSION)
    }

    /// Begins a store of a readable format version. A patch uses this to make a store that an older program exported.
    ///
    /// # Errors
    /// As [`Extract::begin`], and where this program cannot read the version.
    pub fn begin_version(draft: &Path, contract: &str, version: u32) -> Result<Self, StoreError> {
        migration::require_readable(version, draft)?;
        let draft = DraftFile(draft.to_path_buf());
        let connection = open(&draft.0, contract, version).map_err(|e| StoreError::own_file(&draft.0, e))?;
        Ok(Self { draft, connection, contract: contract.to_owned(), version })
    }

    /// Copies a part of a layer of `from`, checks the hash of every tile, and declares the layer finished. Calls `progress` after
    /// each tile.
    ///
    /// # Errors
    /// Where a tile is damaged, the layer exists already, or the disk is full.
    pub fn copy(&mut self, from: &Reader, part: &LayerPart, mut progress: impl FnMut()) -> Result<(), StoreError> {
        let known = from.layer(&part.name)?;
        let head = LayerHead {
            name: part.name.clone(),
            base_zoom: part.base_zoom,
            min_zoom: part.min_zoom,
            zoom_override: None,
            terms: known.terms.clone(),
            terrain: known.terrain,
        };
        self.begin_layer(&head)?;
        let mut seen = HashSet::new();
        for &tile in &part.tiles {
            let Some(stored) = from.stored_tile(known, tile)? else { continue };
            let stored = part.reduced(stored)?;
            seen.extend(stored.footprint.sources.split(' ').map(str::to_owned));
            self.put(&head.name, &stored)?;
            progress();
        }
        let sources = from.sources(known)?.into_iter().filter(|s| seen.contains(&hashing::hex(&s.content_hash)));
        self.end_layer(&head, sources.map(without_folder).collect())
    }

    /// Begins a layer. Its tiles and [`Extract::end_layer`] must follow before the next layer.
    ///
    /// # Errors
    /// [`StoreError::LayerName`], where the layer exists already, or the disk is full.
    pub fn begin_layer(&self, head: &LayerHead) -> Result<(), StoreError> {
        layer::check_stored_name(&head.name)?;
        let begin = || -> rusqlite::Result<()> {
            self.connection.execute_batch("BEGIN")?;
            geopackage::create_tile_table(&self.connection, &head.name)?;
            self.connection.execute(
                "INSERT INTO overfly_layers (name, complete, base_zoom, min_zoom) VALUES (?1, 0, ?2, ?3)",
                params![head.name, head.base_zoom, head.min_zoom],
            )?;
            Ok(())
        };
        begin().map_err(|e| self.fail(e))
    }

    /// Adds a tile as it is.
    ///
    /// # Errors
    /// Where the layer has the tile already, or the disk is full.
    pub fn put(&self, layer: &str, tile: &StoredTile) -> Result<(), StoreError> {
        let rows = TileRows {
            footprint: &tile.footprint,
            image: &tile.image,
            descriptors: tile.descriptors.as_deref(),
            cells: tile.cells.as_deref(),
        };
        insert_tile(&self.connection, self.version, layer, &rows).map_err(|e| self.fail(e))
    }

    /// Returns a tile that was added, as the overview above it needs it: `None` if there is none.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn child(&self, layer: &str, tile: TileId) -> Result<Option<Child>, StoreError> {
        let found = content::placed_child(&self.connection, layer, tile).map_err(|e| self.fail(e))?;
        found.map_or(Ok(None), |below| below.proved(&self.draft.0, layer, tile))
    }

    /// Stores the inputs hash of a tile, so that a build need not make the tile again.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn put_inputs(&self, layer: &str, tile: TileId, inputs_hash: &[u8; 32]) -> Result<(), StoreError> {
        tile_rows::put_inputs(&self.connection, layer, tile, inputs_hash).map_err(|e| self.fail(e))
    }

    /// Declares a layer finished.
    ///
    /// # Errors
    /// Where a source is given twice, or the disk is full.
    pub fn end_layer(&self, head: &LayerHead, mut sources: Vec<Source>) -> Result<(), StoreError> {
        sources.sort_by_key(|s| s.content_hash);
        let LayerHead { name, base_zoom, min_zoom, zoom_override, terms, terrain } = head.clone();
        let declaration = Declaration { layer: name, sources, zoom_override, base_zoom, min_zoom, terms, terrain };
        let end = || -> rusqlite::Result<()> {
            for one in &declaration.sources {
                source::insert(&self.connection, self.version, &declaration.layer, SourceTable::Finished, one)?;
            }
            finish::declare(&self.connection, self.version, &declaration)?;
            geopackage::declare_footprints(&self.connection)?;
            self.connection.execute_batch("COMMIT")
        };
        end().map_err(|e| self.fail(e))
    }

    /// Returns the layers so far, by name.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn layers(&self) -> Result<Vec<Layer>, StoreError> {
        layer::load_all(&self.connection, self.version, &self.draft.0)
    }

    /// Returns the digests of one level of a layer, and its footprints.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn level(&self, layer: &str, zoom: u8) -> Result<(LevelDigests, Vec<Footprint>), StoreError> {
        let fail = |e| StoreError::own_file(&self.draft.0, e);
        let sql = format!(
            "SELECT {} FROM footprints f WHERE f.layer = ?1 AND f.zoom = ?2 ORDER BY f.tile_row, f.tile_column",
            footprint_rows::columns(self.version)
        );
        let footprints = reader::collect(&self.connection, &sql, (layer, zoom)).map_err(fail)?;
        let cells = cells::load(&self.connection, layer, zoom).map_err(fail)?;
        Ok((LevelDigests::from_rows(&LevelOf { layer, zoom, version: self.version }, &footprints, &cells), footprints))
    }

    /// Returns the digest of the store so far, hexadecimal.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn digest(&self) -> Result<String, StoreError> {
        let found = reader::stored_digest(&self.connection, &self.contract);
        found.map(|d| hashing::hex(&d)).map_err(|e| StoreError::own_file(&self.draft.0, e))
    }

    /// Writes the store and its manifest, if any, to `target`, which must not exist or be empty. The file is compact: table after
    /// table, without unused pages. Each page ends in `reserved` zero bytes, which SQLite does not use. The file is not synced.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn finish(self, target: &Path, manifest: Option<&str>, reserved: u8) -> Result<(), StoreError> {
        if let Some(manifest) = manifest {
            manifest::write(&self.connection, manifest).map_err(|e| self.fail(e))?;
        }
        let uri = format!("{}?reserve={reserved}", file_uri(target));
        self.connection.execute("VACUUM INTO ?1", [uri]).map_err(|e| StoreError::own_file(target, e))?;
        // SQLite takes pages that it cannot read to their end for zeros, and copies these.
        let found = verify::verify(target, &|_, _| ())?;
        let tile = found.bad_tiles.first().map(|bad| format!("tile {}: {}", bad.id, bad.reason));
        match found.problems.into_iter().next().or(tile) {
            None => Ok(()),
            Some(reason) => Err(StoreError::DiskError { path: target.into(), reason }),
        }
    }

    fn fail(&self, error: rusqlite::Error) -> StoreError {
        StoreError::own_file(&self.draft.0, error)
    }
}

/// Creates and opens a draft, without a journal: an unfinished draft is of no use.
fn open(draft: &Path, contract: &str, version: u32) -> rusqlite::Result<Connection> {
    connection::create_draft(draft, contract, version)?;
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(draft, flags)?;
    connection.set_prepared_statement_cache_capacity(64);
    geometry::register_functions(&connection)?;
    connection.execute_batch(
        "PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA trusted_schema = 0;
         PRAGMA foreign_keys = 0",
    )?;
    Ok(connection)
}

/// Removes the folder from the path of a source. The aircraft does not need it, and it would make equal exports unequal.
fn without_folder(source: Source) -> Source {
    let path = source.path.file_name().map(PathBuf::from).unwrap_or_default();
    Source { path, ..source }
}
