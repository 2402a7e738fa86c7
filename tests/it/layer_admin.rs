//! `overfly layer`: a changed layer is the one that a build would have made so, a dry run says what would change, and nothing is lost.

use super::store::store_of;
use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::tile::TileId;
use overfly_ingest::build::{self, BuildSummary, DescribeRequest, Request};
use overfly_store::{Extract, LayerChange, LayerHead, Reader, StoreError, change_layer, preview_layer_change, verify};
use overfly_testkit::drawn::{CRS, drawn_store, orthophoto};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn build(db: &Path, layer: &str, source: &Path, date: Option<&str>, licence: Option<&str>) -> BuildSummary {
    let mut request = Request {
        db: db.into(),
        layer: layer.into(),
        sources: vec![source.into()],
        crs: Some(CRS),
        date: date.map(str::to_owned),
        threads: 2,
        ..Request::default()
    };
    request.terms.licence = licence.map(str::to_owned);
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn digest(db: &Path) -> String {
    Reader::open(db).unwrap().digest().to_owned()
}

fn good(db: &Path) {
    let found = verify(db, &|_, _| ()).unwrap();
    assert!(found.ok, "{found:?}");
}

/// A folder with an orthophoto, and a store of it and another one: layers `ortho` (no date) and `other`.
fn desk() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let photo = orthophoto(folder.path(), "a.png", (900, 800), (0, 0), 1, true);
    let other = orthophoto(folder.path(), "b.png", (600, 600), (100, 0), 2, false);
    let db = folder.path().join("map.gpkg");
    build(&db, "ortho", &photo, None, None);
    build(&db, "other", &other, Some("2015-01-01"), None);
    (folder, db, photo)
}

#[test]
fn a_renamed_layer_is_the_one_built_under_that_name() {
    let (folder, db, photo) = desk();
    let expected = folder.path().join("expected.gpkg");
    build(&expected, "y2018", &photo, None, None);
    build(&expected, "other", &folder.path().join("b.png"), Some("2015-01-01"), None);
    let change = LayerChange::Rename { to: "y2018".into() };
    let bytes = std::fs::read(&db).unwrap();
    let planned = preview_layer_change(&db, "ortho", &change).unwrap();
    assert_eq!(std::fs::read(&db).unwrap(), bytes, "a preview writes nothing");
    let done = change_layer(&db, "ortho", &change).unwrap();
    assert_eq!(planned, done);
    assert_eq!(done.digest_after.as_ref(), Some(&digest(&db)));
    assert_eq!(digest(&db), digest(&expected));
    good(&db);
    // A build goes on from there: it finds its tiles.
    let again = build(&db, "y2018", &photo, None, None);
    assert_eq!((again.computed_tiles, again.digest), (0, digest(&expected)));
}

#[test]
fn a_described_layer_is_the_one_built_so() {
    let (folder, db, photo) = desk();
    let expected = folder.path().join("expected.gpkg");
    build(&expected, "ortho", &photo, Some("2018-07-16"), Some("CC0-1.0"));
    build(&expected, "other", &folder.path().join("b.png"), Some("2015-01-01"), None);
    let request = DescribeRequest {
        db: db.clone(),
        layer: "ortho".into(),
        licence: Some("CC0-1.0".into()),
        date: Some("2018-07-16".into()),
        ..DescribeRequest::default()
    };
    let planned = request.preview().unwrap();
    assert_eq!(request.run().unwrap(), planned);
    assert_eq!((digest(&db), planned.digest_after), (digest(&expected), Some(digest(&expected))));
    good(&db);
    let again = build(&db, "ortho", &photo, Some("2018-07-16"), None);
    assert_eq!((again.computed_tiles, again.digest), (0, digest(&expected)));
    // An empty text takes a statement away.
    let request = DescribeRequest { licence: Some(String::new()), date: None, ..request };
    request.run().unwrap();
    assert_eq!(Reader::open(&db).unwrap().layer("ortho").unwrap().terms.licence, None);
    good(&db);
}

#[test]
fn a_description_is_part_of_no_digest_and_survives_a_build() {
    let (folder, db, photo) = desk();
    let request = DescribeRequest {
        db: db.clone(),
        layer: "ortho".into(),
        description: Some("summer flight".into()),
        ..DescribeRequest::default()
    };
    let before = digest(&db);
    let done = request.run().unwrap();
    assert_eq!((done.digest_before.as_ref(), done.digest_after.as_ref()), (Some(&before), Some(&before)));
    let described = || {
        let store = Reader::open(&db).unwrap();
        store.description(store.layer("ortho").unwrap()).unwrap()
    };
    assert_eq!(described().as_deref(), Some("summer flight"));
    build(&db, "ortho", &orthophoto(folder.path(), "c.png", (500, 500), (900, 0), 3, false), None, None);
    build(&db, "ortho", &photo, None, Some("CC0-1.0"));
    assert_eq!(described().as_deref(), Some("summer flight"));
    good(&db);
}

#[test]
fn one_date_for_overlapping_sources_of_two_dates_is_refused() {
    let (_folder, db, photo) = desk();
    let other = photo.with_file_name("b.png");
    // Two orders cannot both be that of the hashes: in one of them a date for all turns the cover round.
    let refused = [("2010-01-01", "2012-01-01"), ("2012-01-01", "2010-01-01")].map(|(first, second)| {
        build(&db, "two", &photo, Some(first), None);
        build(&db, "two", &other, Some(second), None);
        let date = Some("2018-07-16".into());
        let request = DescribeRequest { db: db.clone(), layer: "two".into(), date, ..DescribeRequest::default() };
        request.preview().err().map(|error| error.code())
    });
    assert!(refused.contains(&Some("date_changes_cover")) && refused.contains(&None), "{refused:?}");
    let date = Some("16.07.2018".into());
    let request = DescribeRequest { db, layer: "two".into(), date, ..DescribeRequest::default() };
    assert_eq!(request.run().unwrap_err().code(), "date");
}

#[test]
fn a_removed_layer_leaves_the_store_as_before_it_was_built() {
    let (folder, db, _) = desk();
    let alone = folder.path().join("alone.gpkg");
    build(&alone, "other", &folder.path().join("b.png"), Some("2015-01-01"), None);
    let planned = preview_layer_change(&db, "ortho", &LayerChange::Remove).unwrap();
    assert_eq!(change_layer(&db, "ortho", &LayerChange::Remove).unwrap(), planned);
    assert_eq!(digest(&db), digest(&alone));
    good(&db);
    let last = change_layer(&db, "other", &LayerChange::Remove).unwrap();
    assert_eq!(last.digest_after, None);
    assert_eq!(Reader::open(&db).unwrap_err().code(), "empty_store");
}

#[test]
fn what_cannot_be_changed_is_refused_and_left() {
    let (folder, db, _) = desk();
    let refused = |name: &str, change: &LayerChange| {
        let planned = preview_layer_change(&db, name, change).unwrap_err();
        let error = change_layer(&db, name, change).unwrap_err();
        assert_eq!(planned.to_string(), error.to_string());
        error.code()
    };
    let to = |name: &str| LayerChange::Rename { to: name.into() };
    let before = digest(&db);
    assert_eq!(refused("summer", &to("y2018")), "no_such_layer");
    assert_eq!(refused("ortho", &to("other")), "layer_exists");
    assert_eq!(refused("ortho", &to("overfly_x")), "layer_name");
    assert_eq!(refused("ortho", &to("any")), "layer_name");
    assert_eq!(digest(&db), before);
    let exported = folder.path().join("exported.gpkg");
    crate::export::export_to(drawn_store(), &crate::export::drawn_request(), &exported);
    let bytes = std::fs::read(&exported).unwrap();
    for change in [to("y2018"), LayerChange::Remove, LayerChange::Describe(Default::default())] {
        for outcome in [preview_layer_change(&exported, "ortho", &change), change_layer(&exported, "ortho", &change)] {
            assert!(matches!(outcome, Err(StoreError::Sealed { .. })), "{outcome:?}");
        }
    }
    assert_eq!(std::fs::read(&exported).unwrap(), bytes);
}

/// A store as an older program may have built it: its layer is called `any`.
fn store_with_a_layer_called_any(folder: &Path) -> PathBuf {
    let (plain, old) = (folder.join("plain.gpkg"), folder.join("old.gpkg"));
    let tiles: Vec<TileId> = (0..4).map(|i| TileId::new(12, 100 + i, 200).unwrap()).collect();
    store_of(&plain, "ortho", &tiles, 7);
    let store = Reader::open(&plain).unwrap();
    let layer = store.layer("ortho").unwrap();
    let head = LayerHead {
        name: "any".into(),
        base_zoom: 12,
        min_zoom: 12,
        zoom_override: None,
        terms: Default::default(),
        terrain: None,
    };
    let draft = Extract::begin(&folder.join("draft"), CONTRACT).unwrap();
    draft.begin_layer(&head).unwrap();
    for tile in tiles {
        draft.put("any", &store.stored_tile(layer, tile).unwrap().unwrap()).unwrap();
    }
    draft.end_layer(&head, store.sources(layer).unwrap()).unwrap();
    draft.finish(&old, None, 0).unwrap();
    old
}

#[test]
fn an_old_layer_called_any_is_reached_by_its_name_until_it_is_renamed() {
    let folder = tempfile::tempdir().unwrap();
    let old = store_with_a_layer_called_any(folder.path());
    let fix = || {
        let frame = overfly_testkit::drawn::project("tiles/flight/frames/005.jpg").display().to_string();
        said(folder.path(), &format!("fix --db old.gpkg --image {frame} --gsd-m-per-px 1.3 --layer any --json"))
    };
    assert!(fix().1.contains(r#""layers_searched":["any"],"layers_charged":1"#), "{}", fix().1);
    change_layer(&old, "any", &LayerChange::Rename { to: "y2007".into() }).unwrap();
    assert!(fix().1.contains(r#""layers_searched":["y2007"],"layers_charged":1"#), "{}", fix().1);
    good(&old);
}

/// Exit code, and both streams.
fn said(folder: &Path, words: &str) -> (Option<i32>, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .current_dir(folder)
        .args(words.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout) + &text(&done.stderr))
}

#[test]
fn the_command_line_asks_before_it_removes_and_speaks_of_exports() {
    let (folder, db, _) = desk();
    let ask = |words: &str, exit: i32, parts: &[&str]| {
        let (found, text) = said(folder.path(), words);
        assert_eq!(found, Some(exit), "{words}: {text}");
        parts.iter().for_each(|part| assert!(text.contains(part), "{words}: {part} in {text}"));
    };
    let before = digest(&db);
    let anew = "make and sign them anew";
    ask("layer rename --db map.gpkg ortho y2018 --dry-run", 0, &["nothing was written", "would change", anew]);
    ask("layer remove --db map.gpkg ortho", 2, &["not_confirmed", "was not removed", "--dry-run", "--yes"]);
    ask("layer remove --db map.gpkg ortho --dry-run", 0, &["would be removed; nothing was written", anew]);
    assert_eq!(digest(&db), before);
    ask("layer describe --db map.gpkg ortho --description flown", 0, &["unchanged: exports need not be made anew"]);
    ask("info map.gpkg", 0, &["description: flown"]);
    ask("layer rename --db map.gpkg ortho y2018 --json", 0, &[&before, r#""renamed_to":"y2018","dry_run":false"#]);
    ask("layer remove --db map.gpkg y2018 --yes", 0, &["removed", "has changed", anew]);
    // The old spelling.
    ask("build --db map.gpkg --layer other --remove-layer", 0, &["layer other removed"]);
}

#[test]
fn a_killed_change_leaves_the_store_before_or_after_it() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.gpkg");
    let tiles: Vec<TileId> = (0..900).map(|i| TileId::new(12, 100 + i % 30, 200 + i / 30).unwrap()).collect();
    store_of(&whole, "ortho", &tiles, 7);
    let before = digest(&whole);
    let command = |db: &Path, words: [&str; 2]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
        command.args(["layer", words[0], "--db"]).arg(db).args(["ortho", words[1]]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    for words in [["rename", "y2018"], ["remove", "--yes"]] {
        let db = folder.path().join(format!("{}.gpkg", words[0]));
        std::fs::copy(&whole, &db).unwrap();
        let start = Instant::now();
        assert!(command(&db, words).status().unwrap().success());
        let duration = start.elapsed();
        let after = Reader::open(&db).map(|reader| reader.digest().to_owned()).ok();
        for kill in 0..8 {
            std::fs::copy(&whole, &db).unwrap();
            let mut child = command(&db, words).spawn().unwrap();
            std::thread::sleep(duration.mul_f64((f64::from(kill) + 0.5) / 8.0).max(Duration::from_millis(1)));
            // A change that has ended by itself is as good.
            let _ = child.kill();
            child.wait().unwrap();
            match Reader::open(&db) {
                Ok(reader) => {
                    assert!([Some(before.as_str()), after.as_deref()].contains(&Some(reader.digest())));
                    good(&db);
                }
                Err(error) => assert!(after.is_none() && error.code() == "empty_store", "{error}"),
            }
        }
    }
}
