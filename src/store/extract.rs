//! `Extract`: a store being made of chosen tiles of another one. What is put in the same order becomes the same bytes.

use super::connection::{self, file_uri};
use super::digest;
use super::geometry;
use super::layer::{self, Layer};
use super::level::LevelDigests;
use super::source::{self, Declared};
use super::writer::{Declaration, Placed, place_content};
use super::{Footprint, Reader, Source, StoreError, cells, finish, footprint, geopackage, manifest, reader};
use crate::tile::TileId;
use rusqlite::{Connection, OpenFlags, params};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// What to take of one layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerPart {
    /// The layer.
    pub name: String,
    /// The finest level to take.
    pub base_zoom: u8,
    /// The coarsest level to take.
    pub min_zoom: u8,
    /// Its tiles to take, by zoom, row and column; none twice.
    pub tiles: Vec<TileId>,
    /// Whether descriptors are taken; a tile without them has another content hash.
    pub with_descriptors: bool,
}

/// A store being made. A draft stands beside what it shall become until [`Extract::finish`]; dropped before, it is removed.
#[derive(Debug)]
pub struct Extract {
    draft: Draft,
    connection: Connection,
    contract: String,
}

/// The file that is removed at the end, whatever the end is.
#[derive(Debug)]
struct Draft(PathBuf);

impl Drop for Draft {
    fn drop(&mut self) {
        // Worthless either way; a draft that is left is overwritten by the next export to the same place.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Extract {
    /// Begins a store at `draft`; what stands there is lost.
    ///
    /// # Errors
    /// Where the folder is absent or may not be written, or the disk is full.
    pub fn begin(draft: &Path, contract: &str) -> Result<Self, StoreError> {
        let draft = Draft(draft.to_path_buf());
        let connection = open(&draft.0, contract).map_err(|e| StoreError::sqlite(&draft.0, e))?;
        Ok(Self { draft, connection, contract: contract.to_owned() })
    }

    /// Copies a part of a layer of `from`, every tile's hash proved, and declares it finished. `progress` is called after
    /// each tile.
    ///
    /// # Errors
    /// Where a tile is damaged, a layer is taken twice, or the disk is full.
    pub fn copy(&mut self, from: &Reader, part: &LayerPart, mut progress: impl FnMut()) -> Result<(), StoreError> {
        let known = from.layer(&part.name)?;
        let fail = |e| StoreError::sqlite(&self.draft.0, e);
        self.begin_layer(part).map_err(fail)?;
        let mut seen = HashSet::new();
        for &tile in &part.tiles {
            let Some(mut stored) = from.stored_tile(known, tile)? else { continue };
            if !part.with_descriptors {
                stored.descriptors = None;
                stored.footprint.content_hash =
                    digest::content_hash(stored.media_type, &stored.image, &[], stored.cells.as_deref());
            }
            seen.extend(stored.footprint.sources.split(' ').map(str::to_owned));
            let placed = Placed {
                footprint: &stored.footprint,
                image: &stored.image,
                descriptors: stored.descriptors.as_deref(),
                cells: stored.cells.as_deref(),
            };
            place_content(&self.connection, &part.name, &placed).map_err(fail)?;
            progress();
        }
        let sources = from.sources(known)?.into_iter().filter(|s| seen.contains(&digest::hex(&s.content_hash)));
        self.end_layer(part, sources.map(without_folder).collect()).map_err(fail)
    }

    fn begin_layer(&self, part: &LayerPart) -> rusqlite::Result<()> {
        self.connection.execute_batch("BEGIN")?;
        geopackage::create_tile_table(&self.connection, &part.name)?;
        self.connection.execute(
            "INSERT INTO overfly_layers (name, complete, base_zoom, min_zoom) VALUES (?1, 0, ?2, ?3)",
            params![part.name, part.base_zoom, part.min_zoom],
        )?;
        Ok(())
    }

    fn end_layer(&self, part: &LayerPart, mut sources: Vec<Source>) -> rusqlite::Result<()> {
        sources.sort_by_key(|s| s.content_hash);
        for one in &sources {
            source::insert(&self.connection, &part.name, Declared::Finished, one)?;
        }
        let (layer, base_zoom, min_zoom) = (part.name.clone(), part.base_zoom, part.min_zoom);
        let declaration = Declaration { layer, sources, zoom_override: None, base_zoom, min_zoom };
        finish::declare(&self.connection, &declaration)?;
        geopackage::declare_footprints(&self.connection)?;
        self.connection.execute_batch("COMMIT")
    }

    /// The layers so far, by name.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn layers(&self) -> Result<Vec<Layer>, StoreError> {
        layer::load_all(&self.connection, &self.draft.0)
    }

    /// What one level of a layer hashes to, and its footprints.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn level(&self, layer: &str, zoom: u8) -> Result<(LevelDigests, Vec<Footprint>), StoreError> {
        let fail = |e| StoreError::sqlite(&self.draft.0, e);
        let sql = format!(
            "SELECT {} FROM footprints f WHERE f.layer = ?1 AND f.zoom = ?2 ORDER BY f.tile_row, f.tile_column",
            footprint::COLUMNS
        );
        let footprints = reader::collect(&self.connection, &sql, (layer, zoom)).map_err(fail)?;
        let cells = cells::load(&self.connection, layer, zoom).map_err(fail)?;
        Ok((LevelDigests::of(zoom, &footprints, &cells), footprints))
    }

    /// The store's digest so far, hexadecimal.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn digest(&self) -> Result<String, StoreError> {
        let found = reader::stored_digest(&self.connection, &self.contract);
        found.map(|d| digest::hex(&d)).map_err(|e| StoreError::sqlite(&self.draft.0, e))
    }

    /// Writes the store to `target` (absent or empty), compact: table after table, without an unused page; each page ends
    /// in `reserved` bytes that SQLite leaves alone, zeros. With it goes its manifest. Not yet synced.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn finish(self, target: &Path, manifest: &str, reserved: u8) -> Result<(), StoreError> {
        manifest::write(&self.connection, manifest).map_err(|e| StoreError::sqlite(&self.draft.0, e))?;
        let uri = format!("{}?reserve={reserved}", file_uri(target));
        self.connection.execute("VACUUM INTO ?1", [uri]).map_err(|e| StoreError::sqlite(target, e))?;
        Ok(())
    }
}

/// A new draft: no journal, for it is worthless until it is finished; and pages leave memory as others come.
fn open(draft: &Path, contract: &str) -> rusqlite::Result<Connection> {
    connection::create_draft(draft, contract)?;
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

/// Where a source stood when it was built is nothing to the aircraft, and would make equal exports unequal.
fn without_folder(source: Source) -> Source {
    let path = source.path.file_name().map(PathBuf::from).unwrap_or_default();
    Source { path, ..source }
}
