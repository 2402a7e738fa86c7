//! The row that holds the manifest of an exported store, as text. `package::manifest` parses it.

use rusqlite::{Connection, OptionalExtension};

/// The first format version that has the table.
pub const SINCE: u32 = 4;

/// Reads the manifest: `None` in a store that was built, not exported.
pub fn read(connection: &Connection) -> rusqlite::Result<Option<String>> {
    connection.query_row("SELECT manifest FROM overfly_manifest", [], |row| row.get(0)).optional()
}

/// Writes the manifest.
pub fn write(connection: &Connection, manifest: &str) -> rusqlite::Result<()> {
    connection.execute("INSERT INTO overfly_manifest (id, manifest) VALUES (1, ?1)", [manifest]).map(|_| ())
}
