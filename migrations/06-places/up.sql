-- Hashes that bind places, errors that may be unknown, the ground that has pixels, licences; tables for terrain and indexes to come.
-- After this file the program fills footprints.hash and valid_outline of the rows there are, and the digests of finished layers.

-- Until now 0 stood for an unknown error.
ALTER TABLE footprints RENAME COLUMN horizontal_error_m TO error_before_06;
ALTER TABLE footprints ADD COLUMN horizontal_error_m REAL;
UPDATE footprints SET horizontal_error_m = nullif(error_before_06, 0.0);
ALTER TABLE footprints DROP COLUMN error_before_06;
ALTER TABLE footprints ADD COLUMN valid_outline BLOB;
ALTER TABLE footprints ADD COLUMN hash BLOB;

ALTER TABLE overfly_sources RENAME COLUMN horizontal_error_m TO error_before_06;
ALTER TABLE overfly_sources ADD COLUMN horizontal_error_m REAL;
UPDATE overfly_sources SET horizontal_error_m = nullif(error_before_06, 0.0);
ALTER TABLE overfly_sources DROP COLUMN error_before_06;

ALTER TABLE overfly_pending_sources RENAME COLUMN horizontal_error_m TO error_before_06;
ALTER TABLE overfly_pending_sources ADD COLUMN horizontal_error_m REAL;
UPDATE overfly_pending_sources SET horizontal_error_m = nullif(error_before_06, 0.0);
ALTER TABLE overfly_pending_sources DROP COLUMN error_before_06;

-- A build under way makes its staged tiles again.
DELETE FROM overfly_staged;
ALTER TABLE overfly_staged ADD COLUMN valid_outline BLOB;
ALTER TABLE overfly_staged ADD COLUMN hash BLOB;

ALTER TABLE overfly_layers ADD COLUMN licence TEXT;
ALTER TABLE overfly_layers ADD COLUMN attribution TEXT;

CREATE TABLE overfly_terrain (
    layer TEXT PRIMARY KEY NOT NULL,
    table_name TEXT NOT NULL,
    vertical_datum TEXT NOT NULL,
    digest BLOB NOT NULL
);

CREATE TABLE overfly_index (
    layer TEXT NOT NULL,
    kind TEXT NOT NULL,
    content BLOB NOT NULL,
    digest BLOB NOT NULL,
    PRIMARY KEY (layer, kind)
);

INSERT INTO gpkg_extensions VALUES
    ('overfly_terrain', NULL, 'overfly_store', 'overfly migrations/README.md', 'write-only'),
    ('overfly_index', NULL, 'overfly_store', 'overfly migrations/README.md', 'write-only');
