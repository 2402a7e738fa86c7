//! The format versions of a store: the SQL files of `migrations/`, applied in order, forward only.

use super::versions::{PLACES_SINCE, TERRAIN_SINCE};
use super::{StoreError, places};
use rusqlite::{Connection, OptionalExtension};
use std::path::Path;

/// Version, name and SQL of each migration.
const MIGRATIONS: [(u32, &str, &str); 7] = [
    (1, "geopackage", include_str!("../../../migrations/01-geopackage/up.sql")),
    (2, "store", include_str!("../../../migrations/02-store/up.sql")),
    (3, "cells", include_str!("../../../migrations/03-cells/up.sql")),
    (4, "manifest", include_str!("../../../migrations/04-manifest/up.sql")),
    (5, "extension-documents", include_str!("../../../migrations/05-extension-documents/up.sql")),
    (PLACES_SINCE, "places", include_str!("../../../migrations/06-places/up.sql")),
    (TERRAIN_SINCE, "terrain", include_str!("../../../migrations/07-terrain/up.sql")),
];

/// The format version that this program writes: the version of the last migration.
pub const FORMAT_VERSION: u32 = MIGRATIONS[MIGRATIONS.len() - 1].0;

/// The oldest format version that this program reads without a migration.
pub const OLDEST_READABLE: u32 = 4;

/// Reads the format version of a store: 0 for an empty file, `None` if the database is not a store.
///
/// # Errors
/// Where SQLite fails.
pub fn version_of(connection: &Connection, path: &Path) -> Result<Option<u32>, StoreError> {
    let fail = |source| StoreError::sqlite(path, source);
    let tables: u32 = connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0)).map_err(fail)?;
    if tables == 0 {
        return Ok(Some(0));
    }
    let known = connection
        .query_row("SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = 'overfly_migrations'", [], |_| Ok(()))
        .optional()
        .map_err(fail)?;
    if known.is_none() {
        return Ok(None);
    }
    connection
        .query_row("SELECT max(version) FROM overfly_migrations", [], |row| row.get::<_, Option<u32>>(0))
        .map(|version| Some(version.unwrap_or(0)))
        .map_err(fail)
}

/// Migrates a store from version `from` to version `to`. The caller holds the transaction.
///
/// # Errors
/// Where SQLite fails.
pub fn migrate(connection: &Connection, from: u32, to: u32) -> rusqlite::Result<()> {
    connection.execute_batch(
        "CREATE TABLE IF NOT EXISTS overfly_migrations (version INTEGER PRIMARY KEY NOT NULL, name TEXT NOT NULL)",
    )?;
    for (version, name, sql) in MIGRATIONS.into_iter().filter(|(version, ..)| (from + 1..=to).contains(version)) {
        connection.execute_batch(sql)?;
        if version == PLACES_SINCE {
            places::fill(connection)?;
        }
        connection.execute("INSERT INTO overfly_migrations (version, name) VALUES (?1, ?2)", (version, name))?;
    }
    Ok(())
}

/// Rejects versions that this program cannot read.
///
/// # Errors
/// [`StoreError::NewerFormat`], [`StoreError::OlderFormat`].
pub fn require_readable(found: u32, path: &Path) -> Result<(), StoreError> {
    let path = path.to_path_buf();
    match found {
        OLDEST_READABLE..=FORMAT_VERSION => Ok(()),
        ..OLDEST_READABLE => Err(StoreError::OlderFormat { path, found, known: FORMAT_VERSION }),
        _ => Err(StoreError::NewerFormat { path, found, known: FORMAT_VERSION }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn migrates_from_any_earlier_version() {
        for from in 0..FORMAT_VERSION {
            let connection = Connection::open_in_memory().unwrap();
            super::super::geometry::register_functions(&connection).unwrap();
            connection
                .execute_batch(
                    "CREATE TABLE overfly_migrations (version INTEGER PRIMARY KEY NOT NULL, name TEXT NOT NULL)",
                )
                .unwrap();
            for (version, name, sql) in MIGRATIONS.into_iter().filter(|(version, ..)| *version <= from) {
                connection.execute_batch(sql).unwrap();
                connection.execute("INSERT INTO overfly_migrations VALUES (?1, ?2)", (version, name)).unwrap();
            }
            migrate(&connection, from, FORMAT_VERSION).unwrap();
            assert_eq!(version_of(&connection, Path::new("memory")).unwrap(), Some(FORMAT_VERSION));
        }
    }

    #[test]
    fn every_extension_row_names_a_document() {
        let connection = Connection::open_in_memory().unwrap();
        super::super::geometry::register_functions(&connection).unwrap();
        migrate(&connection, 0, FORMAT_VERSION).unwrap();
        let mut statement = connection.prepare("SELECT DISTINCT definition FROM gpkg_extensions ORDER BY 1").unwrap();
        let found: Vec<String> = statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
        let coverage = "http://docs.opengeospatial.org/is/17-066r1/17-066r1.html";
        let rtree = "http://www.geopackage.org/spec120/#extension_rtree";
        assert_eq!(found, [coverage, rtree, "overfly migrations/README.md"]);
    }

    #[test]
    fn numbers_its_migrations_without_gaps() {
        for (index, (version, ..)) in MIGRATIONS.iter().enumerate() {
            assert_eq!(*version as usize, index + 1);
        }
    }
}
