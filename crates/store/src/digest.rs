//! Hashes of tiles, levels, layers and the whole store. None depends on paths, page layout, row order or the time of a build.

use super::Source;
use super::cells::TileCells;
use super::footprint::{self, Footprint};
use blake3::Hasher;
use rusqlite::Connection;

/// Formats bytes as hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Hashes the content of a tile: encoded imagery (which holds the mask), descriptors and cells. A tile built before format
/// version 3 has no cells, and keeps the hash it had then.
pub fn content_hash(media_type: &str, image: &[u8], descriptors: &[u8], cells: Option<&[u8]>) -> [u8; 32] {
    let context = if cells.is_some() { "overfly tile content 2" } else { "overfly tile content 1" };
    let mut hasher = Hasher::new_derive_key(context);
    for part in [Some(media_type.as_bytes()), Some(image), Some(descriptors), cells].into_iter().flatten() {
        text(&mut hasher, part);
    }
    hasher.finalize().into()
}

/// Returns the digest of the whole store, from its contract and the digests of the finished layers by name.
pub fn store_digest<'a>(contract: &str, layers: impl Iterator<Item = (&'a str, [u8; 32])>) -> [u8; 32] {
    let mut hasher = Hasher::new_derive_key("overfly store digest 1");
    text(&mut hasher, contract.as_bytes());
    for (name, digest) in layers {
        text(&mut hasher, name.as_bytes());
        hasher.update(&digest);
    }
    hasher.finalize().into()
}

/// Computes the digest of a layer from its rows.
pub(super) fn layer_digest(
    connection: &Connection,
    name: &str,
    base_zoom: u8,
    min_zoom: u8,
    sources: &[Source],
) -> rusqlite::Result<[u8; 32]> {
    let mut hasher = layer_hasher(name, base_zoom, min_zoom, sources);
    let sql = format!(
        "SELECT {} FROM footprints f WHERE f.layer = ?1 ORDER BY f.zoom, f.tile_row, f.tile_column",
        footprint::COLUMNS
    );
    let mut statement = connection.prepare(&sql)?;
    for row in statement.query_map([name], footprint::read)? {
        hash_footprint(&mut hasher, &row?);
    }
    Ok(hasher.finalize().into())
}

/// Computes the digest of a layer from footprints in the order of zoom, row and column.
pub(super) fn layer_digest_from(
    name: &str,
    base_zoom: u8,
    min_zoom: u8,
    sources: &[Source],
    footprints: &[Footprint],
) -> [u8; 32] {
    let mut hasher = layer_hasher(name, base_zoom, min_zoom, sources);
    for footprint in footprints {
        hash_footprint(&mut hasher, footprint);
    }
    hasher.finalize().into()
}

fn layer_hasher(name: &str, base_zoom: u8, min_zoom: u8, sources: &[Source]) -> Hasher {
    let mut hasher = Hasher::new_derive_key("overfly layer digest 1");
    text(&mut hasher, name.as_bytes());
    hasher.update(&[base_zoom, min_zoom]);
    let mut sorted: Vec<_> = sources.iter().collect();
    sorted.sort_by_key(|s| s.content_hash);
    hasher.update(&(sorted.len() as u64).to_le_bytes());
    for source in sorted {
        hash_source(&mut hasher, source);
    }
    hasher
}

/// Computes the digest of the footprints of one level, in the order of row and column.
pub(super) fn footprints_digest<'a>(footprints: impl Iterator<Item = &'a Footprint>) -> [u8; 32] {
    let mut hasher = Hasher::new_derive_key("overfly level footprints 1");
    for footprint in footprints {
        hash_footprint(&mut hasher, footprint);
    }
    hasher.finalize().into()
}

/// Computes the digest of the cells of one level, in the order of row and column: row, column and cells of each tile that has
/// cells.
pub(super) fn cells_digest(cells: &[TileCells]) -> [u8; 32] {
    let mut hasher = Hasher::new_derive_key("overfly level cells 1");
    for ([column, row], blob) in cells {
        hasher.update(&row.to_le_bytes());
        hasher.update(&column.to_le_bytes());
        text(&mut hasher, blob);
    }
    hasher.finalize().into()
}

/// Returns a short hash that tells whether a footprint is the one that was read before.
pub(super) fn footprint_check(footprint: &Footprint) -> [u8; 16] {
    let mut hasher = Hasher::new_derive_key("overfly footprint check 1");
    hash_footprint(&mut hasher, footprint);
    let mut check = [0; 16];
    hasher.finalize_xof().fill(&mut check);
    check
}

/// Hashes the properties of a source that decide the pixels and the row of a tile: content, date, stated CRS, stretch and error.
pub fn hash_source(hasher: &mut Hasher, source: &Source) {
    hasher.update(&source.content_hash);
    optional(hasher, source.acquired.as_deref());
    hasher.update(&source.crs_epsg.map_or([0xff; 8], |code| u64::from(code).to_le_bytes()));
    let (low, high) = source.stretch.unwrap_or((f64::NAN, f64::NAN));
    for value in [low, high, source.horizontal_error_m] {
        hasher.update(&value.to_bits().to_le_bytes());
    }
}

fn hash_footprint(hasher: &mut Hasher, footprint: &Footprint) {
    let tile = footprint.tile;
    hasher.update(&[tile.zoom()]);
    hasher.update(&tile.row().to_le_bytes());
    hasher.update(&tile.column().to_le_bytes());
    hasher.update(&footprint.content_hash);
    optional(hasher, footprint.acquired.as_deref());
    for value in [footprint.valid_fraction, footprint.horizontal_error_m, footprint.distinctiveness] {
        hasher.update(&value.to_bits().to_le_bytes());
    }
    hasher.update(&footprint.keypoints.to_le_bytes());
    text(hasher, footprint.sources.as_bytes());
}

fn optional(hasher: &mut Hasher, value: Option<&str>) {
    match value {
        Some(value) => text(hasher, value.as_bytes()),
        None => {
            hasher.update(&u64::MAX.to_le_bytes());
        }
    }
}

fn text(hasher: &mut Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}
