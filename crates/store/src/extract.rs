//! `Extract`: a store being made of chosen tiles of another one. What is put in the same order becomes the same bytes.

use super::connection::{self, file_uri};
use super::content::{self, Child};
use super::declaration::Declaration;
use super::digest;
use super::geometry;
use super::layer::{self, Layer};
use super::level::LevelDigests;
use super::source::{self, Declared};
use super::writer::{Placed, place_content};
use super::{
    Footprint, Reader, Source, StoreError, StoredTile, cells, finish, footprint, geopackage, imagery, manifest, reader,
    verify,
};
use overfly_core::tile::TileId;
use rusqlite::{Connection, OpenFlags, params};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// What a layer is, but for its tiles and sources.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerHead {
    /// Its name.
    pub name: String,
    /// The finest level.
    pub base_zoom: u8,
    /// The coarsest level.
    pub min_zoom: u8,
    /// The base zoom that the user stated when it was built, where so.
    pub zoom_override: Option<u8>,
}

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
    /// The JPEG quality, 1 to 100, to encode imagery with anew, where it shall be smaller; so its content hash is another.
    pub jpeg_quality: Option<u8>,
}

impl LayerPart {
    /// A tile without what is not taken of it.
    fn lightened(&self, mut tile: StoredTile) -> Result<StoredTile, StoreError> {
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
        let connection = open(&draft.0, contract).map_err(|e| StoreError::of_own_file(&draft.0, e))?;
        Ok(Self { draft, connection, contract: contract.to_owned() })
    }

    /// Copies a part of a layer of `from`, every tile's hash proved, and declares it finished. `progress` is called after
    /// each tile.
    ///
    /// # Errors
    /// Where a tile is damaged, a layer is taken twice, or the disk is full.
    pub fn copy(&mut self, from: &Reader, part: &LayerPart, mut progress: impl FnMut()) -> Result<(), StoreError> {
        let known = from.layer(&part.name)?;
        let head = LayerHead {
            name: part.name.clone(),
            base_zoom: part.base_zoom,
            min_zoom: part.min_zoom,
            zoom_override: None,
        };
        self.begin_layer(&head)?;
        let mut seen = HashSet::new();
        for &tile in &part.tiles {
            let Some(stored) = from.stored_tile(known, tile)? else { continue };
            let stored = part.lightened(stored)?;
            seen.extend(stored.footprint.sources.split(' ').map(str::to_owned));
            self.put(&head.name, &stored)?;
            progress();
        }
        let sources = from.sources(known)?.into_iter().filter(|s| seen.contains(&digest::hex(&s.content_hash)));
        self.end_layer(&head, sources.map(without_folder).collect())
    }

    /// Begins a layer, which shall get its tiles and [`Extract::end_layer`] before the next.
    ///
    /// # Errors
    /// [`StoreError::LayerName`], where there is one of that name, or the disk is full.
    pub fn begin_layer(&self, head: &LayerHead) -> Result<(), StoreError> {
        layer::check_name(&head.name)?;
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

    /// Puts a tile as it is.
    ///
    /// # Errors
    /// Where the layer has it already, or the disk is full.
    pub fn put(&self, layer: &str, tile: &StoredTile) -> Result<(), StoreError> {
        let placed = Placed {
            footprint: &tile.footprint,
            image: &tile.image,
            descriptors: tile.descriptors.as_deref(),
            cells: tile.cells.as_deref(),
        };
        place_content(&self.connection, layer, &placed).map_err(|e| self.fail(e))
    }

    /// What an overview needs to know of a tile that was put; `None` where there is none.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn child(&self, layer: &str, tile: TileId) -> Result<Option<Child>, StoreError> {
        let found = content::placed_child(&self.connection, layer, tile).map_err(|e| self.fail(e))?;
        found.map_or(Ok(None), |below| below.proved(&self.draft.0, layer, tile))
    }

    /// Notes what a tile was made from, so that a build need not make it again.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn note_inputs(&self, layer: &str, tile: TileId, inputs_hash: &[u8; 32]) -> Result<(), StoreError> {
        finish::note_inputs(&self.connection, layer, tile, inputs_hash).map_err(|e| self.fail(e))
    }

    /// Declares a layer finished.
    ///
    /// # Errors
    /// Where a source is given twice, or the disk is full.
    pub fn end_layer(&self, head: &LayerHead, mut sources: Vec<Source>) -> Result<(), StoreError> {
        sources.sort_by_key(|s| s.content_hash);
        let LayerHead { name, base_zoom, min_zoom, zoom_override } = head.clone();
        let declaration = Declaration { layer: name, sources, zoom_override, base_zoom, min_zoom };
        let end = || -> rusqlite::Result<()> {
            for one in &declaration.sources {
                source::insert(&self.connection, &declaration.layer, Declared::Finished, one)?;
            }
            finish::declare(&self.connection, &declaration)?;
            geopackage::declare_footprints(&self.connection)?;
            self.connection.execute_batch("COMMIT")
        };
        end().map_err(|e| self.fail(e))
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
        let fail = |e| StoreError::of_own_file(&self.draft.0, e);
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
        found.map(|d| digest::hex(&d)).map_err(|e| StoreError::of_own_file(&self.draft.0, e))
    }

    /// Writes the store to `target` (absent or empty), compact: table after table, without an unused page; each page ends
    /// in `reserved` bytes that SQLite leaves alone, zeros. With it goes its manifest, where it has one. Not yet synced.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn finish(self, target: &Path, manifest: Option<&str>, reserved: u8) -> Result<(), StoreError> {
        if let Some(manifest) = manifest {
            manifest::write(&self.connection, manifest).map_err(|e| self.fail(e))?;
        }
        let uri = format!("{}?reserve={reserved}", file_uri(target));
        self.connection.execute("VACUUM INTO ?1", [uri]).map_err(|e| StoreError::of_own_file(target, e))?;
        // What SQLite cannot read to its end it takes for zeros, and writes these.
        let found = verify::verify(target, &|_, _| ())?;
        let tile = found.bad_tiles.first().map(|bad| format!("tile {}: {}", bad.id, bad.reason));
        match found.problems.into_iter().next().or(tile) {
            None => Ok(()),
            Some(reason) => Err(StoreError::DiskError { path: target.into(), reason }),
        }
    }

    fn fail(&self, error: rusqlite::Error) -> StoreError {
        StoreError::of_own_file(&self.draft.0, error)
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
