//! The manifest of an exported store as its row holds it: text. What it says is `package`'s business.

use rusqlite::{Connection, OptionalExtension};

/// The format version from which on there is a table for it.
pub const SINCE: u32 = 4;

/// The manifest; `None` in a store that was built and not exported.
pub fn read(connection: &Connection) -> rusqlite::Result<Option<String>> {
    connection.query_row("SELECT manifest FROM overfly_manifest", [], |row| row.get(0)).optional()
}

/// Writes it down.
pub fn write(connection: &Connection, manifest: &str) -> rusqlite::Result<()> {
    connection.execute("INSERT INTO overfly_manifest (id, manifest) VALUES (1, ?1)", [manifest]).map(|_| ())
}
