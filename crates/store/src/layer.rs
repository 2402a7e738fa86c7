//! `Layer`: one epoch of imagery, and the rules for its name.

use super::StoreError;
use super::terms::Terms;
use super::terrain::{self, Terrain};
use super::versions::{PLACES_SINCE, TERRAIN_SINCE};
use overfly_core::geodesy::{GeodeticBounds, bounds_as_array};
use rusqlite::types::Type;
use rusqlite::{Connection, Row};
use serde::Serialize;
use std::cmp::Ordering;
use std::path::Path;

/// One epoch of imagery, with its own tile table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layer {
    /// Name, `ortho` by default.
    pub name: String,
    /// Zoom of the finest level, to which sources are warped.
    pub base_zoom: u8,
    /// Zoom of the coarsest overview.
    pub min_zoom: u8,
    /// Number of tiles at the base level.
    pub base_tiles: u64,
    /// Number of tiles at all levels.
    pub tiles: u64,
    /// Extent, degrees: west, south, east, north. West exceeds east where the layer crosses the antimeridian.
    #[serde(with = "bounds_as_array")]
    pub bounds_deg: GeodeticBounds,
    /// Earliest and latest acquisition date of its sources, if known.
    pub acquired: Option<(String, String)>,
    /// Whether its first build was finished. An unfinished layer answers no queries.
    pub complete: bool,
    /// BLAKE3 digest of the logical content, hexadecimal: `None` while the layer is unfinished.
    pub digest: Option<String>,
    /// Under what terms its imagery may be used.
    #[serde(flatten)]
    pub terms: Terms,
    /// What it states of its heights, where it holds heights and not imagery.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terrain: Option<Terrain>,
}

impl Layer {
    /// The date of the layer: the latest acquisition date of its sources, if known.
    pub fn date(&self) -> Option<&str> {
        self.acquired.as_ref().map(|(_, latest)| latest.as_str())
    }

    /// Orders layers by age: the newest first, those without a date last, those of one date by name.
    pub fn newest_first(&self, other: &Self) -> Ordering {
        other.date().cmp(&self.date()).then_with(|| self.name.cmp(&other.name))
    }
}

/// The name that stands for all layers of a store. No new layer can have it.
pub const ANY_LAYER: &str = "any";

/// Checks the name of a new layer, which is also the name of its tile table.
///
/// # Errors
/// [`StoreError::LayerName`].
pub fn check_name(name: &str) -> Result<(), StoreError> {
    if name == ANY_LAYER {
        return Err(StoreError::LayerName { name: name.into() });
    }
    check_stored_name(name)
}

/// Checks the name of a layer in a store: one of an older program may be called [`ANY_LAYER`].
///
/// # Errors
/// [`StoreError::LayerName`].
pub fn check_stored_name(name: &str) -> Result<(), StoreError> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    let shaped = (1..=40).contains(&name.len())
        && name.starts_with(plain)
        && name.chars().all(|c| plain(c) || c == '_' || c == '-');
    let reserved = ["overfly_", "gpkg_", "rtree_", "sqlite_"].iter().any(|prefix| name.starts_with(prefix));
    if shaped && !reserved && name != "footprints" { Ok(()) } else { Err(StoreError::LayerName { name: name.into() }) }
}

/// Reads every layer by name, finished or not.
pub(super) fn load_all(connection: &Connection, version: u32, path: &Path) -> Result<Vec<Layer>, StoreError> {
    load_rows(connection, version).map_err(|e| StoreError::sqlite(path, e))
}

/// As [`load_all`], for those who know no path. A name that no layer can have is content that cannot be converted.
pub(super) fn load_rows(connection: &Connection, version: u32) -> rusqlite::Result<Vec<Layer>> {
    let terms = if version < PLACES_SINCE { "NULL, NULL" } else { "licence, attribution" };
    let [datum, error_m] = match version {
        ..TERRAIN_SINCE => ["NULL".to_owned(), "NULL".to_owned()],
        _ => ["vertical_datum", "vertical_error_m"]
            .map(|column| format!("(SELECT {column} FROM overfly_terrain t WHERE t.layer = l.name)")),
    };
    let mut statement = connection.prepare(&format!(
        "SELECT name, base_zoom, min_zoom, base_tiles, tiles, west_deg, south_deg, east_deg, north_deg, complete,
                digest,
                (SELECT min(acquired) FROM overfly_sources s WHERE s.layer = l.name),
                (SELECT max(acquired) FROM overfly_sources s WHERE s.layer = l.name), {terms}, {datum}, {error_m}
         FROM overfly_layers l ORDER BY name",
    ))?;
    let layers = statement.query_map([], read)?.collect::<rusqlite::Result<Vec<_>>>()?;
    layers.iter().try_for_each(|layer| stored_name(&layer.name))?;
    Ok(layers)
}

/// [`check_stored_name`] of a name that was read from a store.
pub(super) fn stored_name(name: &str) -> rusqlite::Result<()> {
    check_stored_name(name).map_err(|_| {
        let reason = format!("a layer named {name:?}");
        rusqlite::Error::FromSqlConversionFailure(0, Type::Text, reason.into())
    })
}

fn read(row: &Row<'_>) -> rusqlite::Result<Layer> {
    let first: Option<String> = row.get(11)?;
    let last: Option<String> = row.get(12)?;
    let digest: Option<[u8; 32]> = row.get(10)?;
    Ok(Layer {
        name: row.get(0)?,
        base_zoom: row.get(1)?,
        min_zoom: row.get(2)?,
        base_tiles: row.get::<_, u32>(3)?.into(),
        tiles: row.get::<_, u32>(4)?.into(),
        bounds_deg: [row.get(5)?, row.get(6)?, row.get(7)?, row.get(8)?].into(),
        acquired: first.zip(last),
        complete: row.get(9)?,
        digest: digest.map(|d| super::hashing::hex(&d)),
        terms: Terms { licence: row.get(13)?, attribution: row.get(14)? },
        terrain: terrain::read(row, 15)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepts_plain_names_only() {
        for name in ["ortho", "2018", "epoch_2", "a-b"] {
            assert!(check_name(name).is_ok(), "{name}");
        }
        for name in ["", "Ortho", "a b", "gpkg_contents", "overfly_layers", "footprints", "a\"; DROP", "-a"] {
            assert!(check_name(name).is_err(), "{name}");
        }
        assert!(check_name(ANY_LAYER).is_err() && check_stored_name(ANY_LAYER).is_ok());
    }

    #[test]
    fn the_newest_layer_is_first_and_an_undated_one_last() {
        let layer = |name: &str, date: Option<&str>| Layer {
            name: name.into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: [0.0; 4].into(),
            acquired: date.map(|date| ("1999-01-01".into(), date.into())),
            complete: true,
            digest: None,
            terms: Terms::default(),
            terrain: None,
        };
        let mut layers =
            [("c", None), ("a", None), ("z", Some("2020-01-02")), ("y", Some("2020-01-02")), ("b", Some("2021-05-01"))]
                .map(|(name, date)| layer(name, date));
        layers.sort_by(Layer::newest_first);
        assert_eq!(layers.map(|l| l.name), ["b", "y", "z", "a", "c"]);
    }
}
