//! Whatever goes wrong with disk or power, what is written is the old or the new, and what is read is right or refused.
//! The short form; `examples/faults` is the long one.

use crate::export::{drawn_request, export_to, request, route};
use overfly_ingest::build::{self, Request};
use overfly_store::Reader;
use overfly_store::package::{VerifyOptions, verify_package};
use overfly_testkit::drawn::{CRS, drawn_store, orthophoto, project};
use overfly_testkit::faults::bench::{FaultBench, TargetState};
use overfly_testkit::faults::operations::operations;
use overfly_testkit::faults::reading::{ReadTally, readings};
use overfly_testkit::faults::serving::ServiceReads;
use overfly_testkit::faults::shim::{FaultKind, InjectedFault};
use overfly_testkit::faults::tally::FaultTally;
use overfly_testkit::injury::a_day;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Faults of a kind on an operation; each operation meets a third of the kinds.
const EACH: u64 = 2;

/// The program under a layer that injects faults (LD_PRELOAD, so Linux only).
fn bench(folder: &Path) -> FaultBench {
    FaultBench::new(Path::new(env!("CARGO_BIN_EXE_overfly")), folder).unwrap()
}

/// The ends that targets came to, over the operations that resume or those that rename; what is wrong must be nothing.
fn ends(resumes: bool) -> BTreeMap<TargetState, u64> {
    let folder = tempfile::tempdir().unwrap();
    let bench = bench(folder.path());
    let (mut failures, mut ends) = (Vec::new(), BTreeMap::new());
    let operations = operations(&bench, folder.path());
    for (index, operation) in operations.iter().filter(|o| o.resumes == resumes).enumerate() {
        let expected = bench.undisturbed(operation);
        let kinds = FaultKind::KILLS.into_iter().chain(FaultKind::FULL).chain(FaultKind::IO);
        for kind in kinds.filter(|&kind| kind as usize % 3 == index % 3) {
            let tally = FaultTally::run(&bench, operation, &expected, kind, EACH, index as u64 * 9 + kind as u64);
            assert!(tally.points > EACH && tally.tried + tally.late == EACH, "{}: {kind:?} {tally:?}", operation.name);
            for end in [TargetState::Absent, TargetState::Old, TargetState::Unfinished, TargetState::New] {
                *ends.entry(end).or_insert(0) += tally.ended(end);
            }
            failures.extend(tally.failures);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    ends
}

#[test]
fn a_disturbed_build_leaves_the_old_or_the_new_and_goes_on() {
    let ends = ends(true);
    assert!([TargetState::Old, TargetState::Unfinished, TargetState::New].iter().all(|end| ends[end] > 0), "{ends:?}");
}

#[test]
fn what_is_renamed_into_place_is_absent_old_or_new() {
    let ends = ends(false);
    assert!(
        [TargetState::Absent, TargetState::Old, TargetState::New].iter().all(|end| ends[end] > 0)
            && ends[&TargetState::Unfinished] == 0,
        "{ends:?}"
    );
}

#[test]
fn nothing_is_written_or_read_that_the_layer_does_not_see() {
    let folder = tempfile::tempdir().unwrap();
    let bench = bench(folder.path());
    for operation in operations(&bench, folder.path()) {
        for kind in [FaultKind::Full, FaultKind::Bad] {
            bench.lay_out(&operation.before);
            let before = bench.content();
            let (output, report) = bench.disturb(&operation.arguments, InjectedFault { kind, at: 1 });
            assert!(!output.status.success() && report.fired.is_some(), "{}, {kind:?}", operation.name);
            assert_eq!(bench.content(), before, "{}, {kind:?}: something was written", operation.name);
        }
    }
}

#[test]
fn bad_reads_give_the_same_answer_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let bench = bench(folder.path());
    let exported = folder.path().join("exported.gpkg");
    export_to(drawn_store(), &drawn_request(), &exported);
    let mut failures = Vec::new();
    for reading in readings(drawn_store().path(), &exported, &project("")) {
        for kind in FaultKind::IO {
            let tally = ReadTally::run(&bench, &reading, kind, 2, kind as u64);
            assert!(tally.points > 2 && tally.tried == 2, "{}: {kind:?} {tally:?}", reading.name);
            failures.extend(tally.failures);
        }
    }
    export_to(drawn_store(), &request(route([15.6120, 48.4915], [15.6160, 48.4915]), 200.0), &exported);
    let serving = ServiceReads::new(&bench, &exported, &project("tiles/flight/frames/019.jpg"));
    for kind in FaultKind::IO {
        failures.extend(serving.tally(&bench, kind, 2, kind as u64).failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_store_cut_off_at_any_page_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (exported, built) = (folder.path().join("exported.gpkg"), folder.path().join("built.gpkg"));
    export_to(drawn_store(), &request(route([15.612, 48.4915], [15.6125, 48.4915]), 30.0), &exported);
    let tile = overfly_core::tile::TileId::new(3, 1, 1).unwrap();
    super::store::store_of(&built, "ortho", &[tile], 5);
    for store in [exported, built] {
        let options = VerifyOptions { key: None, today: a_day(), every_tile: false };
        assert!(verify_package(&store, &options, &|_, _| ()).unwrap().store.ok);
        let bytes = std::fs::read(&store).unwrap();
        let page = usize::from(u16::from_be_bytes([bytes[16], bytes[17]]));
        assert!(bytes.len() / page > 20, "{} pages", bytes.len() / page);
        for pages in 0..bytes.len() / page {
            std::fs::write(&store, &bytes[..pages * page]).unwrap();
            let found = verify_package(&store, &options, &|_, _| ());
            assert!(!found.is_ok_and(|f| f.store.ok), "{} cut off behind page {pages}", store.display());
        }
    }
}

/// A build that adds a source keeps tiles that it does not touch, and makes overviews of them: of a damaged one that would
/// be a wrong overview whose hash is right, which nothing could find later.
#[test]
fn no_overview_is_made_of_a_damaged_tile() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("map.gpkg");
    let build = |source: PathBuf| {
        let (sources, threads, crs) = (vec![source], 2, Some(CRS));
        let request = Request { db: db.clone(), layer: "ortho".into(), sources, threads, crs, ..Request::default() };
        build::run(&request, &mut |_| ControlFlow::Continue(()))
    };
    build(orthophoto(folder.path(), "a.png", (900, 800), (0, 0), 1, false)).unwrap();
    let reader = Reader::open(&db).unwrap();
    let layer = reader.layer("ortho").unwrap();
    let tiles = reader.footprints(layer, layer.base_zoom).unwrap();
    let west = tiles.iter().map(|f| f.tile).min_by_key(|t| t.column()).unwrap();
    let image = reader.encoded_tile(layer, west).unwrap().unwrap().bytes;
    drop(reader);
    let mut bytes = std::fs::read(&db).unwrap();
    let needle = &image[image.len() / 2..image.len() / 2 + 40];
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap();
    bytes[at] ^= 8;
    std::fs::write(&db, bytes).unwrap();
    let error = build(orthophoto(folder.path(), "b.png", (600, 600), (700, 100), 2, false)).unwrap_err();
    assert_eq!(error.code(), "damaged_store", "{error}");
    assert!(error.to_string().contains(&west.to_string()), "{error}");
}
