//! A build makes a layer that is a function of its set of sources, whatever the order, the threads and the history.

use overfly_core::tile::MercatorBounds;
use overfly_ingest::build::{self, BuildError, BuildSummary, Request};
use overfly_store::{Reader, verify};
use overfly_testkit::drawn::{CRS, orthophoto};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

const EVERYWHERE: MercatorBounds = MercatorBounds { min_x_m: -2.1e7, min_y_m: -2.1e7, max_x_m: 2.1e7, max_y_m: 2.1e7 };

fn request(db: &Path, sources: &[&PathBuf]) -> Request {
    Request {
        db: db.into(),
        layer: "ortho".into(),
        sources: sources.iter().map(|&s| s.clone()).collect(),
        crs: Some(CRS),
        threads: 2,
        ..Request::default()
    }
}

fn run(request: &Request) -> Result<BuildSummary, BuildError> {
    build::run(request, &mut |_| ControlFlow::Continue(()))
}

fn build(db: &Path, sources: &[&PathBuf]) -> BuildSummary {
    run(&request(db, sources)).unwrap()
}

/// Three overlapping sources, the last with a hole in the middle.
fn three(folder: &Path) -> [PathBuf; 3] {
    [
        orthophoto(folder, "a.png", (500, 400), (0, 0), 1, false),
        orthophoto(folder, "b.png", (500, 400), (300, 50), 2, false),
        orthophoto(folder, "c.png", (420, 420), (150, 100), 3, true),
    ]
}

#[test]
fn order_threads_and_history_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c] = three(folder.path());
    let db = |name: &str| folder.path().join(name);
    let all = build(&db("all.gpkg"), &[&a, &b, &c]);
    assert!(all.rejected.is_empty() && all.computed_tiles as u64 >= all.tiles && all.tiles > 8);
    let other = run(&Request { threads: 1, ..request(&db("other.gpkg"), &[&c, &a, &b]) }).unwrap();
    assert_eq!(other.digest, all.digest);
    let grown = db("grown.gpkg");
    let first = build(&grown, &[&b]);
    let second = build(&grown, &[&c]);
    let third = build(&grown, &[&a]);
    assert_eq!(third.digest, all.digest);
    assert!(third.kept_tiles > 0, "tiles that the new source does not meet are kept");
    let remove = |name: &Path| {
        run(&Request { remove_sources: vec![name.display().to_string()], ..request(&grown, &[]) }).unwrap()
    };
    assert_eq!(remove(&a).digest, second.digest);
    assert_eq!(remove(&c).digest, first.digest);
    let again = build(&grown, &[&b]);
    assert_eq!((again.computed_tiles, again.digest), (0, first.digest));
    for name in ["all.gpkg", "other.gpkg", "grown.gpkg"] {
        let found = verify(&db(name), &|_, _| ()).unwrap();
        assert!(found.ok, "{found:?}");
    }
}

#[test]
fn the_newest_source_covers_and_the_next_fill_its_holes() {
    let folder = tempfile::tempdir().unwrap();
    let [a, _, c] = three(folder.path());
    let db = folder.path().join("s.gpkg");
    run(&Request { date: Some("2020-05-01".into()), horizontal_error_m: Some(2.0), ..request(&db, &[&a]) }).unwrap();
    run(&Request { date: Some("2021-05-01".into()), horizontal_error_m: Some(0.5), ..request(&db, &[&c]) }).unwrap();
    let reader = Reader::open(&db).unwrap();
    let layer = reader.layer("ortho").unwrap();
    assert_eq!(layer.acquired, Some(("2020-05-01".into(), "2021-05-01".into())));
    let footprints = reader.footprints_in(layer, layer.base_zoom, &EVERYWHERE).unwrap();
    assert_eq!(footprints.len() as u64, layer.base_tiles);
    let both = footprints.iter().filter(|f| f.sources.contains(' ')).count();
    let newest = footprints.iter().filter(|f| f.acquired.as_deref() == Some("2021-05-01")).count();
    assert!(both > 0 && newest >= both && newest < footprints.len());
    for footprint in &footprints {
        let expected_m =
            if footprint.sources.contains(' ') || footprint.acquired.as_deref() < Some("2021") { 2.0 } else { 0.5 };
        assert_eq!(footprint.horizontal_error_m, Some(expected_m));
        assert!(reader.descriptors(layer, footprint.tile).unwrap().is_some());
    }
    let coarsest = reader.footprints(layer, layer.min_zoom).unwrap();
    assert!(!coarsest.is_empty() && coarsest.len() <= 4 && coarsest.iter().all(|f| f.keypoints == 0));
}

#[test]
fn another_content_at_the_same_path_replaces_the_old() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, _] = three(folder.path());
    let db = folder.path().join("s.gpkg");
    build(&db, &[&a, &b]);
    orthophoto(folder.path(), "a.png", (500, 400), (0, 0), 9, false);
    let replaced = build(&db, &[&a]);
    assert_eq!(replaced.sources, 2);
    let fresh = build(&folder.path().join("fresh.gpkg"), &[&a, &b]);
    assert_eq!(replaced.digest, fresh.digest);
    let only = run(&Request { replace_layer: true, ..request(&db, &[&b]) }).unwrap();
    assert_eq!(only.digest, build(&folder.path().join("only.gpkg"), &[&b]).digest);
}

#[test]
fn an_old_source_that_is_needed_and_gone_is_named_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, _] = three(folder.path());
    let far = orthophoto(folder.path(), "far.png", (200, 200), (5000, 5000), 4, false);
    let db = folder.path().join("s.gpkg");
    build(&db, &[&a]);
    let before = std::fs::read(&db).unwrap();
    std::fs::rename(&a, folder.path().join("elsewhere.png")).unwrap();
    let error = run(&request(&db, &[&b])).unwrap_err();
    assert_eq!(error.code(), "source_gone");
    assert!(error.to_string().contains("a.png"), "{error}");
    orthophoto(folder.path(), "a.png", (500, 400), (0, 0), 8, false);
    let error = run(&request(&db, &[&b])).unwrap_err();
    assert!(error.to_string().contains("altered"), "{error}");
    assert!(std::fs::read(&db).unwrap() == before, "nothing was written");
    assert!(run(&request(&db, &[&far])).is_ok(), "what does not overlap it needs it not");
}

#[test]
fn one_bad_file_among_many_is_named_and_the_rest_is_built() {
    let folder = tempfile::tempdir().unwrap();
    let sources = folder.path().join("sources");
    std::fs::create_dir(&sources).unwrap();
    let [a, b, _] = three(&sources);
    std::fs::write(sources.join("text.tif"), "hello").unwrap();
    let whole = std::fs::read(&b).unwrap();
    std::fs::write(&b, &whole[..whole.len() / 2]).unwrap();
    let blank = sources.join("blank.png");
    image::RgbaImage::new(60, 60).save(&blank).unwrap();
    std::fs::copy(a.with_extension("pgw"), blank.with_extension("pgw")).unwrap();
    let db = folder.path().join("s.gpkg");
    let summary = build(&db, &[&sources, &folder.path().join("absent.tif")]);
    let mut bad: Vec<_> = summary.rejected.iter().map(|r| r.path.file_name().unwrap().to_str().unwrap()).collect();
    bad.sort_unstable();
    assert_eq!(bad, ["absent.tif", "b.png", "blank.png", "text.tif"]);
    assert!(summary.rejected.iter().all(|r| r.message.contains(r.path.file_name().unwrap().to_str().unwrap())));
    assert_eq!(summary.sources, 2);
    assert!(verify(&db, &|_, _| ()).unwrap().ok);
}

#[test]
fn nothing_usable_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let [a, ..] = three(folder.path());
    let bad = folder.path().join("bad.tif");
    std::fs::write(&bad, "hello").unwrap();
    let db = folder.path().join("s.gpkg");
    assert_eq!(run(&request(&db, &[&bad])).unwrap_err().code(), "nothing_usable");
    assert_eq!(run(&request(&db, &[])).unwrap_err().code(), "no_sources");
    assert_eq!(run(&request(&folder.path().join("no/s.gpkg"), &[&a])).unwrap_err().code(), "no_such_folder");
    assert!(!db.exists());
    build(&db, &[&a]);
    let before = std::fs::read(&db).unwrap();
    assert_eq!(run(&request(&db, &[&bad])).unwrap_err().code(), "nothing_usable");
    let remove = |name: &str| run(&Request { remove_sources: vec![name.into()], ..request(&db, &[]) }).unwrap_err();
    assert_eq!(remove("unknown.tif").code(), "no_such_source");
    assert_eq!(remove(a.to_str().unwrap()).code(), "last_source");
    assert!(build::dry_run(&request(&db, &[&folder.path().join("b.png")])).unwrap().base_tiles > 0);
    assert!(std::fs::read(&db).unwrap() == before);
    let text = folder.path().join("text.gpkg");
    std::fs::write(&text, "my notes").unwrap();
    assert_eq!(run(&request(&text, &[&a])).unwrap_err().code(), "not_a_store");
    assert_eq!(std::fs::read(&text).unwrap(), b"my notes");
}

#[test]
fn a_dry_run_writes_nothing_and_comes_near_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c] = three(folder.path());
    let db = folder.path().join("s.gpkg");
    let estimate = build::dry_run(&request(&db, &[&a, &b, &c])).unwrap();
    assert!(!db.exists() && estimate.estimated_s > 0.0);
    let summary = build(&db, &[&a, &b, &c]);
    assert_eq!(estimate.base_tiles + estimate.overview_tiles, summary.computed_tiles);
    let ratio = estimate.estimated_bytes as f64 / summary.bytes as f64;
    assert!((0.8..1.2).contains(&ratio), "estimated {} for {}", estimate.estimated_bytes, summary.bytes);
}

#[test]
fn a_stopped_build_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, _] = three(folder.path());
    let expected = build(&folder.path().join("whole.gpkg"), &[&a, &b]);
    let db = folder.path().join("s.gpkg");
    let mut left = 5;
    let stopped = build::run(&request(&db, &[&a, &b]), &mut |_| {
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(stopped.unwrap_err().code(), "cancelled");
    assert_eq!(Reader::open(&db).unwrap_err().code(), "unfinished_build");
    let resumed = build(&db, &[]);
    assert_eq!(resumed.digest, expected.digest);
    assert_eq!(resumed.computed_tiles + 5, expected.computed_tiles);
}

#[test]
fn a_journal_left_beside_a_whole_store_goes_with_the_next_build() {
    let folder = tempfile::tempdir().unwrap();
    let [a, ..] = three(folder.path());
    let db = folder.path().join("s.gpkg");
    let before = build(&db, &[&a]);
    let journal = folder.path().join("s.gpkg-journal");
    std::fs::write(&journal, [0; 512]).unwrap();
    assert_eq!(Reader::open_onboard(&db).unwrap_err().code(), "side_file");
    assert_eq!(build(&db, &[&a]).digest, before.digest);
    assert!(!journal.exists() && Reader::open_onboard(&db).is_ok());
}

#[test]
fn layers_do_not_touch_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, _] = three(folder.path());
    let db = folder.path().join("s.gpkg");
    let alone = build(&db, &[&a]).digest;
    run(&Request { layer: "2021".into(), ..request(&db, &[&b]) }).unwrap();
    let reader = Reader::open(&db).unwrap();
    assert_eq!(reader.layers().iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["2021", "ortho"]);
    let ortho = reader.layer("ortho").unwrap();
    let found = reader.footprints_in(ortho, ortho.base_zoom, &EVERYWHERE).unwrap();
    assert_eq!(found.len() as u64, ortho.base_tiles);
    overfly_store::change_layer(&db, "2021", &overfly_store::LayerChange::Remove).unwrap();
    assert_eq!(Reader::open(&db).unwrap().digest(), alone);
    assert!(verify(&db, &|_, _| ()).unwrap().ok);
}
