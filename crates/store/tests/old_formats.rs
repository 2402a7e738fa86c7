//! Tests: stores of an older readable format are read, exported and patched, and only a build migrates them.

use flate2::read::GzDecoder;
use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::TileId;
use overfly_store::package::{
    ApplyRequest, Manifest, ManifestLayer, ManifestRoute, PublicKey, SEAL_LEN, VerifyOptions, apply, open_onboard,
    parse_date, verify_package, write_patch, write_seal,
};
use overfly_store::{
    BuiltTile, Declaration, Extract, FORMAT_VERSION, LayerPart, LayerState, OLDEST_READABLE, Reader, Terms,
    TileContent, Writer, verify,
};
use std::io::Read;
use std::path::{Path, PathBuf};

fn tiles(count: u32) -> Vec<TileId> {
    (0..count).map(|column| TileId::new(9, 100 + column, 200).unwrap()).collect()
}

fn declaration() -> Declaration {
    Declaration {
        layer: "ortho".into(),
        sources: Vec::new(),
        zoom_override: None,
        base_zoom: 9,
        min_zoom: 9,
        terms: Terms::default(),
        terrain: None,
    }
}

/// Builds a store of `count` tiles in this program's format.
fn built(path: &Path, count: u32) -> Reader {
    built_with(path, count, &Mask::filled(512, 512, true))
}

/// As `built`; the tiles have pixels where `mask` says so.
fn built_with(path: &Path, count: u32, mask: &Mask) -> Reader {
    let mut writer = Writer::begin(path, CONTRACT, declaration()).unwrap();
    for tile in tiles(count) {
        let values = vec![tile.column() as u8; 512 * 512 * 3];
        let colour = Colour::from_values(512, 512, values).unwrap();
        let pixels = MaskedColour { colour, mask: mask.clone() };
        let content = Some(TileContent::encode(tile, &pixels, &[], None).unwrap());
        writer.put(&BuiltTile { tile, inputs_hash: [1; 32], content }).unwrap();
    }
    writer.finish(&|_| true).unwrap();
    Reader::open(path).unwrap()
}

/// Copies a store in a format version: sealed by a manifest, as an export, or as a built store.
fn copied(from: &Reader, path: &Path, version: u32, sealed: bool) -> PathBuf {
    let mut extract = Extract::begin_version(&path.with_extension("draft"), CONTRACT, version).unwrap();
    let part = LayerPart {
        name: "ortho".into(),
        base_zoom: 9,
        min_zoom: 9,
        tiles: tiles(9),
        with_descriptors: true,
        jpeg_quality: None,
    };
    extract.copy(from, &part, || ()).unwrap();
    if !sealed {
        extract.finish(path, None, 0).unwrap();
        return path.into();
    }
    let (level, _) = extract.level("ortho", 9).unwrap();
    let manifest = Manifest {
        format: Manifest::format(),
        name: None,
        serial: None,
        store_format: version,
        descriptor_contract: CONTRACT.into(),
        digest: extract.digest().unwrap(),
        cut_from: from.digest().into(),
        layers: vec![ManifestLayer::new(&extract.layers().unwrap()[0], Some(0.0), vec![level])],
        route: ManifestRoute { lines_deg: Vec::new(), corridor_m: 1.0, widest_m: 1.0, grown_by: None },
        calibration: None,
        dropped: Vec::new(),
        valid_until: None,
        signed_by: None,
    };
    extract.finish(path, Some(&manifest.to_text()), SEAL_LEN as u8).unwrap();
    write_seal(path, &manifest.to_text(), None).unwrap();
    path.into()
}

fn extension_documents(path: &Path) -> Vec<String> {
    let connection = rusqlite::Connection::open(path).unwrap();
    let mut statement = connection
        .prepare("SELECT DISTINCT definition FROM gpkg_extensions WHERE extension_name = 'overfly_store'")
        .unwrap();
    statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
}

#[test]
fn an_older_store_is_read_as_it_is_and_a_build_migrates_it() {
    let folder = tempfile::tempdir().unwrap();
    let current = built(&folder.path().join("new.gpkg"), 2);
    let old = copied(&current, &folder.path().join("old.gpkg"), OLDEST_READABLE, false);
    let bytes = std::fs::read(&old).unwrap();
    for reader in [Reader::open(&old).unwrap(), Reader::open_onboard(&old).unwrap()] {
        assert_eq!(reader.format_version(), OLDEST_READABLE);
        assert_ne!(reader.digest(), current.digest(), "a format that binds places has other digests");
        assert!(reader.tile(reader.layer("ortho").unwrap(), tiles(1)[0]).unwrap().is_some());
    }
    assert!(verify(&old, &|_, _| ()).unwrap().ok);
    assert!(LayerState::read(&old, "ortho").unwrap().complete);
    assert!(std::fs::read(&old).unwrap() == bytes, "a reader has changed the file");
    let writer = Writer::begin(&old, CONTRACT, declaration()).unwrap();
    writer.abandon().unwrap();
    let migrated = Reader::open(&old).unwrap();
    assert_eq!((migrated.format_version(), migrated.digest()), (FORMAT_VERSION, current.digest()));
    assert_eq!(extension_documents(&old), extension_documents(current.path()));
    assert_eq!(extension_documents(&old), ["overfly migrations/README.md"]);
}

#[test]
fn an_older_store_with_a_damaged_tile_is_not_migrated() {
    let folder = tempfile::tempdir().unwrap();
    let mut mask = Mask::filled(512, 512, true);
    (0..200).for_each(|i| mask.set(i, i / 2, false));
    let current = built_with(&folder.path().join("new.gpkg"), 2, &mask);
    // Bytes that no decoder takes, and those of another tile, which decode.
    for damage in ["zeroblob(length(tile_data))", "(SELECT tile_data FROM ortho WHERE id = 2)"] {
        let old = folder.path().join("old.gpkg");
        let _ = std::fs::remove_file(&old);
        let old = copied(&current, &old, OLDEST_READABLE, false);
        let alter = |sql: &str| rusqlite::Connection::open(&old).unwrap().execute_batch(sql).unwrap();
        alter(&format!("UPDATE ortho SET tile_data = {damage} WHERE id = 1"));
        let before = Reader::open(&old).unwrap().digest().to_owned();
        let error = overfly_store::migrate(&old).unwrap_err();
        assert_eq!(error.code(), "damaged_store", "{damage}: {error}");
        assert!(error.to_string().contains("of layer ortho is damaged"), "{damage}: {error}");
        let reader = Reader::open(&old).unwrap();
        assert_eq!((reader.format_version(), reader.digest()), (OLDEST_READABLE, before.as_str()), "{damage}");
    }
}

#[test]
fn an_older_export_is_flown_and_never_migrated() {
    let folder = tempfile::tempdir().unwrap();
    let current = built(&folder.path().join("new.gpkg"), 2);
    let old = copied(&current, &folder.path().join("old.gpkg"), OLDEST_READABLE, true);
    let bytes = std::fs::read(&old).unwrap();
    let onboard = open_onboard(&old, None, &[], parse_date("2026-11-22").unwrap()).unwrap();
    assert_eq!(onboard.manifest.unwrap().store_format, OLDEST_READABLE);
    assert_eq!(Writer::begin(&old, CONTRACT, declaration()).unwrap_err().code(), "sealed_store");
    assert!(std::fs::read(&old).unwrap() == bytes, "an exported store was written");
}

#[test]
fn patches_lead_from_any_readable_format_to_any_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (less, more) = (built(&path("less.gpkg"), 2), built(&path("more.gpkg"), 3));
    for from in OLDEST_READABLE..=FORMAT_VERSION {
        for to in OLDEST_READABLE..=FORMAT_VERSION {
            let old = copied(&less, &path(&format!("old-{from}-{to}.gpkg")), from, true);
            let new = copied(&more, &path(&format!("new-{from}-{to}.gpkg")), to, true);
            let (patch, out) = (path("a.patch"), path("out.gpkg"));
            write_patch(&Reader::open(&old).unwrap(), &Reader::open(&new).unwrap(), &patch, &|_, _| ()).unwrap();
            let today = parse_date("2026-11-22").unwrap();
            let request = ApplyRequest { store: &old, patch: &patch, out: &out, key: None, today, allow_older: false };
            assert!(apply(&request, &|_, _| ()).unwrap().changed);
            assert!(std::fs::read(&out).unwrap() == std::fs::read(&new).unwrap(), "{from} to {to}");
        }
    }
}

/// A file that a program of that format wrote, unpacked into a folder. `crates/store/tests/fixtures` holds a built store of a photo,
/// its signed export, a signed export of a wider corridor, and the patch from the first to the second.
fn kept(folder: &Path, name: &str) -> PathBuf {
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name);
    let (mut bytes, out) = (Vec::new(), folder.join(name.trim_end_matches(".gz")));
    if name.ends_with(".gz") {
        GzDecoder::new(std::fs::File::open(packed).unwrap()).read_to_end(&mut bytes).unwrap();
    } else {
        bytes = std::fs::read(packed).unwrap();
    }
    std::fs::write(&out, bytes).unwrap();
    out
}

#[test]
fn what_older_programs_wrote_opens_answers_and_verifies() {
    let folder = tempfile::tempdir().unwrap();
    let key = PublicKey::read(&kept(folder.path(), "signer.pem")).unwrap();
    let today = parse_date("2026-11-29").unwrap();
    for format in [4, 5] {
        let built = kept(folder.path(), &format!("format{format}_built.gpkg.gz"));
        let signed = kept(folder.path(), &format!("format{format}_signed.gpkg.gz"));
        let wider = kept(folder.path(), &format!("format{format}_wider.gpkg.gz"));
        let patch = kept(folder.path(), &format!("format{format}.patch.bin"));
        let bytes = std::fs::read(&signed).unwrap();
        let reader = Reader::open_proved(&built).unwrap();
        assert_eq!(reader.format_version(), format);
        let layer = reader.layer("ortho").unwrap();
        let footprint = &reader.footprints(layer, layer.base_zoom).unwrap()[0];
        assert_eq!((footprint.horizontal_error_m, &footprint.valid_outline), (None, &None), "0 was no known error");
        assert!(reader.tile(layer, footprint.tile).unwrap().is_some());
        assert!(open_onboard(&signed, Some(&key), &[], today).is_ok());
        let options = VerifyOptions { key: Some(&key), today, every_tile: true };
        assert!(verify_package(&signed, &options, &|_, _| ()).unwrap().store.ok);
        let out = folder.path().join("out.gpkg");
        let request =
            ApplyRequest { store: &signed, patch: &patch, out: &out, key: Some(&key), today, allow_older: false };
        assert!(apply(&request, &|_, _| ()).unwrap().changed);
        assert!(std::fs::read(&out).unwrap() == std::fs::read(&wider).unwrap(), "format {format}");
        assert!(std::fs::read(&signed).unwrap() == bytes, "an exported store was written");
        overfly_store::migrate(&built).unwrap();
        let migrated = Reader::open_proved(&built).unwrap();
        assert_eq!(migrated.format_version(), FORMAT_VERSION);
        assert!(verify(&built, &|_, _| ()).unwrap().ok);
        let layer = migrated.layer("ortho").unwrap();
        let footprint = &migrated.footprints(layer, layer.base_zoom).unwrap()[0];
        assert_eq!(footprint.horizontal_error_m, None);
        assert_eq!(footprint.valid_outline.is_some(), footprint.valid_fraction < 1.0, "outlines are filled in");
    }
}
