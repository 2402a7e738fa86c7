//! A store keeps what is put into it, answers exactly, and refuses what it should, file and remedy named.

use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{MercatorBounds, TileId};
use overfly_store::{
    BuiltTile, Declaration, FORMAT_VERSION, LayerChange, LayerState, Reader, Source, StoreError, Terms, TileContent,
    Writer, change_layer, verify,
};
use std::path::{Path, PathBuf};

/// A source of no file, told apart by `seed`.
pub fn source(seed: u8) -> Source {
    Source {
        content_hash: [seed; 32],
        path: PathBuf::from(format!("/nowhere/{seed}.tif")),
        acquired: Some(format!("20{:02}-07-16", seed % 50)),
        crs_epsg: None,
        stretch: None,
        horizontal_error_m: Some(f64::from(seed) / 10.0),
        gsd_m_per_px: 1.0,
        outline_deg: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
    }
}

/// A tile of one colour gradient, told apart by its indices and `seed`; with `hole`, some pixels are missing.
pub fn built(tile: TileId, source: &Source, seed: u8, hole: bool) -> BuiltTile {
    let values = (0..512 * 512).flat_map(|i| [(i % 256) as u8, tile.column() as u8, seed]).collect();
    let mut pixels =
        MaskedColour { colour: Colour::from_values(512, 512, values).unwrap(), mask: Mask::filled(512, 512, true) };
    if hole {
        pixels.mask.set(3, 4, false);
    }
    let content = TileContent::encode(tile, &pixels, &[source], None).unwrap();
    BuiltTile { tile, inputs_hash: [seed; 32], content: Some(content) }
}

fn declaration(layer: &str, sources: Vec<Source>, zoom: u8) -> Declaration {
    Declaration {
        layer: layer.into(),
        sources,
        zoom_override: None,
        base_zoom: zoom,
        min_zoom: zoom,
        terms: Terms::default(),
        terrain: None,
    }
}

/// A finished store of one layer at one zoom.
pub fn store_of(path: &Path, layer: &str, tiles: &[TileId], seed: u8) {
    let source = source(seed);
    let mut writer = Writer::begin(path, CONTRACT, declaration(layer, vec![source.clone()], tiles[0].zoom())).unwrap();
    for (index, tile) in tiles.iter().enumerate() {
        writer.put(&built(*tile, &source, seed, index % 2 == 1)).unwrap();
    }
    assert_eq!(writer.finish(&|_| true).unwrap(), Some(tiles.len() as u64));
}

fn block(zoom: u8, column: u32, row: u32, size: u32) -> Vec<TileId> {
    (0..size * size).map(|i| TileId::new(zoom, column + i % size, row + i / size).unwrap()).collect()
}

#[test]
fn gives_back_what_was_put() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a store.gpkg");
    let tiles = block(12, 100, 200, 3);
    store_of(&path, "ortho", &tiles, 7);
    for reader in [Reader::open(&path).unwrap(), Reader::open_onboard(&path).unwrap()] {
        let layer = reader.layer("ortho").unwrap();
        assert_eq!((layer.base_zoom, layer.base_tiles, layer.tiles, layer.complete), (12, 9, 9, true));
        assert_eq!(layer.acquired.as_ref().unwrap().0, "2007-07-16");
        assert_eq!(reader.format_version(), FORMAT_VERSION);
        assert_eq!(reader.footprints(layer, 12).unwrap().len(), 9);
        assert_eq!(reader.sources(layer).unwrap(), [source(7)]);
        let footprint = reader.footprint(layer, tiles[1]).unwrap().unwrap();
        assert!((footprint.valid_fraction - (1.0 - 1.0 / (512.0 * 512.0))).abs() < 1e-9);
        assert_eq!(footprint.horizontal_error_m, Some(0.7));
        let encoded = reader.encoded_tile(layer, tiles[1]).unwrap().unwrap();
        assert_eq!((encoded.media_type, encoded.content_hash), ("image/png", footprint.content_hash));
        assert!(!reader.tile(layer, tiles[1]).unwrap().unwrap().mask.at(3, 4));
        assert_eq!(reader.encoded_tile(layer, tiles[0]).unwrap().unwrap().media_type, "image/jpeg");
        assert!(reader.tile(layer, TileId::new(12, 0, 0).unwrap()).unwrap().is_none());
    }
    let found = verify(&path, &|_, _| ()).unwrap();
    assert!(found.ok, "{found:?}");
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a store.gpkg"], "no side files");
}

#[test]
fn misses_no_footprint_across_the_antimeridian() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pacific.gpkg");
    let size = 1u32 << 10;
    let tiles: Vec<_> =
        [size - 2, size - 1, 0, 1].into_iter().map(|column| TileId::new(10, column, 400).unwrap()).collect();
    store_of(&path, "ortho", &tiles, 3);
    let reader = Reader::open(&path).unwrap();
    let layer = reader.layer("ortho").unwrap();
    assert!(layer.bounds_deg.crosses_antimeridian());
    let (east, west) = (tiles[1].mercator_bounds(), tiles[2].mercator_bounds());
    let world_m = overfly_core::geodesy::WORLD_M;
    let bounds = MercatorBounds { max_x_m: west.max_x_m + world_m - 1.0, ..east };
    for shift_m in [0.0, -world_m] {
        let shifted =
            MercatorBounds { min_x_m: bounds.min_x_m + 1.0 + shift_m, max_x_m: bounds.max_x_m + shift_m, ..bounds };
        let found: Vec<_> =
            reader.footprints_in(layer, 10, &shifted).unwrap().iter().map(|f| f.tile.column()).collect();
        assert_eq!(found, [0, size - 1]);
    }
}

#[test]
fn a_layer_answers_with_its_old_content_until_its_new_build_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    let tiles = block(8, 10, 10, 2);
    store_of(&path, "ortho", &tiles, 1);
    let before = Reader::open(&path).unwrap().digest().to_owned();
    let new = source(2);
    let begin = || Writer::begin(&path, CONTRACT, declaration("ortho", vec![new.clone()], 8)).unwrap();
    let mut writer = begin();
    writer.put(&built(tiles[0], &new, 2, false)).unwrap();
    writer.commit().unwrap();
    drop(writer);
    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.digest(), before);
    assert_eq!(reader.sources(reader.layer("ortho").unwrap()).unwrap(), [source(1)]);
    let draft = LayerState::read(&path, "ortho").unwrap();
    assert!(
        draft.pending && draft.complete && draft.inputs[&tiles[0]] == [2; 32] && draft.inputs[&tiles[1]] == [1; 32]
    );
    let mut writer = begin();
    writer.put(&built(tiles[1], &new, 2, true)).unwrap();
    writer.finish(&|tile| tile == tiles[0] || tile == tiles[1]).unwrap();
    assert!(verify(&path, &|_, _| ()).unwrap().ok);
    let fresh = folder.path().join("fresh.gpkg");
    store_of(&fresh, "ortho", &tiles[..2], 2);
    assert_eq!(Reader::open(&path).unwrap().digest(), Reader::open(&fresh).unwrap().digest());
    assert!(Reader::open(&path).unwrap().digest() != before);
}

#[test]
fn an_unfinished_layer_answers_nothing_and_the_others_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    let tile = TileId::new(8, 10, 10).unwrap();
    let begin = |layer: &str| {
        let mut writer = Writer::begin(&path, CONTRACT, declaration(layer, vec![source(1)], 8)).unwrap();
        writer.put(&built(tile, &source(1), 1, false)).unwrap();
        writer.commit().unwrap();
        writer
    };
    drop(begin("first"));
    assert_eq!(Reader::open(&path).unwrap_err().code(), "unfinished_build");
    assert_eq!(Reader::open_onboard(&path).unwrap_err().code(), "unfinished_build");
    begin("second").finish(&|_| true).unwrap();
    let reader = Reader::open(&path).unwrap();
    assert!(reader.layer("second").is_ok());
    assert_eq!(reader.layer("first").unwrap_err().code(), "unfinished_build");
    assert_eq!(reader.layer("third").unwrap_err().code(), "no_such_layer");
    begin("first").abandon().unwrap();
    assert_eq!(Reader::open(&path).unwrap().layers().len(), 1);
    change_layer(&path, "second", &LayerChange::Remove).unwrap();
    assert_eq!(Reader::open(&path).unwrap_err().code(), "empty_store");
    assert!(verify(&path, &|_, _| ()).unwrap().ok);
}

#[test]
fn verification_lists_every_bad_tile() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    let tiles = block(8, 10, 10, 3);
    store_of(&path, "ortho", &tiles, 1);
    let database = rusqlite::Connection::open(&path).unwrap();
    for tile in &tiles[3..5] {
        let changed = database
            .execute(
                "UPDATE ortho SET tile_data = tile_data || x'00' WHERE tile_column = ?1 AND tile_row = ?2",
                (tile.column(), tile.row()),
            )
            .unwrap();
        assert_eq!(changed, 1);
    }
    let found = verify(&path, &|_, _| ()).unwrap();
    assert!(!found.ok);
    let ids: Vec<_> = found.bad_tiles.iter().map(|b| b.id.clone()).collect();
    assert_eq!(ids, [tiles[3].to_string(), tiles[4].to_string()]);
    database.execute("UPDATE overfly_sources SET acquired = '1999-01-01'", []).unwrap();
    assert_eq!(verify(&path, &|_, _| ()).unwrap().problems.len(), 1);
    database.execute("DELETE FROM rtree_footprints_geom WHERE id = 1", []).unwrap();
    assert!(verify(&path, &|_, _| ()).unwrap().problems.iter().any(|p| p.starts_with("R-tree")));
}

fn refusal(path: &Path) -> (StoreError, StoreError) {
    (Reader::open(path).unwrap_err(), Reader::open_onboard(path).unwrap_err())
}

#[test]
fn refuses_what_is_no_store_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let good = folder.path().join("good.gpkg");
    store_of(&good, "ortho", &block(8, 10, 10, 2), 1);
    let changed = |name: &str, sql: &str| {
        let path = folder.path().join(name);
        std::fs::copy(&good, &path).unwrap();
        rusqlite::Connection::open(&path).unwrap().execute_batch(sql).unwrap();
        path
    };
    let written = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let whole = std::fs::read(&good).unwrap();
    let cases = [
        (folder.path().join("absent.gpkg"), "store_not_found"),
        (folder.path().to_path_buf(), "not_a_store"),
        (written("empty.gpkg", b""), "cut_off"),
        (written("text.gpkg", &b"hello ".repeat(1000)), "not_a_store"),
        (written("short.gpkg", &whole[..whole.len() / 2]), "cut_off"),
        (written("header.gpkg", &whole[..50]), "cut_off"),
        (changed("foreign.gpkg", "DROP TABLE overfly_migrations"), "not_a_store"),
        (changed("plain.sqlite", "PRAGMA application_id = 0; DROP TABLE overfly_migrations"), "not_a_store"),
        (changed("newer.gpkg", "INSERT INTO overfly_migrations VALUES (99, 'later')"), "newer_store"),
        (changed("older.gpkg", "DELETE FROM overfly_migrations WHERE version > 1"), "older_store"),
        (changed("other.gpkg", "UPDATE overfly_store SET descriptor_contract = 'sift-9'"), "other_contract"),
    ];
    for (path, code) in cases {
        let (shared, onboard) = refusal(&path);
        for error in [shared, onboard] {
            assert_eq!(error.code(), code, "{error}");
            assert!(error.to_string().contains(&path.display().to_string()), "{error}");
        }
    }
    let newer = refusal(&folder.path().join("newer.gpkg")).0.to_string();
    assert!(newer.contains("99") && newer.contains(&FORMAT_VERSION.to_string()), "{newer}");
    let other = refusal(&folder.path().join("other.gpkg")).0.to_string();
    assert!(other.contains("sift-9") && other.contains(CONTRACT), "{other}");
}

#[test]
fn onboard_refuses_a_store_beside_an_unfinished_side_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    store_of(&path, "ortho", &block(8, 10, 10, 2), 1);
    for suffix in ["-wal", "-journal"] {
        let side = folder.path().join(format!("s.gpkg{suffix}"));
        std::fs::write(&side, b"").unwrap();
        assert!(Reader::open_onboard(&path).is_ok(), "an empty side file is none");
        std::fs::write(&side, b"something").unwrap();
        assert_eq!(Reader::open_onboard(&path).unwrap_err().code(), "side_file");
        std::fs::remove_file(&side).unwrap();
    }
}

#[test]
fn a_reader_is_shared_between_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    let tiles = block(8, 10, 10, 4);
    store_of(&path, "ortho", &tiles, 1);
    let reader = Reader::open(&path).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let layer = reader.layer("ortho").unwrap();
                for tile in &tiles {
                    assert!(reader.tile(layer, *tile).unwrap().is_some());
                }
            });
        }
    });
}
