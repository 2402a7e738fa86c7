//! The part of the migration to format 6 that SQL cannot do: hashes and outlines of the footprints there are, digests of layers.

use super::content::StoredChild;
use super::digest::{self, LayerHashed};
use super::footprint::Footprint;
use super::footprint_rows;
use super::source::{self, SourceTable};
use super::versions::PLACES_SINCE;
use super::{content, imagery, layer};
use rusqlite::types::Type;
use rusqlite::{Connection, params};

/// Footprints that are read at once.
const CHUNK: usize = 4096;

/// Fills hash and outline of every footprint, then the digests of the finished layers.
pub(super) fn fill(connection: &Connection) -> rusqlite::Result<()> {
    let mut last = i64::MIN;
    loop {
        let chunk = chunk_after(connection, last)?;
        let Some(&(fid, ..)) = chunk.last() else { break };
        last = fid;
        for (fid, layer, mut footprint) in chunk {
            if footprint.valid_fraction < 1.0 {
                footprint.valid_outline = outline(connection, &layer, &footprint)?;
            }
            connection.prepare_cached("UPDATE footprints SET valid_outline = ?2, hash = ?3 WHERE fid = ?1")?.execute(
                params![fid, footprint.valid_outline.as_ref().map(|o| o.to_bytes()), footprint.hash(&layer)],
            )?;
        }
    }
    let layers = layer::load_rows(connection, PLACES_SINCE)?;
    for layer in layers.iter().filter(|layer| layer.complete) {
        let sources = source::load(connection, &layer.name, SourceTable::Finished, PLACES_SINCE)?;
        let digest = digest::layer_digest(connection, &LayerHashed::from(layer), PLACES_SINCE, &sources)?;
        connection.execute("UPDATE overfly_layers SET digest = ?2 WHERE name = ?1", params![layer.name, digest])?;
    }
    Ok(())
}

/// The next footprints by `fid`, with `fid` and layer.
fn chunk_after(connection: &Connection, last: i64) -> rusqlite::Result<Vec<(i64, String, Footprint)>> {
    let sql = format!(
        "SELECT {}, f.fid FROM footprints f WHERE f.fid > ?1 ORDER BY f.fid LIMIT {CHUNK}",
        footprint_rows::columns(PLACES_SINCE)
    );
    let mut statement = connection.prepare_cached(&sql)?;
    let rows = statement.query_map([last], |row| {
        Ok((row.get(footprint_rows::COLUMN_COUNT)?, row.get(11)?, footprint_rows::read_unproved(row)?))
    })?;
    rows.collect()
}

/// The outline of a tile that is not wholly valid. A tile that does not have its stated hash ends the migration: from a tile that was
/// misread once, a footprint would get an outline whose hash is right for ever.
fn outline(
    connection: &Connection,
    layer: &str,
    footprint: &Footprint,
) -> rusqlite::Result<Option<overfly_core::pixels::MaskOutline>> {
    layer::stored_name(layer)?;
    let tile = footprint.tile;
    let pixels = match content::placed_child(connection, layer, tile)? {
        Some(StoredChild::Proved(child)) => imagery::decode(&child.image).ok(),
        _ => None,
    };
    let pixels = pixels.ok_or_else(|| {
        let reason = format!("tile {tile} of layer {layer} is damaged");
        rusqlite::Error::FromSqlConversionFailure(0, Type::Blob, reason.into())
    })?;
    Ok(content::outline_of(&pixels.mask))
}
