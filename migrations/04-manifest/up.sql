-- What an exported store says of itself: one row of JSON, and none in a store that was built.

CREATE TABLE overfly_manifest (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    manifest TEXT NOT NULL
);

INSERT INTO gpkg_extensions VALUES
    ('overfly_manifest', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only');
