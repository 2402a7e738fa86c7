//! Hashes of tiles, levels, layers and the whole store. None depends on paths, page layout, row order or the time of a build.

use super::Source;
use super::cells::TileCells;
use super::footprint::Footprint;
use super::footprint_rows;
use super::hashing::{error_bits, optional, place, text};
use super::layer::Layer;
use super::terms::Terms;
use super::terrain::Terrain;
use super::versions::PLACES_SINCE;
use blake3::Hasher;
use rusqlite::Connection;

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

/// What of a layer its digest holds beside footprints and sources.
#[derive(Debug, Clone, Copy)]
pub(super) struct LayerHashed<'a> {
    pub name: &'a str,
    pub base_zoom: u8,
    pub min_zoom: u8,
    pub terms: &'a Terms,
    pub terrain: Option<&'a Terrain>,
}

impl<'a> From<&'a Layer> for LayerHashed<'a> {
    fn from(layer: &'a Layer) -> Self {
        let Layer { name, base_zoom, min_zoom, terms, terrain, .. } = layer;
        Self { name, base_zoom: *base_zoom, min_zoom: *min_zoom, terms, terrain: terrain.as_ref() }
    }
}

/// Computes the digest of a layer from its rows, in a store of a format version.
pub(super) fn layer_digest(
    connection: &Connection,
    layer: &LayerHashed<'_>,
    version: u32,
    sources: &[Source],
) -> rusqlite::Result<[u8; 32]> {
    let hasher = layer_hasher(layer, version, sources);
    hash_rows(connection, hasher, (layer.name, layer.name), version, &|footprint| footprint)
}

/// Adds the footprints of a layer to its digest, each altered, under the name that the layer will have.
pub(super) fn hash_rows(
    connection: &Connection,
    mut hasher: Hasher,
    (stored, name): (&str, &str),
    version: u32,
    alter: &dyn Fn(Footprint) -> Footprint,
) -> rusqlite::Result<[u8; 32]> {
    let sql = format!(
        "SELECT {} FROM footprints f WHERE f.layer = ?1 ORDER BY f.zoom, f.tile_row, f.tile_column",
        footprint_rows::columns(version)
    );
    let mut statement = connection.prepare(&sql)?;
    for row in statement.query_map([stored], footprint_rows::read)? {
        hash_footprint(&mut hasher, name, version, &alter(row?));
    }
    Ok(hasher.finalize().into())
}

/// Computes the digest of a layer from footprints in the order of zoom, row and column.
pub(super) fn layer_digest_from(
    layer: &LayerHashed<'_>,
    version: u32,
    sources: &[Source],
    footprints: &[Footprint],
) -> [u8; 32] {
    let mut hasher = layer_hasher(layer, version, sources);
    for footprint in footprints {
        hash_footprint(&mut hasher, layer.name, version, footprint);
    }
    hasher.finalize().into()
}

pub(super) fn layer_hasher(layer: &LayerHashed<'_>, version: u32, sources: &[Source]) -> Hasher {
    let binds_places = version >= PLACES_SINCE;
    let mut hasher =
        Hasher::new_derive_key(if binds_places { "overfly layer digest 2" } else { "overfly layer digest 1" });
    text(&mut hasher, layer.name.as_bytes());
    hasher.update(&[layer.base_zoom, layer.min_zoom]);
    if binds_places {
        optional(&mut hasher, layer.terms.licence.as_deref());
        optional(&mut hasher, layer.terms.attribution.as_deref());
    }
    let mut sorted: Vec<_> = sources.iter().collect();
    sorted.sort_by_key(|s| s.content_hash);
    hasher.update(&(sorted.len() as u64).to_le_bytes());
    for source in sorted {
        let error_m = if binds_places { source.horizontal_error_m } else { Some(unsigned_error(source)) };
        hash_source_with(&mut hasher, source, error_bits(error_m));
    }
    hash_terrain(&mut hasher, layer.terrain);
    hasher
}

/// Adds what a layer states of its heights; nothing for imagery.
pub(super) fn hash_terrain(hasher: &mut Hasher, terrain: Option<&Terrain>) {
    if let Some(Terrain { vertical_datum, vertical_error_m }) = terrain {
        text(hasher, b"terrain");
        text(hasher, vertical_datum.word().as_bytes());
        hasher.update(&error_bits(*vertical_error_m));
    }
}

/// A level of a layer, in a store of a format version.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelOf<'a> {
    pub layer: &'a str,
    pub zoom: u8,
    pub version: u32,
}

/// Computes the digest of the footprints of one level, in the order of row and column.
pub(super) fn footprints_digest<'a>(level: &LevelOf<'_>, footprints: impl Iterator<Item = &'a Footprint>) -> [u8; 32] {
    let binds_places = level.version >= PLACES_SINCE;
    let context = if binds_places { "overfly level footprints 2" } else { "overfly level footprints 1" };
    let mut hasher = Hasher::new_derive_key(context);
    for footprint in footprints {
        hash_footprint(&mut hasher, level.layer, level.version, footprint);
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
pub(super) fn footprint_check(layer: &str, footprint: &Footprint) -> [u8; 16] {
    let mut check = [0; 16];
    check.copy_from_slice(&footprint.hash(layer)[..16]);
    check
}

/// Hashes the properties of a source that decide the pixels and the row of a tile: content, date, stated CRS, stretch and error. An
/// unknown error counts as 0, as before it could be told from a stated 0, which counts as -0: so tiles of older stores keep their
/// inputs hash.
pub fn hash_source(hasher: &mut Hasher, source: &Source) {
    let error_m = source.horizontal_error_m.map_or(0.0, |error_m| if error_m == 0.0 { -0.0 } else { error_m });
    hash_source_with(hasher, source, error_m.to_bits().to_le_bytes());
}

fn hash_source_with(hasher: &mut Hasher, source: &Source, error: [u8; 8]) {
    hasher.update(&source.content_hash);
    optional(hasher, source.acquired.as_deref());
    hasher.update(&source.crs_epsg.map_or([0xff; 8], |code| u64::from(code).to_le_bytes()));
    let (low, high) = source.stretch.unwrap_or((f64::NAN, f64::NAN));
    for value in [low, high] {
        hasher.update(&value.to_bits().to_le_bytes());
    }
    hasher.update(&error);
}

/// The error of a source as formats before [`PLACES_SINCE`] store it.
fn unsigned_error(source: &Source) -> f64 {
    source.horizontal_error_m.unwrap_or(0.0)
}

/// Adds a footprint to the digest of a layer or level, in a store of a format version.
fn hash_footprint(hasher: &mut Hasher, layer: &str, version: u32, footprint: &Footprint) {
    if version >= PLACES_SINCE {
        hasher.update(&footprint.hash(layer));
        return;
    }
    place(hasher, footprint.tile);
    hasher.update(&footprint.content_hash);
    optional(hasher, footprint.acquired.as_deref());
    let error_m = footprint.horizontal_error_m.unwrap_or(0.0);
    for value in [footprint.valid_fraction, error_m, footprint.distinctiveness] {
        hasher.update(&value.to_bits().to_le_bytes());
    }
    hasher.update(&footprint.keypoints.to_le_bytes());
    text(hasher, footprint.sources.as_bytes());
}
