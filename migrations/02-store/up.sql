-- What overfly knows beyond a plain GeoPackage. README.md beside this folder says what every column and blob holds.

-- One row: what the whole store was made with.
CREATE TABLE overfly_store (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    descriptor_contract TEXT NOT NULL
);

-- One epoch of imagery each; its tile table bears the layer's name.
CREATE TABLE overfly_layers (
    name TEXT NOT NULL PRIMARY KEY,
    complete INTEGER NOT NULL CHECK (complete IN (0, 1)),
    zoom_override INTEGER,
    base_zoom INTEGER NOT NULL,
    min_zoom INTEGER NOT NULL,
    base_tiles INTEGER NOT NULL DEFAULT 0,
    tiles INTEGER NOT NULL DEFAULT 0,
    west_deg REAL NOT NULL DEFAULT 0,
    south_deg REAL NOT NULL DEFAULT 0,
    east_deg REAL NOT NULL DEFAULT 0,
    north_deg REAL NOT NULL DEFAULT 0,
    digest BLOB
);

-- The orthophotos that a finished layer is made of.
CREATE TABLE overfly_sources (
    layer TEXT NOT NULL,
    content_hash BLOB NOT NULL,
    path TEXT NOT NULL,
    acquired TEXT,
    crs_epsg INTEGER,
    stretch_low REAL,
    stretch_high REAL,
    horizontal_error_m REAL NOT NULL,
    gsd_m_per_px REAL NOT NULL,
    outline BLOB NOT NULL,
    PRIMARY KEY (layer, content_hash)
);

-- A build under way: what the layer shall be once it is finished. No row: no build is under way.
CREATE TABLE overfly_pending (
    layer TEXT NOT NULL PRIMARY KEY,
    zoom_override INTEGER,
    base_zoom INTEGER NOT NULL,
    min_zoom INTEGER NOT NULL,
    plan_hash BLOB NOT NULL
);

CREATE TABLE overfly_pending_sources (
    layer TEXT NOT NULL,
    content_hash BLOB NOT NULL,
    path TEXT NOT NULL,
    acquired TEXT,
    crs_epsg INTEGER,
    stretch_low REAL,
    stretch_high REAL,
    horizontal_error_m REAL NOT NULL,
    gsd_m_per_px REAL NOT NULL,
    outline BLOB NOT NULL,
    PRIMARY KEY (layer, content_hash)
);

-- Tiles computed for a layer that answers meanwhile; moved to their places in the transaction that finishes the build.
CREATE TABLE overfly_staged (
    layer TEXT NOT NULL,
    zoom INTEGER NOT NULL,
    tile_row INTEGER NOT NULL,
    tile_column INTEGER NOT NULL,
    inputs_hash BLOB NOT NULL,
    tile_data BLOB,
    geom BLOB,
    content_hash BLOB,
    sources TEXT,
    acquired TEXT,
    valid_fraction REAL,
    horizontal_error_m REAL,
    keypoints INTEGER,
    distinctiveness REAL,
    descriptors BLOB,
    PRIMARY KEY (layer, zoom, tile_row, tile_column)
);

-- What each tile was made from, empty ones included: equal to what is wanted means there is nothing to do.
CREATE TABLE overfly_tile_inputs (
    layer TEXT NOT NULL,
    zoom INTEGER NOT NULL,
    tile_row INTEGER NOT NULL,
    tile_column INTEGER NOT NULL,
    inputs_hash BLOB NOT NULL,
    PRIMARY KEY (layer, zoom, tile_row, tile_column)
) WITHOUT ROWID;

-- One row a stored tile: all that is known of it. A feature table of EPSG:3857 rectangles.
CREATE TABLE footprints (
    fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    geom POLYGON NOT NULL,
    layer TEXT NOT NULL,
    zoom INTEGER NOT NULL,
    tile_column INTEGER NOT NULL,
    tile_row INTEGER NOT NULL,
    content_hash BLOB NOT NULL,
    sources TEXT NOT NULL,
    acquired TEXT,
    valid_fraction REAL NOT NULL,
    horizontal_error_m REAL NOT NULL,
    keypoints INTEGER NOT NULL,
    distinctiveness REAL NOT NULL,
    UNIQUE (layer, zoom, tile_row, tile_column)
);

-- The keypoints described in a base tile.
CREATE TABLE overfly_descriptors (
    footprint INTEGER PRIMARY KEY NOT NULL REFERENCES footprints (fid),
    descriptors BLOB NOT NULL
);

INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change, srs_id) VALUES
    ('footprints', 'features', 'footprints', 'what is known of each tile', '1970-01-01T00:00:00.000Z', 3857);
INSERT INTO gpkg_geometry_columns VALUES ('footprints', 'geom', 'POLYGON', 3857, 0, 0);

-- The R-tree of annex F.3, with its triggers as they stand there.
CREATE VIRTUAL TABLE rtree_footprints_geom USING rtree (id, minx, maxx, miny, maxy);

CREATE TRIGGER rtree_footprints_geom_insert AFTER INSERT ON footprints
    WHEN (new.geom NOT NULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
    INSERT OR REPLACE INTO rtree_footprints_geom VALUES (
        NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;

CREATE TRIGGER rtree_footprints_geom_update1 AFTER UPDATE OF geom ON footprints
    WHEN OLD.fid = NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
    INSERT OR REPLACE INTO rtree_footprints_geom VALUES (
        NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;

CREATE TRIGGER rtree_footprints_geom_update2 AFTER UPDATE OF geom ON footprints
    WHEN OLD.fid = NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
    DELETE FROM rtree_footprints_geom WHERE id = OLD.fid;
END;

CREATE TRIGGER rtree_footprints_geom_update3 AFTER UPDATE ON footprints
    WHEN OLD.fid != NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
    DELETE FROM rtree_footprints_geom WHERE id = OLD.fid;
    INSERT OR REPLACE INTO rtree_footprints_geom VALUES (
        NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));
END;

CREATE TRIGGER rtree_footprints_geom_update4 AFTER UPDATE ON footprints
    WHEN OLD.fid != NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
    DELETE FROM rtree_footprints_geom WHERE id IN (OLD.fid, NEW.fid);
END;

CREATE TRIGGER rtree_footprints_geom_delete AFTER DELETE ON footprints
    WHEN old.geom NOT NULL
BEGIN
    DELETE FROM rtree_footprints_geom WHERE id = OLD.fid;
END;

-- Readers may pass over all of these; writers may not: hence write-only.
INSERT INTO gpkg_extensions VALUES
    ('footprints', 'geom', 'gpkg_rtree_index', 'http://www.geopackage.org/spec120/#extension_rtree', 'write-only'),
    ('overfly_migrations', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_store', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_layers', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_sources', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_pending', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_pending_sources', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_staged', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_tile_inputs', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only'),
    ('overfly_descriptors', NULL, 'overfly_store', 'https://example.org/overfly/migrations/README.md', 'write-only');
