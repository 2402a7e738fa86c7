//! The schema of a store: every table, index and trigger that its format version has, and none that could answer in their place.
//!
//! SQLite runs the views, triggers and virtual tables that a file brings along. A view in the place of a table may have no end, and a
//! trigger changes what a build writes. So each object that a program of ours touches must have exactly the definition that the
//! migrations give it. Plain tables of other programs are left alone, because no query names them.

use super::{StoreError, geometry, geopackage, layer, migration};
use parking_lot::Mutex;
use rusqlite::Connection;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Type and definition by name.
type Objects = BTreeMap<String, (String, Option<String>)>;

/// The name of the tile table in the expected schema, which stands for that of every layer.
const SAMPLE_LAYER: &str = "any-layer";

/// The expected schemas by version.
static EXPECTED: Mutex<BTreeMap<u32, Arc<Objects>>> = Mutex::new(BTreeMap::new());

/// Checks the schema of a store of a format version.
///
/// # Errors
/// [`StoreError::ForeignSchema`] for a view, trigger or virtual table that no store has, and for a table, index or trigger of a store
/// with another definition; [`StoreError::Damaged`] where one is missing.
pub fn require_own(connection: &Connection, version: u32, path: &Path) -> Result<(), StoreError> {
    let fail = |e| StoreError::sqlite(path, e);
    let expected = expected(version).map_err(fail)?;
    let (found, tables) = objects(connection).map_err(fail)?;
    for (name, object) in &found {
        if !is_own(&expected, name, object) && !is_harmless(&expected, name, object, &tables[name]) {
            return Err(StoreError::ForeignSchema { path: path.into(), what: format!("{} {name}", object.0) });
        }
    }
    for name in layer_names(connection).map_err(fail)? {
        if !found.get(&name).is_some_and(|object| is_own(&expected, &name, object)) {
            return Err(StoreError::ForeignSchema {
                path: path.into(),
                what: format!("the tile table of layer {name}"),
            });
        }
    }
    match expected.keys().find(|name| !found.contains_key(*name) && *name != SAMPLE_LAYER && !is_internal(name)) {
        None => Ok(()),
        Some(missing) => Err(StoreError::Damaged {
            path: path.into(),
            reason: format!("{} {missing} is missing", expected[missing].0),
        }),
    }
}

/// Whether an object is that of the migrations, or the tile table of a layer.
fn is_own(expected: &Objects, name: &str, object: &(String, Option<String>)) -> bool {
    if let Some(own) = expected.get(name) {
        return own == object;
    }
    let (kind, sql) = &expected[SAMPLE_LAYER];
    let of_layer = sql.as_ref().map(|sql| sql.replace(SAMPLE_LAYER, name));
    layer::check_stored_name(name).is_ok() && (kind, of_layer) == (&object.0, object.1.clone())
}

/// Whether an object belongs to another program, and no query of ours meets it: a plain table, or an index on one.
fn is_harmless(expected: &Objects, name: &str, object: &(String, Option<String>), table: &str) -> bool {
    if is_internal(name) {
        return object.0 == "table" || object.0 == "index";
    }
    let is_plain = match (object.0.as_str(), &object.1) {
        ("table", Some(sql)) => sql.starts_with("CREATE TABLE"),
        ("index", _) => !expected.contains_key(table),
        _ => false,
    };
    is_plain && !expected.contains_key(name)
}

/// Whether SQLite itself made an object. No statement can make one with such a name.
fn is_internal(name: &str) -> bool {
    name.starts_with("sqlite_")
}

/// The objects of a schema, and the table of each.
fn objects(connection: &Connection) -> rusqlite::Result<(Objects, BTreeMap<String, String>)> {
    let (mut found, mut tables) = (Objects::new(), BTreeMap::new());
    let mut statement = connection.prepare("SELECT name, type, sql, tbl_name FROM sqlite_schema")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let name: String = row.get(0)?;
        tables.insert(name.clone(), row.get(3)?);
        found.insert(name, (row.get(1)?, row.get(2)?));
    }
    Ok((found, tables))
}

fn layer_names(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    connection.prepare("SELECT name FROM overfly_layers")?.query_map([], |row| row.get(0))?.collect()
}

/// The schema that the migrations up to a version make, with one tile table.
fn expected(version: u32) -> rusqlite::Result<Arc<Objects>> {
    let mut known = EXPECTED.lock();
    if let Some(known) = known.get(&version) {
        return Ok(known.clone());
    }
    let connection = Connection::open_in_memory()?;
    geometry::register_functions(&connection)?;
    migration::migrate(&connection, 0, version)?;
    geopackage::create_tile_table(&connection, SAMPLE_LAYER)?;
    let made = Arc::new(objects(&connection)?.0);
    known.insert(version, made.clone());
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FORMAT_VERSION;

    fn checked(change: &str) -> Result<(), StoreError> {
        let connection = Connection::open_in_memory().unwrap();
        geometry::register_functions(&connection).unwrap();
        migration::migrate(&connection, 0, FORMAT_VERSION).unwrap();
        geopackage::create_tile_table(&connection, "ortho").unwrap();
        let layer = "INSERT INTO overfly_layers (name, complete, base_zoom, min_zoom) VALUES ('ortho', 0, 9, 9)";
        connection.execute_batch(layer).unwrap();
        connection.execute_batch(change).unwrap();
        require_own(&connection, FORMAT_VERSION, Path::new("s.gpkg"))
    }

    #[test]
    fn plain_tables_of_others_are_left_alone() {
        checked("").unwrap();
        checked(
            "CREATE TABLE layer_styles (id INTEGER PRIMARY KEY, qml TEXT); CREATE INDEX styles ON layer_styles (qml)",
        )
        .unwrap();
        checked("ANALYZE").unwrap();
    }

    #[test]
    fn what_could_answer_or_write_in_our_place_is_refused() {
        let endless =
            "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS footprint, i AS cells FROM n";
        for change in [
            &format!("DROP TABLE overfly_cells; CREATE VIEW overfly_cells AS {endless}"),
            &format!("CREATE VIEW other AS {endless}"),
            "DROP TABLE ortho; CREATE VIEW ortho AS SELECT 1 AS zoom_level",
            "CREATE TRIGGER t AFTER INSERT ON footprints BEGIN DELETE FROM overfly_manifest; END",
            "DROP TRIGGER rtree_footprints_geom_insert; CREATE TRIGGER rtree_footprints_geom_insert AFTER INSERT ON footprints
             BEGIN SELECT 1; END",
            "DROP TABLE ortho; CREATE TABLE ortho (zoom_level, tile_column, tile_row, tile_data)",
            "CREATE VIRTUAL TABLE search USING fts5 (text)",
            "CREATE INDEX mine ON footprints (acquired)",
            "PRAGMA foreign_keys = 0; DROP TABLE gpkg_contents; CREATE TABLE gpkg_contents (table_name TEXT)",
        ] {
            assert_eq!(checked(change).unwrap_err().code(), "foreign_schema", "{change}");
        }
        assert_eq!(checked("DROP TABLE overfly_index").unwrap_err().code(), "damaged_store");
    }
}
