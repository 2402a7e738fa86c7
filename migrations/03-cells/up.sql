-- What is kept of every tile's structure, so that a frame without any position is found among all tiles of a layer.

CREATE TABLE overfly_cells (
    footprint INTEGER PRIMARY KEY NOT NULL REFERENCES footprints (fid),
    cells BLOB NOT NULL
);

ALTER TABLE overfly_staged ADD COLUMN cells BLOB;

INSERT INTO gpkg_extensions VALUES
    ('overfly_cells', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only');
