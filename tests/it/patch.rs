//! A patch makes of the old store the new one, to the digest (an exported one to the byte), or nothing at all.

use crate::export::{drawn_request, export_to};
use overfly_ingest::build::{self, Request};
use overfly_ingest::export::ExportRequest;
use overfly_store::Reader;
use overfly_store::package::{
    ApplyRequest, Difference, PackageError, PatchHeader, PublicKey, SecretKey, apply, diff, generate, write_patch,
};
use overfly_testkit::drawn::{drawn_store, project};
use overfly_testkit::injury::a_day;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

fn built(db: &Path, sources: &[&str], date: Option<&str>) -> Reader {
    let request = Request {
        db: db.into(),
        layer: "ortho".into(),
        sources: sources.iter().map(|s| project(s)).collect(),
        date: date.map(str::to_owned),
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    Reader::open(db).unwrap()
}

fn patch(old: &Reader, new: &Reader, out: &Path) -> Difference {
    write_patch(old, new, out, &|_, _| ()).unwrap()
}

/// Applies a patch in place.
fn applied(store: &Path, patch: &Path, key: Option<&PublicKey>) -> Result<bool, PackageError> {
    apply(&ApplyRequest { store, patch, out: store, key, today: a_day(), allow_older: false }, &|_, _| ())
        .map(|a| a.changed)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A patch's bytes with the digest at their end put right.
fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 32;
    bytes[end..].fill(0);
    let digest = *blake3::hash(&bytes).as_bytes();
    bytes[end..].copy_from_slice(&digest);
    bytes
}

/// Two exports of the drawn store, the second wider, and the patch between them.
fn exports(folder: &Path, key: Option<&Path>) -> [PathBuf; 3] {
    let [old, new, patch_file] = ["old.gpkg", "new.gpkg", "a.patch"].map(|n| folder.join(n));
    let secret = || key.map(|k| SecretKey::read(k).unwrap());
    export_to(drawn_store(), &ExportRequest { key: secret(), ..drawn_request() }, &old);
    export_to(drawn_store(), &ExportRequest { key: secret(), corridor_m: 600.0, ..drawn_request() }, &new);
    patch(&Reader::open(&old).unwrap(), &Reader::open(&new).unwrap(), &patch_file);
    [old, new, patch_file]
}

#[test]
fn makes_one_built_store_of_the_other_and_back() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let both = ["tiles/epoch_1/west.jpg", "tiles/epoch_1/east.jpg"];
    let (old, new) = (built(&at("old.gpkg"), &both[..1], None), built(&at("new.gpkg"), &both, None));
    let (there, back) = (at("there.patch"), at("back.patch"));
    let found = patch(&old, &new, &there);
    let [layer] = &found.layers[..] else { panic!("{found:?}") };
    assert!(layer.added > 0 && layer.changed > 0 && layer.same > 0 && layer.removed == 0, "{layer:?}");
    assert!(found.patch_bytes.unwrap() < new.bytes());
    assert_eq!(patch(&new, &old, &back).layers[0].removed, layer.added);

    let store = at("store.gpkg");
    std::fs::copy(old.path(), &store).unwrap();
    assert!(applied(&store, &there, None).unwrap());
    assert!(!applied(&store, &there, None).unwrap(), "applied once more it changes nothing");
    let result = Reader::open(&store).unwrap();
    assert_eq!(result.digest(), new.digest());
    assert!(overfly_store::verify(&store, &|_, _| ()).unwrap().ok);
    assert!(diff(&result, &new).unwrap().layers.iter().all(|l| l.added + l.changed + l.removed == 0));
    // What tiles were made from came along: a build has nothing to do.
    let request =
        Request { db: store.clone(), layer: "ortho".into(), sources: both.map(project).into(), ..Request::default() };
    let summary = build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!((summary.computed_tiles, summary.digest.as_str()), (0, new.digest()));
    assert!(applied(&store, &back, None).unwrap());
    assert_eq!(Reader::open(&store).unwrap().digest(), old.digest());
}

#[test]
fn holds_only_what_changed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let source = ["tiles/epoch_1/west.jpg"];
    let old = built(&at("old.gpkg"), &source, Some("2018-05-01"));
    let new = built(&at("new.gpkg"), &source, Some("2019-05-01"));
    let found = patch(&old, &new, &at("date.patch"));
    // Every tile has another date and the same content.
    assert_eq!((found.layers[0].changed, found.layers[0].same), (37, 0));
    assert!(found.patch_bytes.unwrap() < 37 * 400, "{found:?}");
    assert!(applied(&at("old.gpkg"), &at("date.patch"), None).unwrap());
    assert_eq!(Reader::open(&at("old.gpkg")).unwrap().digest(), new.digest());
    let nothing = patch(&new, &new, &at("nothing.patch"));
    assert!(nothing.patch_bytes.unwrap() < 8000, "{nothing:?}");
}

#[test]
fn makes_an_exported_store_byte_for_byte_and_proves_who_signed() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["ours", "theirs"].map(|name| {
        let (public, _) = generate(&folder.path().join(name)).unwrap();
        PublicKey::read(&public).unwrap()
    });
    let [old, new, patch_file] = exports(folder.path(), Some(&folder.path().join("ours")));
    let before = std::fs::read(&old).unwrap();
    assert_eq!(applied(&old, &patch_file, Some(&keys[1])).unwrap_err().code(), "wrong_key");
    assert_eq!(std::fs::read(&old).unwrap(), before);
    // Nor without a key by what nobody signed, or somebody else.
    let [nobodys, foreign, to] = ["nobodys.gpkg", "foreign.gpkg", "to.patch"].map(|name| folder.path().join(name));
    export_to(drawn_store(), &drawn_request(), &nobodys);
    let theirs = SecretKey::read(&folder.path().join("theirs")).unwrap();
    export_to(drawn_store(), &ExportRequest { key: Some(theirs), ..drawn_request() }, &foreign);
    for (other, code) in [(nobodys, "unsigned_store"), (foreign, "wrong_key")] {
        patch(&Reader::open(&old).unwrap(), &Reader::open(&other).unwrap(), &to);
        assert_eq!(applied(&old, &to, None).unwrap_err().code(), code);
        assert_eq!(std::fs::read(&old).unwrap(), before);
    }
    // The same patch twice has the same bytes.
    let again = folder.path().join("again.patch");
    patch(&Reader::open(&old).unwrap(), &Reader::open(&new).unwrap(), &again);
    assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&patch_file).unwrap());
    assert!(applied(&old, &patch_file, Some(&keys[0])).unwrap());
    let whole = std::fs::read(&new).unwrap();
    assert!(std::fs::read(&old).unwrap() == whole, "other bytes");
    // Once more nothing changes; nor is it called done where a byte went bad since, in a tile or in the seal.
    assert!(!applied(&old, &patch_file, Some(&keys[0])).unwrap());
    for (at, code) in [(whole.len() / 2, "damaged_store"), (16_330, "altered_seal")] {
        let mut bad = whole.clone();
        bad[at] ^= 1;
        std::fs::write(&old, bad).unwrap();
        assert_eq!(applied(&old, &patch_file, Some(&keys[0])).unwrap_err().code(), code);
    }
}

#[test]
fn a_patch_on_another_store_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new, patch_file] = exports(folder.path(), None);
    let other = folder.path().join("other.gpkg");
    export_to(drawn_store(), &ExportRequest { corridor_m: 60.0, ..drawn_request() }, &other);
    let before = std::fs::read(&other).unwrap();
    let told = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .args(["apply", "--json"])
        .args([&other, &patch_file])
        .output()
        .unwrap();
    assert_eq!(told.status.code(), Some(2));
    let line: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(line["error"], "wrong_base");
    assert!(line["message"].as_str().unwrap().contains("other.gpkg"), "{line}");
    assert_eq!(std::fs::read(&other).unwrap(), before);
    // A store that is signed by nobody is none where a key is asked for.
    let (public, _) = generate(&folder.path().join("key")).unwrap();
    let key = PublicKey::read(&public).unwrap();
    assert_eq!(applied(&old, &patch_file, Some(&key)).unwrap_err().code(), "unsigned_store");
    assert_eq!(applied(&old, &new, None).unwrap_err().code(), "not_a_patch");
    assert_eq!(applied(&old, &folder.path().join("none.patch"), None).unwrap_err().code(), "not_a_patch");
    // What may not be flown any more is not put on the aircraft.
    let (late, to_late) = (folder.path().join("late.gpkg"), folder.path().join("late.patch"));
    let until = ExportRequest { valid_until: Some("2020-01-01".parse().unwrap()), ..drawn_request() };
    export_to(drawn_store(), &until, &late);
    patch(&Reader::open(&old).unwrap(), &Reader::open(&late).unwrap(), &to_late);
    assert_eq!(applied(&old, &to_late, None).unwrap_err().code(), "expired_store");
}

#[test]
fn an_altered_patch_is_refused_and_the_store_stays() {
    let folder = tempfile::tempdir().unwrap();
    let [old, _, patch_file] = exports(folder.path(), None);
    let (good, before) = (std::fs::read(&patch_file).unwrap(), std::fs::read(&old).unwrap());
    let bad = folder.path().join("bad.patch");
    let refuse = |bytes: &[u8], what: &str| {
        std::fs::write(&bad, bytes).unwrap();
        let error = applied(&old, &bad, None).unwrap_err();
        assert!(matches!(error.code(), "altered_patch" | "not_a_patch"), "{what}: {error}");
        error.code()
    };
    for step in 0..60 {
        let at = step * good.len() / 60;
        let mut flipped = good.clone();
        flipped[at] ^= 1 << (step % 8);
        refuse(&flipped, &format!("flip at {at}"));
        refuse(&good[..at], &format!("cut at {at}"));
        // Whoever alters it and puts its digest right is found out by the tiles, or by the result's own digest.
        if at > 16 && at < good.len() - 40 {
            std::fs::write(&bad, resealed(flipped)).unwrap();
            let outcome = applied(&old, &bad, None);
            let error = outcome.expect_err("a result that is not what was sealed");
            assert!(error.is_unusable_input(), "{at}: {error}");
        }
    }
    let mut longer = good;
    let end = longer.len() - 32;
    longer.splice(end..end, [0; 7]);
    assert_eq!(refuse(&resealed(longer), "longer"), "not_a_patch");
    assert_eq!(std::fs::read(&old).unwrap(), before);
    assert_eq!(names(folder.path()), ["a.patch", "bad.patch", "new.gpkg", "old.gpkg"]);
}

#[test]
fn a_hostile_header_names_no_table_and_no_level_that_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    let [old, _, patch_file] = exports(folder.path(), None);
    let good = std::fs::read(&patch_file).unwrap();
    let header = PatchHeader::read(&mut &good[..]).unwrap();
    let mut length = Vec::new();
    header.write(&mut length).unwrap();
    let records = &good[length.len()..];
    let bad = folder.path().join("bad.patch");
    type Spoil = fn(&mut PatchHeader);
    let spoils: [Spoil; 5] = [
        |h| h.layers[0].head.name = "gpkg_contents".into(),
        |h| h.layers[0].head.name = "a\"; DROP TABLE footprints; --".into(),
        |h| h.layers[0].head.base_zoom = 200,
        |h| h.layers[0].head.min_zoom = 99,
        |h| h.sealed.as_mut().unwrap().seal.truncate(20),
    ];
    for (index, spoil) in spoils.into_iter().enumerate() {
        let mut spoiled = header.clone();
        spoil(&mut spoiled);
        let mut bytes = Vec::new();
        spoiled.write(&mut bytes).unwrap();
        bytes.extend_from_slice(records);
        std::fs::write(&bad, resealed(bytes)).unwrap();
        assert_eq!(applied(&old, &bad, None).unwrap_err().code(), "not_a_patch", "{index}");
    }
    let mut twice = header;
    twice.layers.push(twice.layers[0].clone());
    let mut bytes = Vec::new();
    twice.write(&mut bytes).unwrap();
    bytes.extend_from_slice(records);
    std::fs::write(&bad, resealed(bytes)).unwrap();
    assert!(applied(&old, &bad, None).is_err());
}

#[test]
fn what_stands_in_the_way_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new, patch_file] = exports(folder.path(), None);
    // SQLite would roll another store's journal back into the new one.
    let out = folder.path().join("out.gpkg");
    let journal = folder.path().join("out.gpkg-journal");
    std::fs::write(&journal, b"what a killed build left").unwrap();
    let request =
        ApplyRequest { store: &old, patch: &patch_file, out: &out, key: None, today: a_day(), allow_older: false };
    assert_eq!(apply(&request, &|_, _| ()).unwrap_err().code(), "side_file");
    assert_eq!(names(folder.path()), ["a.patch", "new.gpkg", "old.gpkg", "out.gpkg-journal"]);
    std::fs::remove_file(&journal).unwrap();
    let request = ApplyRequest {
        store: &old,
        patch: &patch_file,
        out: &patch_file,
        key: None,
        today: a_day(),
        allow_older: false,
    };
    assert_eq!(apply(&request, &|_, _| ()).unwrap_err().code(), "same_file");
    let same = write_patch(&Reader::open(&old).unwrap(), &Reader::open(&new).unwrap(), &new, &|_, _| ());
    assert_eq!(same.unwrap_err().code(), "same_file");
    // A store whose build is not ended: its end would be lost.
    let unfinished = folder.path().join("unfinished.gpkg");
    let request = |sources: &[&str]| Request {
        db: unfinished.clone(),
        layer: "ortho".into(),
        sources: sources.iter().map(|s| project(s)).collect(),
        ..Request::default()
    };
    build::run(&request(&["tiles/epoch_1/west.jpg"]), &mut |_| ControlFlow::Continue(())).unwrap();
    build::run(&request(&["tiles/epoch_1/east.jpg"]), &mut |_| ControlFlow::Break(())).unwrap_err();
    let store = Reader::open(&unfinished).unwrap();
    let out = folder.path().join("b.patch");
    assert_eq!(
        write_patch(&store, &Reader::open(&new).unwrap(), &out, &|_, _| ()).unwrap_err().code(),
        "unfinished_build"
    );
    assert!(!out.exists());
}
