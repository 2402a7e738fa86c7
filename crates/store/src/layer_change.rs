//! Changes of a layer that no build makes: another name, description, terms or date, and its removal. Each is one transaction, and
//! can be previewed without a write.

use super::connection::{self, Access, OpenedStore};
use super::contract::require_contract;
use super::digest::{self, LayerHashed};
use super::footprint::Footprint;
use super::footprint_rows;
use super::layer::{self, Layer};
use super::source::{self, SourceTable};
use super::terms::Terms;
use super::{FORMAT_VERSION, Source, StoreError, coverage, finish, geopackage, hashing, manifest, reader};
use overfly_core::tile::TileId;
use rusqlite::{Connection, OptionalExtension, Transaction, TransactionBehavior, params};
use std::collections::HashMap;
use std::path::Path;

/// Footprints that are changed at once.
const CHUNK: usize = 4096;

/// The tables with a column `layer` that follow a layer's new name. The footprints hold it too, and hash it.
const TABLES_OF_LAYERS: [&str; 4] = ["overfly_sources", "overfly_tile_inputs", "overfly_terrain", "overfly_index"];

/// What to change of a layer.
#[derive(Debug, Clone, PartialEq)]
pub enum LayerChange {
    /// Give it another name.
    Rename {
        /// The new name.
        to: String,
    },
    /// Describe it anew.
    Describe(LayerDescription),
    /// Remove it.
    Remove,
}

/// What a planner states of a layer. What is `None` stays as it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerDescription {
    /// A text for people, which GIS tools show. No digest holds it. Empty: none.
    pub description: Option<String>,
    /// Licence. Empty: none.
    pub licence: Option<String>,
    /// Attribution. Empty: none.
    pub attribution: Option<String>,
    /// The acquisition date of all sources.
    pub date: Option<StatedDate>,
}

/// An acquisition date of all sources of a layer, and what its tiles are made from with that date.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedDate {
    /// The date, ISO 8601.
    pub date: String,
    /// The inputs hash of each tile, with that date.
    pub inputs: HashMap<TileId, [u8; 32]>,
}

/// What a change does, or would do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayerChanged {
    /// Number of tiles of the layer.
    pub tiles: u64,
    /// Digest of the store before, hexadecimal; `None` where it has no finished layer.
    pub digest_before: Option<String>,
    /// Digest of the store afterwards; `None` where no finished layer is left.
    pub digest_after: Option<String>,
    /// The format version of the store before, where it is older than this program's: the change migrates it, which also changes its
    /// digest. A preview then states no digest.
    pub migrates_from: Option<u32>,
}

/// Returns what a change would do. Writes nothing.
///
/// # Errors
/// As [`change_layer`].
pub fn preview_layer_change(path: &Path, name: &str, change: &LayerChange) -> Result<LayerChanged, StoreError> {
    let OpenedStore { connection, version, .. } = connection::open_read(path, Access::Shared)?;
    let fail = |e| StoreError::sqlite(path, e);
    if version >= manifest::SINCE && manifest::read(&connection).map_err(fail)?.is_some() {
        return Err(StoreError::Sealed { path: path.into() });
    }
    let contract = require_contract(&connection, path)?;
    let layer = changeable(&connection, version, path, name, change)?;
    let migrates_from = (version < FORMAT_VERSION).then_some(version);
    let digest_after = match migrates_from {
        Some(_) => None,
        None => digest_after(&connection, &contract, &layer, change).map_err(fail)?,
    };
    let digest_before = store_digest(&connection, &contract).map_err(fail)?;
    Ok(LayerChanged { tiles: layer.tiles, digest_before, digest_after, migrates_from })
}

/// Changes a layer of a built store in one transaction. An interrupted change leaves the store as it was.
///
/// # Errors
/// [`StoreError::NoLayer`]; [`StoreError::Sealed`] for an exported store; [`StoreError::LayerName`] and [`StoreError::LayerExists`] for
/// the new name; [`StoreError::Unfinished`] where a build of the layer is pending, unless it is removed; where the file cannot be
/// written.
pub fn change_layer(path: &Path, name: &str, change: &LayerChange) -> Result<LayerChanged, StoreError> {
    let before = before(path)?;
    let connection = connection::open_write(path)?;
    let contract = require_contract(&connection, path)?;
    let fail = |e| StoreError::sqlite(path, e);
    // The pages of a large layer must not all wait in memory.
    connection.execute_batch("PRAGMA cache_spill = 1; PRAGMA temp_store = FILE").map_err(fail)?;
    let transaction = Transaction::new_unchecked(&connection, TransactionBehavior::Immediate).map_err(fail)?;
    let layer = changeable(&transaction, FORMAT_VERSION, path, name, change)?;
    match change {
        LayerChange::Rename { to } => rename(&transaction, &layer, to),
        LayerChange::Describe(description) => describe(&transaction, &layer, description),
        LayerChange::Remove => finish::remove(&transaction, name),
    }
    .map_err(fail)?;
    let digest_after = store_digest(&transaction, &contract).map_err(fail)?;
    transaction.commit().map_err(fail)?;
    finish::compact(connection, path)?;
    let (digest_before, version) = before.unzip();
    let migrates_from = version.filter(|version| *version < FORMAT_VERSION);
    Ok(LayerChanged { tiles: layer.tiles, digest_before: digest_before.flatten(), digest_after, migrates_from })
}

/// Digest and format version of a store; `None` for one that this program only migrates.
fn before(path: &Path) -> Result<Option<(Option<String>, u32)>, StoreError> {
    match connection::open_read(path, Access::Shared) {
        Ok(OpenedStore { connection, version, .. }) => {
            let contract = require_contract(&connection, path)?;
            let digest = store_digest(&connection, &contract).map_err(|e| StoreError::sqlite(path, e))?;
            Ok(Some((digest, version)))
        }
        Err(StoreError::OlderFormat { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// The digest of a store, hexadecimal; `None` where it has no finished layer.
fn store_digest(connection: &Connection, contract: &str) -> rusqlite::Result<Option<String>> {
    let finished: u32 =
        connection.query_row("SELECT count(*) FROM overfly_layers WHERE complete = 1", [], |row| row.get(0))?;
    if finished == 0 {
        return Ok(None);
    }
    Ok(Some(hashing::hex(&reader::stored_digest(connection, contract)?)))
}

/// The layer, where it can be changed so.
fn changeable(
    connection: &Connection,
    version: u32,
    path: &Path,
    name: &str,
    change: &LayerChange,
) -> Result<Layer, StoreError> {
    let mut layers = layer::load_all(connection, version, path)?;
    let Some(index) = layers.iter().position(|layer| layer.name == name) else {
        let known: Vec<_> = layers.iter().map(|l| l.name.as_str()).collect();
        return Err(StoreError::NoLayer { path: path.into(), name: name.into(), known: known.join(", ") });
    };
    let layer = layers.swap_remove(index);
    if *change == LayerChange::Remove {
        return Ok(layer);
    }
    let fail = |e| StoreError::sqlite(path, e);
    if !layer.complete || is_pending(connection, name).map_err(fail)? {
        return Err(StoreError::Unfinished { path: path.into(), layer: name.into() });
    }
    if let LayerChange::Rename { to } = change {
        layer::check_name(to)?;
        if has_object(connection, to).map_err(fail)? {
            return Err(StoreError::LayerExists { path: path.into(), name: to.clone() });
        }
    }
    Ok(layer)
}

fn is_pending(connection: &Connection, layer: &str) -> rusqlite::Result<bool> {
    let sql = "SELECT 1 FROM overfly_pending WHERE layer = ?1";
    Ok(connection.query_row(sql, [layer], |_| Ok(())).optional()?.is_some())
}

/// Whether a layer, or a table of another program, has a name. SQLite does not tell upper from lower case.
fn has_object(connection: &Connection, name: &str) -> rusqlite::Result<bool> {
    let sql = "SELECT 1 FROM sqlite_schema WHERE name = ?1 COLLATE NOCASE
               UNION ALL SELECT 1 FROM gpkg_contents WHERE identifier = ?1 COLLATE NOCASE LIMIT 1";
    Ok(connection.query_row(sql, [name], |_| Ok(())).optional()?.is_some())
}

/// Digest of the store after a change, computed from its rows; `None` where no finished layer is left.
fn digest_after(
    connection: &Connection,
    contract: &str,
    layer: &Layer,
    change: &LayerChange,
) -> rusqlite::Result<Option<String>> {
    let mut digests = reader::layer_digests(connection)?;
    digests.retain(|(name, _)| *name != layer.name);
    let mut sources = source::load(connection, &layer.name, SourceTable::Finished, FORMAT_VERSION)?;
    let (name, terms, date) = match change {
        LayerChange::Remove => ("", Terms::default(), None),
        LayerChange::Rename { to } => (to.as_str(), layer.terms.clone(), None),
        LayerChange::Describe(description) => {
            let date = description.date.as_ref().map(|stated| stated.date.as_str());
            (layer.name.as_str(), stated_terms(&layer.terms, description), date)
        }
    };
    if *change != LayerChange::Remove {
        let hashed = LayerHashed { name, terms: &terms, ..LayerHashed::from(layer) };
        date_sources(&mut sources, date);
        let hasher = digest::layer_hasher(&hashed, FORMAT_VERSION, &sources);
        let dated = |footprint| dated(footprint, date);
        let digest = digest::hash_rows(connection, hasher, (&layer.name, name), FORMAT_VERSION, &dated)?;
        digests.push((name.to_owned(), digest));
        digests.sort();
    }
    if digests.is_empty() {
        return Ok(None);
    }
    let digest = digest::store_digest(contract, digests.iter().map(|(name, digest)| (name.as_str(), *digest)));
    Ok(Some(hashing::hex(&digest)))
}

fn date_sources(sources: &mut [Source], date: Option<&str>) {
    if let Some(date) = date {
        sources.iter_mut().for_each(|source| source.acquired = Some(date.to_owned()));
    }
}

fn dated(footprint: Footprint, date: Option<&str>) -> Footprint {
    match date {
        Some(date) => Footprint { acquired: Some(date.to_owned()), ..footprint },
        None => footprint,
    }
}

/// The terms of a layer with what a description states.
fn stated_terms(terms: &Terms, description: &LayerDescription) -> Terms {
    let stated = |new: &Option<String>, old: &Option<String>| match new {
        Some(text) => Some(text.clone()).filter(|text| !text.is_empty()),
        None => old.clone(),
    };
    Terms {
        licence: stated(&description.licence, &terms.licence),
        attribution: stated(&description.attribution, &terms.attribution),
    }
}

fn rename(connection: &Connection, layer: &Layer, to: &str) -> rusqlite::Result<()> {
    let from = layer.name.as_str();
    alter_footprints(connection, from, to, &|footprint| footprint)?;
    for table in TABLES_OF_LAYERS {
        connection.execute(&format!("UPDATE {table} SET layer = ?2 WHERE layer = ?1"), [from, to])?;
    }
    connection.execute("UPDATE overfly_layers SET name = ?2 WHERE name = ?1", [from, to])?;
    geopackage::rename(connection, from, to)?;
    coverage::rename(connection, from, to)?;
    put_digest(connection, &Layer { name: to.into(), ..layer.clone() })
}

fn describe(connection: &Connection, layer: &Layer, description: &LayerDescription) -> rusqlite::Result<()> {
    let name = layer.name.as_str();
    let terms = stated_terms(&layer.terms, description);
    connection.execute(
        "UPDATE overfly_layers SET licence = ?2, attribution = ?3 WHERE name = ?1",
        params![name, terms.licence, terms.attribution],
    )?;
    if let Some(text) = &description.description {
        geopackage::describe(connection, name, text)?;
    }
    if let Some(StatedDate { date, inputs }) = &description.date {
        connection.execute("UPDATE overfly_sources SET acquired = ?2 WHERE layer = ?1", [name, date])?;
        alter_footprints(connection, name, name, &|footprint| dated(footprint, Some(date)))?;
        for (tile, hash) in inputs {
            super::tile_rows::put_inputs(connection, name, *tile, hash)?;
        }
        geopackage::put_last_change(connection, name, &geopackage::last_change(Some(date)))?;
        geopackage::declare_footprints(connection)?;
    }
    put_digest(connection, &Layer { terms, ..layer.clone() })
}

/// Changes the footprints of a layer, and gives them the name `to`, with the hashes that follow.
fn alter_footprints(
    connection: &Connection,
    from: &str,
    to: &str,
    alter: &dyn Fn(Footprint) -> Footprint,
) -> rusqlite::Result<()> {
    let sql = format!(
        "SELECT {}, f.fid FROM footprints f WHERE f.layer = ?1 AND f.fid > ?2 ORDER BY f.fid LIMIT {CHUNK}",
        footprint_rows::columns(FORMAT_VERSION)
    );
    let mut last = i64::MIN;
    loop {
        let chunk: Vec<(i64, Footprint)> = connection
            .prepare_cached(&sql)?
            .query_map(params![from, last], |row| {
                Ok((row.get(footprint_rows::COLUMN_COUNT)?, footprint_rows::read(row)?))
            })?
            .collect::<rusqlite::Result<_>>()?;
        let Some(&(fid, _)) = chunk.last() else { return Ok(()) };
        last = fid;
        for (fid, footprint) in chunk {
            let footprint = alter(footprint);
            connection
                .prepare_cached("UPDATE footprints SET layer = ?2, acquired = ?3, hash = ?4 WHERE fid = ?1")?
                .execute(params![fid, to, footprint.acquired, footprint.hash(to)])?;
        }
    }
}

/// Computes the digest of a layer from its rows, and writes it.
fn put_digest(connection: &Connection, layer: &Layer) -> rusqlite::Result<()> {
    let sources = source::load(connection, &layer.name, SourceTable::Finished, FORMAT_VERSION)?;
    let digest = digest::layer_digest(connection, &LayerHashed::from(layer), FORMAT_VERSION, &sources)?;
    connection.execute("UPDATE overfly_layers SET digest = ?2 WHERE name = ?1", params![layer.name, digest])?;
    Ok(())
}
