//! Stores that someone altered on purpose, consistent enough for SQLite and for GIS tools.

use overfly_ingest::build::{self, Request};
use rusqlite::Connection;
use rusqlite::functions::FunctionFlags;
use std::ops::ControlFlow;
use std::path::Path;

/// What is altered in a store of the layer `ortho`, and the SQL that does it.
pub const ALTERATIONS: [(&str, &str); 20] = [
    (
        "every tile 170 columns further east, footprints and imagery alike",
        "UPDATE footprints SET tile_column = tile_column + 170; UPDATE ortho SET tile_column = tile_column + 170",
    ),
    ("a footprint under another layer's name", "UPDATE footprints SET layer = 'other' WHERE fid = 1"),
    ("a newer date", "UPDATE footprints SET acquired = '2031-01-01'"),
    ("a negative error", "UPDATE footprints SET horizontal_error_m = -1"),
    ("an enormous error", "UPDATE footprints SET horizontal_error_m = 1e200"),
    ("an infinite error", "UPDATE footprints SET horizontal_error_m = 9e999"),
    ("an error made zero", "UPDATE footprints SET horizontal_error_m = 0.0"),
    ("a source's negative error", "UPDATE overfly_sources SET horizontal_error_m = -1"),
    ("a source's infinite error", "UPDATE overfly_sources SET horizontal_error_m = 9e999"),
    ("more valid pixels than pixels", "UPDATE footprints SET valid_fraction = 2"),
    ("an infinite distinctiveness", "UPDATE footprints SET distinctiveness = 9e999"),
    ("an outline of one byte", "UPDATE footprints SET valid_outline = x'01'"),
    ("an outline beyond the tile", "UPDATE footprints SET valid_outline = x'0400000000000004000000040004000000040000'"),
    ("an outline of nothing", "UPDATE footprints SET valid_outline = x''"),
    ("another extent, degrees", "UPDATE overfly_layers SET west_deg = west_deg - 10, east_deg = east_deg + 10"),
    ("another number of tiles", "UPDATE overfly_layers SET base_tiles = base_tiles + 1"),
    ("another licence", "UPDATE overfly_layers SET licence = 'CC0-1.0'"),
    ("geometries elsewhere", "UPDATE footprints SET geom = (SELECT geom FROM footprints ORDER BY zoom LIMIT 1)"),
    (
        "an endless view in a table's place",
        "DROP TABLE overfly_cells; CREATE VIEW overfly_cells AS
             WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS footprint, i AS cells FROM n",
    ),
    (
        "a trigger that waits for a build",
        "CREATE TRIGGER waits AFTER INSERT ON footprints BEGIN UPDATE footprints SET acquired = '2031-01-01'; END",
    ),
];

/// Makes a store of four base tiles and more, some of them partly empty, at `path`.
pub fn sound_store(path: &Path) {
    let folder = tempfile::tempdir().expect("a folder for the rig");
    let source = crate::drawn::orthophoto(folder.path(), "a.png", (900, 700), (0, 0), 5, true);
    let request = Request {
        db: path.into(),
        layer: "ortho".into(),
        sources: vec![source],
        crs: Some(crate::drawn::CRS),
        date: Some("2020-05-01".into()),
        horizontal_error_m: Some(1.5),
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).expect("the rig's own store is built");
}

/// Alters a store by SQL, as a program without any knowledge of it would.
pub fn alter(path: &Path, sql: &str) {
    let connection = Connection::open(path).expect("a store of the rig");
    // The functions that the triggers of the R-tree call.
    for name in ["ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY", "ST_IsEmpty"] {
        let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_INNOCUOUS;
        connection.create_scalar_function(name, 1, flags, |_| Ok(0.0)).expect("a function");
    }
    connection.execute_batch(sql).unwrap_or_else(|error| panic!("{sql}: {error}"));
}
