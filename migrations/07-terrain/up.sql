-- Terrain: layers of heights, as tiled gridded coverages (OGC 17-066r1).

-- The table that format 6 reserved was never written.
DROP TABLE overfly_terrain;
CREATE TABLE overfly_terrain (
    layer TEXT PRIMARY KEY NOT NULL,
    vertical_datum TEXT NOT NULL,
    vertical_error_m REAL
);

CREATE TABLE gpkg_2d_gridded_coverage_ancillary (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    tile_matrix_set_name TEXT NOT NULL UNIQUE,
    datatype TEXT NOT NULL DEFAULT 'integer',
    scale REAL NOT NULL DEFAULT 1.0,
    offset REAL NOT NULL DEFAULT 0.0,
    precision REAL DEFAULT 1.0,
    data_null REAL,
    grid_cell_encoding TEXT DEFAULT 'grid-value-is-center',
    uom TEXT,
    field_name TEXT DEFAULT 'Height',
    quantity_definition TEXT DEFAULT 'Height',
    CONSTRAINT fk_g2dgtct_name FOREIGN KEY (tile_matrix_set_name) REFERENCES gpkg_tile_matrix_set (table_name),
    CHECK (datatype IN ('integer', 'float'))
);

CREATE TABLE gpkg_2d_gridded_tile_ancillary (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    tpudt_name TEXT NOT NULL,
    tpudt_id INTEGER NOT NULL,
    scale REAL NOT NULL DEFAULT 1.0,
    offset REAL NOT NULL DEFAULT 0.0,
    min REAL DEFAULT NULL,
    max REAL DEFAULT NULL,
    mean REAL DEFAULT NULL,
    std_dev REAL DEFAULT NULL,
    CONSTRAINT fk_g2dgtat_name FOREIGN KEY (tpudt_name) REFERENCES gpkg_contents (table_name),
    UNIQUE (tpudt_name, tpudt_id)
);

INSERT OR IGNORE INTO gpkg_spatial_ref_sys VALUES
    ('WGS 84 3D', 4979, 'EPSG', 4979,
     'GEODCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563,LENGTHUNIT["metre",1.0]]],CS[ellipsoidal,3],AXIS["latitude",north,ORDER[1],ANGLEUNIT["degree",0.0174532925199433]],AXIS["longitude",east,ORDER[2],ANGLEUNIT["degree",0.0174532925199433]],AXIS["ellipsoidal height",up,ORDER[3],LENGTHUNIT["metre",1.0]],ID["EPSG",4979]]',
     'WGS 84 with ellipsoidal height');

INSERT INTO gpkg_extensions VALUES
    ('gpkg_2d_gridded_coverage_ancillary', NULL, 'gpkg_2d_gridded_coverage',
     'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write'),
    ('gpkg_2d_gridded_tile_ancillary', NULL, 'gpkg_2d_gridded_coverage',
     'http://docs.opengeospatial.org/is/17-066r1/17-066r1.html', 'read-write');
