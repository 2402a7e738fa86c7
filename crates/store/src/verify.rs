//! Verification of a store: every hash, the digest, the rules of SQLite and GeoPackage. It reads the whole store and repairs
//! nothing.

use super::connection::{self, APPLICATION_ID, Access, OpenedStore, USER_VERSION};
use super::contract::require_contract;
use super::digest::LayerHashed;
use super::extent::extent;
use super::footprint::Footprint;
use super::footprint_rows;
use super::hashing;
use super::layer::{self, Layer};
use super::source::{self, SourceTable};
use super::{StoreError, digest, geometry, geopackage, imagery, reader};
use overfly_core::geodesy::WORLD_M;
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use rusqlite::{Connection, OptionalExtension, params};
use serde::Serialize;
use std::path::Path;

/// The result of a verification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Whether no problem was found.
    pub ok: bool,
    /// The digest computed from the rows of the store, hexadecimal.
    pub digest: String,
    /// Number of tiles read.
    pub tiles: u64,
    /// Every bad tile.
    pub bad_tiles: Vec<BadTile>,
    /// The other problems, one text each.
    pub problems: Vec<String>,
}

/// A tile that does not match its footprint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BadTile {
    /// Name of the layer.
    pub layer: String,
    /// Zoom, column, row.
    pub id: String,
    /// What is wrong.
    pub reason: String,
}

/// Verifies a store. Calls `progress` with the numbers of tiles done and of all tiles.
///
/// # Errors
/// Where the file cannot be opened as a store. Problems inside the store are in the result.
pub fn verify(path: &Path, progress: &dyn Fn(u64, u64)) -> Result<Verification, StoreError> {
    let OpenedStore { connection, version, .. } = connection::open_read(path, Access::Shared)?;
    let contract = require_contract(&connection, path)?;
    let layers = layer::load_all(&connection, version, path)?;
    let mut findings = Findings { bad_tiles: Vec::new(), problems: Vec::new(), tiles: 0 };
    findings.check("SQLite integrity", integrity(&connection));
    findings.check("GeoPackage header", header(&connection));
    findings.check("R-tree", rtree(&connection));
    let total = layers.iter().map(|l| l.tiles).sum();
    for layer in &layers {
        if !layer.complete {
            findings.problems.push(format!("layer {}: unfinished build", layer.name));
            continue;
        }
        findings.check(&format!("layer {}", layer.name), declaration(&connection, layer));
        findings.check(&format!("layer {}", layer.name), layer_rows(&connection, version, layer));
        if let Err(error) = findings.tiles(&connection, version, layer, &|done| progress(done, total)) {
            findings.problems.push(format!("layer {}: its tiles cannot be read: {error}", layer.name));
        }
    }
    let digest = reader::stored_digest(&connection, &contract).map_err(|e| StoreError::sqlite(path, e))?;
    let Findings { bad_tiles, problems, tiles } = findings;
    let ok = bad_tiles.is_empty() && problems.is_empty();
    Ok(Verification { ok, digest: hashing::hex(&digest), tiles, bad_tiles, problems })
}

/// The findings so far.
struct Findings {
    bad_tiles: Vec<BadTile>,
    problems: Vec<String>,
    tiles: u64,
}

impl Findings {
    fn check(&mut self, what: &str, found: rusqlite::Result<Vec<String>>) {
        match found {
            Ok(problems) => self.problems.extend(problems.into_iter().map(|p| format!("{what}: {p}"))),
            Err(error) => self.problems.push(format!("{what}: cannot be checked: {error}")),
        }
    }

    /// Compares imagery, descriptors and cells of every tile with its footprint.
    fn tiles(
        &mut self,
        connection: &Connection,
        version: u32,
        layer: &Layer,
        progress: &dyn Fn(u64),
    ) -> rusqlite::Result<()> {
        let sql = format!(
            "SELECT {}, f.fid, f.geom FROM footprints f WHERE f.layer = ?1 ORDER BY f.zoom, f.tile_row, f.tile_column",
            footprint_rows::columns(version)
        );
        let mut statement = connection.prepare(&sql)?;
        let mut rows = statement.query([&layer.name])?;
        while let Some(row) = rows.next()? {
            let footprint = footprint_rows::read(row)?;
            let found = bad_tile(
                connection,
                layer,
                &footprint,
                row.get(footprint_rows::COLUMN_COUNT)?,
                &row.get::<_, Vec<u8>>(footprint_rows::COLUMN_COUNT + 1)?,
            )
            .unwrap_or_else(|error| Some(error.to_string()));
            if let Some(reason) = found {
                self.bad_tiles.push(BadTile { layer: layer.name.clone(), id: footprint.tile.to_string(), reason });
            }
            self.tiles += 1;
            progress(self.tiles);
        }
        Ok(())
    }
}

/// Returns what is wrong with a tile, if anything.
fn bad_tile(
    connection: &Connection,
    layer: &Layer,
    footprint: &Footprint,
    fid: i64,
    geometry: &[u8],
) -> rusqlite::Result<Option<String>> {
    let tile = footprint.tile;
    let image: Option<Vec<u8>> = connection
        .prepare_cached(&format!(
            "SELECT tile_data FROM \"{}\" WHERE zoom_level = ?1 AND tile_column = ?2 AND tile_row = ?3",
            layer.name
        ))?
        .query_row(params![tile.zoom(), tile.column(), tile.row()], |row| row.get(0))
        .optional()?;
    let descriptors: Option<Vec<u8>> = connection
        .prepare_cached("SELECT descriptors FROM overfly_descriptors WHERE footprint = ?1")?
        .query_row([fid], |row| row.get(0))
        .optional()?;
    let cells: Option<Vec<u8>> = connection
        .prepare_cached("SELECT cells FROM overfly_cells WHERE footprint = ?1")?
        .query_row([fid], |row| row.get(0))
        .optional()?;
    let Some(image) = image else { return Ok(Some("its imagery is missing".into())) };
    let Some(media_type) = imagery::media_type(&image) else { return Ok(Some("neither JPEG nor PNG".into())) };
    let hash = digest::content_hash(media_type, &image, descriptors.as_deref().unwrap_or_default(), cells.as_deref());
    if hash != footprint.content_hash {
        return Ok(Some("imagery, descriptors or cells do not have the hash that the footprint states".into()));
    }
    let bounds = tile.mercator_bounds();
    let exact = geometry::envelope_of(&bounds);
    if geometry::envelope(geometry) != Some(exact) {
        return Ok(Some("its footprint's geometry is not the tile's extent".into()));
    }
    let indexed: bool = connection
        .prepare_cached(
            "SELECT count(*) = 1 FROM rtree_footprints_geom
             WHERE id = ?1 AND minx <= ?2 AND maxx >= ?3 AND miny <= ?4 AND maxy >= ?5",
        )?
        .query_row(params![fid, exact[0], exact[1], exact[2], exact[3]], |row| row.get(0))?;
    Ok((!indexed).then(|| "the R-tree does not hold its extent".into()))
}

/// Runs SQLite's integrity check.
fn integrity(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    let mut statement = connection.prepare("PRAGMA integrity_check")?;
    let found: Vec<String> = statement.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
    Ok(found.into_iter().filter(|line| line != "ok").collect())
}

/// Checks application id and version of the GeoPackage.
fn header(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    let mut problems = Vec::new();
    for (pragma, expected) in [("application_id", APPLICATION_ID), ("user_version", USER_VERSION)] {
        let found: i32 = connection.query_row(&format!("PRAGMA {pragma}"), [], |row| row.get(0))?;
        if found != expected {
            problems.push(format!("{pragma} is {found}, not {expected}"));
        }
    }
    Ok(problems)
}

/// Checks the R-tree against the footprints.
fn rtree(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    let count =
        |table: &str| connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get::<_, u32>(0));
    let (indexed, footprints) = (count("rtree_footprints_geom")?, count("footprints")?);
    let mut problems = Vec::new();
    if indexed != footprints {
        problems.push(format!("{indexed} entries for {footprints} footprints"));
    }
    let state: String = connection.query_row("SELECT rtreecheck('rtree_footprints_geom')", [], |row| row.get(0))?;
    if state != "ok" {
        problems.push(state);
    }
    Ok(problems)
}

/// Checks the declaration of a layer in the tables of the GeoPackage.
fn declaration(connection: &Connection, layer: &Layer) -> rusqlite::Result<Vec<String>> {
    let mut problems = Vec::new();
    let contents: u32 = connection.query_row(
        "SELECT count(*) FROM gpkg_contents WHERE table_name = ?1 AND data_type = ?2 AND srs_id = 3857",
        [layer.name.as_str(), if layer.terrain.is_some() { "2d-gridded-coverage" } else { "tiles" }],
        |row| row.get(0),
    )?;
    if contents != 1 {
        problems.push("gpkg_contents does not declare it".into());
    }
    let set: Option<[f64; 4]> = connection
        .query_row(
            "SELECT min_x, min_y, max_x, max_y FROM gpkg_tile_matrix_set WHERE table_name = ?1",
            [&layer.name],
            |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?]),
        )
        .optional()?;
    let half_m = WORLD_M / 2.0;
    if set != Some([-half_m, -half_m, half_m, half_m]) {
        problems.push("gpkg_tile_matrix_set does not span the world".into());
    }
    for zoom in layer.min_zoom..=layer.base_zoom {
        let found: Option<(u32, u32, u32, u32, f64, f64)> = connection
            .query_row(
                "SELECT matrix_width, matrix_height, tile_width, tile_height, pixel_x_size, pixel_y_size
                 FROM gpkg_tile_matrix WHERE table_name = ?1 AND zoom_level = ?2",
                params![layer.name, zoom],
                |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?, row.get(5)?)),
            )
            .optional()?;
        let (size, pixel_m) = (1u32 << zoom, geopackage::pixel_size_m(zoom));
        if found != Some((size, size, TILE_SIZE_PX, TILE_SIZE_PX, pixel_m, pixel_m)) {
            problems.push(format!("gpkg_tile_matrix does not describe zoom {zoom}"));
        }
    }
    Ok(problems)
}

/// Checks the number of tiles of a layer, tiles without a footprint, and the digest.
fn layer_rows(connection: &Connection, version: u32, layer: &Layer) -> rusqlite::Result<Vec<String>> {
    let mut problems = Vec::new();
    let mut statement = connection.prepare(&format!(
        "SELECT t.zoom_level, t.tile_column, t.tile_row FROM \"{}\" t
         LEFT JOIN footprints f ON f.layer = ?1 AND f.zoom = t.zoom_level AND f.tile_row = t.tile_row
             AND f.tile_column = t.tile_column
         WHERE f.fid IS NULL",
        layer.name
    ))?;
    let strays: Vec<TileId> =
        statement.query_map([&layer.name], |row| footprint_rows::tile_at(row, 0))?.collect::<rusqlite::Result<_>>()?;
    problems.extend(strays.iter().map(|tile| format!("tile {tile} has no footprint")));
    let tiles: u32 =
        connection.query_row("SELECT count(*) FROM footprints WHERE layer = ?1", [&layer.name], |row| row.get(0))?;
    if u64::from(tiles) != layer.tiles {
        problems.push(format!("{tiles} tiles, but {} are stated", layer.tiles));
    }
    let base: Vec<TileId> = connection
        .prepare("SELECT zoom, tile_column, tile_row FROM footprints WHERE layer = ?1 AND zoom = ?2")?
        .query_map(params![layer.name, layer.base_zoom], |row| footprint_rows::tile_at(row, 0))?
        .collect::<rusqlite::Result<_>>()?;
    if base.len() as u64 != layer.base_tiles || extent(&base).1 != layer.bounds_deg {
        problems.push("it states another number or extent of its base tiles than it has".into());
    }
    let sources = source::load(connection, &layer.name, SourceTable::Finished, version)?;
    let digest = digest::layer_digest(connection, &LayerHashed::from(layer), version, &sources)?;
    if Some(hashing::hex(&digest)) != layer.digest {
        problems.push("its rows do not have the stated digest".into());
    }
    Ok(problems)
}
