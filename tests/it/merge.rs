//! Stores that were built apart become what one build of all their sources makes, or are refused.

use overfly_ingest::build::{self, BuildError, Conflict, MergeError, MergeRequest, Merged, Request, merge};
use overfly_store::{Reader, verify};
use overfly_testkit::drawn::project;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

const WEST: &str = "tiles/epoch_1/west.jpg";
const EAST: &str = "tiles/epoch_1/east.jpg";

fn request(db: &Path, layer: &str, source: &str, date: Option<&str>) -> Request {
    Request {
        db: db.into(),
        layer: layer.into(),
        sources: vec![project(source)],
        date: date.map(str::to_owned),
        ..Request::default()
    }
}

fn build(request: &Request) -> build::BuildSummary {
    build::run(request, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn merged(stores: &[&Path], out: &Path, conflict: Conflict) -> Result<Merged, MergeError> {
    let stores = stores.iter().map(|p| p.to_path_buf()).collect();
    merge(&MergeRequest { stores, out: out.into(), conflict }, &|_, _| ())
}

/// West of 2018 and east of 2019, each in a store of its own, and both built together.
fn halves(folder: &Path) -> [PathBuf; 3] {
    let [west, east, both] = ["west.gpkg", "east.gpkg", "both.gpkg"].map(|n| folder.join(n));
    let (old, new) = (Some("2018-05-01"), Some("2019-05-01"));
    build(&request(&west, "ortho", WEST, old));
    build(&request(&east, "ortho", EAST, new));
    build(&request(&both, "ortho", WEST, old));
    build(&request(&both, "ortho", EAST, new));
    [west, east, both]
}

#[test]
fn halves_become_the_whole_and_a_build_goes_on_from_there() {
    let folder = tempfile::tempdir().unwrap();
    let [west, east, both] = halves(folder.path());
    let out = folder.path().join("out.gpkg");
    let told = merged(&[&west, &east], &out, Conflict::Newest).unwrap();
    assert!(verify(&out, &|_, _| ()).unwrap().ok);
    assert!(told.layers[0].blended_tiles > 0 && told.layers[0].taken_tiles > 20, "{told:?}");
    // Against one build of both, tile by tile: the same content, but where a lossy tile shows through another's hole.
    let (made, whole) = (Reader::open(&out).unwrap(), Reader::open(&both).unwrap());
    let (a, b) = (made.all_footprints("ortho").unwrap(), whole.all_footprints("ortho").unwrap());
    assert_eq!(a.iter().map(|f| f.tile).collect::<Vec<_>>(), b.iter().map(|f| f.tile).collect::<Vec<_>>());
    let (one, other) = (made.layer("ortho").unwrap(), whole.layer("ortho").unwrap());
    assert_eq!((one.min_zoom, one.base_zoom, one.bounds_deg), (other.min_zoom, other.base_zoom, other.bounds_deg));
    assert_eq!(made.sources(one).unwrap(), whole.sources(other).unwrap());
    let mut differing = 0;
    for (x, y) in a.iter().zip(&b) {
        assert_eq!((&x.sources, &x.acquired, x.horizontal_error_m), (&y.sources, &y.acquired, y.horizontal_error_m));
        if x == y {
            continue;
        }
        differing += 1;
        let (p, q) = (made.tile(one, x.tile).unwrap().unwrap(), whole.tile(other, y.tile).unwrap().unwrap());
        assert_eq!(p.mask, q.mask, "{}", x.tile);
        let pairs = p.colour.values().iter().zip(q.colour.values());
        let mean = pairs.map(|(p, q)| f64::from(p.abs_diff(*q))).sum::<f64>() / p.colour.values().len() as f64;
        assert!(mean < 2.0, "{}: {mean}", x.tile);
    }
    assert!(differing < 16, "{differing} of {}", a.len());
    // A build knows what is as it would make it, makes the rest anew, and ends as the whole.
    let again = build(&request(&out, "ortho", WEST, Some("2018-05-01")));
    assert!(again.computed_tiles < 2 * differing + 8, "{again:?}");
    assert_eq!(again.digest, whole.digest());
}

#[test]
fn neither_order_nor_repetition_changes_what_the_newest_covers() {
    let folder = tempfile::tempdir().unwrap();
    let [west, east, _] = halves(folder.path());
    let at = |name: &str| folder.path().join(name);
    merged(&[&west, &east], &at("a.gpkg"), Conflict::Newest).unwrap();
    merged(&[&east, &west], &at("b.gpkg"), Conflict::Newest).unwrap();
    assert_eq!(std::fs::read(at("a.gpkg")).unwrap(), std::fs::read(at("b.gpkg")).unwrap());
    // With what is in it already nothing changes.
    let twice = merged(&[&at("a.gpkg"), &east], &at("c.gpkg"), Conflict::Newest).unwrap();
    assert_eq!(twice.digest, Reader::open(&at("a.gpkg")).unwrap().digest());
    let first = merged(&[&west, &east], &at("d.gpkg"), Conflict::First).unwrap();
    let other = merged(&[&east, &west], &at("e.gpkg"), Conflict::First).unwrap();
    assert_eq!(other.digest, twice.digest);
    assert_ne!(first.digest, twice.digest);
}

#[test]
fn layers_of_different_names_stand_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    build(&request(&at("a.gpkg"), "y2018", WEST, None));
    build(&request(&at("b.gpkg"), "y2020", "tiles/epoch_2/whole.jpg", None));
    let told = merged(&[&at("b.gpkg"), &at("a.gpkg")], &at("out.gpkg"), Conflict::Refuse).unwrap();
    assert_eq!(told.layers.iter().map(|l| l.layer.as_str()).collect::<Vec<_>>(), ["y2018", "y2020"]);
    let out = Reader::open(&at("out.gpkg")).unwrap();
    for (store, name) in [("a.gpkg", "y2018"), ("b.gpkg", "y2020")] {
        let alone = Reader::open(&at(store)).unwrap();
        assert_eq!(out.layer(name).unwrap(), alone.layer(name).unwrap());
    }
    assert!(verify(&at("out.gpkg"), &|_, _| ()).unwrap().ok);
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let [west, east, _] = halves(folder.path());
    let at = |name: &str| folder.path().join(name);
    let out = at("out.gpkg");
    let refused = |stores: &[&Path], conflict| {
        let error = merged(stores, &out, conflict).unwrap_err();
        assert!(error.is_unusable_input() && !out.exists(), "{error}");
        error.code()
    };
    assert_eq!(refused(&[&west, &east], Conflict::Refuse), "tile_conflict");
    assert_eq!(refused(&[&west], Conflict::Newest), "usage");
    assert_eq!(refused(&[&west, &at("none.gpkg")], Conflict::Newest), "store_not_found");
    build(&Request { zoom: Some(14), ..request(&at("coarse.gpkg"), "ortho", EAST, Some("2019-05-01")) });
    assert_eq!(refused(&[&west, &at("coarse.gpkg")], Conflict::Newest), "other_zoom");
    build(&request(&at("undated.gpkg"), "ortho", WEST, None));
    assert_eq!(refused(&[&west, &at("undated.gpkg")], Conflict::Newest), "other_declaration");
    let half_done = at("half.gpkg");
    let stopped = build::run(&request(&half_done, "ortho", EAST, None), &mut |_| ControlFlow::Break(()));
    assert!(matches!(stopped, Err(BuildError::Cancelled)));
    assert_eq!(refused(&[&west, &half_done], Conflict::Newest), "unfinished_build");
    let error = merged(&[&west, &east], &east, Conflict::Newest).unwrap_err();
    assert_eq!(error.code(), "same_file");
    let exported = at("exported.gpkg");
    crate::export::export_to(overfly_testkit::drawn::drawn_store(), &crate::export::drawn_request(), &exported);
    assert_eq!(refused(&[&west, &exported], Conflict::Newest), "sealed_store");
}
