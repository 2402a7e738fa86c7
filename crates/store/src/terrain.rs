//! `Terrain`: what a layer of heights states of them; and heights as a reader gives them.

use super::tile_cache::TileCache;
use super::{Layer, Reader, StoreError, coverage, heights};
use overfly_core::geodesy::VerticalDatum;
use overfly_core::tile::{HeightGrid, MAX_ZOOM, TILE_SIZE_PX, TileId};
use rusqlite::types::Type;
use rusqlite::{Connection, Row, params};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// One standard deviation of heights whose error is unknown, metres: that of the global models, with what grows and stands on the
/// ground.
const DEFAULT_VERTICAL_ERROR_M: f64 = 5.0;

/// What a layer of heights states of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terrain {
    /// The surface that the heights are above.
    #[serde(with = "datum_word")]
    pub vertical_datum: VerticalDatum,
    /// One standard deviation of the heights, metres: `None` where it is unknown.
    pub vertical_error_m: Option<f64>,
}

impl Terrain {
    /// The standard deviation of the heights that covariances carry, metres.
    pub fn error_m(&self) -> f64 {
        self.vertical_error_m.unwrap_or(DEFAULT_VERTICAL_ERROR_M)
    }
}

/// A datum as its word.
mod datum_word {
    use overfly_core::geodesy::VerticalDatum;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(datum: &VerticalDatum, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(datum.word())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<VerticalDatum, D::Error> {
        let word = String::deserialize(deserializer)?;
        VerticalDatum::parse(&word).ok_or_else(|| D::Error::custom(format!("no vertical datum is called {word:?}")))
    }
}

/// Reads what a layer states of its heights, from a row of its columns `vertical_datum` and `vertical_error_m`: `None` for imagery.
pub(super) fn read(row: &Row<'_>, at: usize) -> rusqlite::Result<Option<Terrain>> {
    let Some(word) = row.get::<_, Option<String>>(at)? else { return Ok(None) };
    let vertical_datum = VerticalDatum::parse(&word).ok_or_else(|| {
        let reason = format!("a vertical datum called {word:?}");
        rusqlite::Error::FromSqlConversionFailure(at, Type::Text, reason.into())
    })?;
    Ok(Some(Terrain { vertical_datum, vertical_error_m: row.get(at + 1)? }))
}

/// Writes what a layer states of its heights, and declares their coverage. Does nothing for imagery.
pub(super) fn declare(connection: &Connection, layer: &str, terrain: Option<&Terrain>) -> rusqlite::Result<()> {
    let Some(terrain) = terrain else { return Ok(()) };
    connection.execute(
        "INSERT OR REPLACE INTO overfly_terrain (layer, vertical_datum, vertical_error_m) VALUES (?1, ?2, ?3)",
        params![layer, terrain.vertical_datum.word(), terrain.vertical_error_m],
    )?;
    coverage::declare(connection, layer)
}

/// Decoded tiles of heights, by layer and tile.
pub(super) type HeightCache = TileCache<HeightGrid>;

impl Reader {
    /// The layer of heights, where the store has a finished one.
    pub fn terrain(&self) -> Option<(&Layer, &Terrain)> {
        self.finished_layers().find_map(|layer| layer.terrain.as_ref().map(|terrain| (layer, terrain)))
    }

    /// The heights of a window of a layer of heights, at its base zoom; unknown where it has none. Columns may run past the
    /// antimeridian. Onboard, a damaged tile counts as unknown.
    ///
    /// # Errors
    /// Where the layer is unfinished or a tile is damaged.
    pub fn heights(&self, layer: &Layer, corner_px: [i64; 2], size_px: [usize; 2]) -> Result<HeightGrid, StoreError> {
        let mut window = HeightGrid::unknown(layer.base_zoom, corner_px, size_px);
        let size = i64::from(TILE_SIZE_PX);
        let tiles = |axis: usize| {
            corner_px[axis].div_euclid(size)..=(corner_px[axis] + size_px[axis] as i64 - 1).div_euclid(size)
        };
        let matrix = 1i64 << layer.base_zoom.min(MAX_ZOOM);
        for row in tiles(1).filter(|row| (0..matrix).contains(row)) {
            for column in tiles(0) {
                let Ok(tile) = TileId::new(layer.base_zoom, column.rem_euclid(matrix) as u32, row as u32) else {
                    continue;
                };
                if let Some(known) = self.height_tile(layer, tile)? {
                    let copies = (column - i64::from(tile.column())) * size;
                    window.paste_shifted(&known, copies);
                }
            }
        }
        Ok(window)
    }

    fn height_tile(&self, layer: &Layer, tile: TileId) -> Result<Option<Arc<HeightGrid>>, StoreError> {
        self.ground.heights.get((0, tile), || {
            let encoded = match self.encoded_tile(layer, tile) {
                Err(StoreError::DamagedTile { .. }) if self.is_onboard() => None,
                other => other?,
            };
            let Some(encoded) = encoded else { return Ok(None) };
            heights::decode(tile, &encoded.bytes).map(Some).map_err(|reason| self.damaged(layer, tile, reason))
        })
    }
}
