//! The resident R*-tree (rstar) against the store's own R-tree (SQLite), over 102,400 footprints of one level:
//! `cargo bench --bench candidates`. First prints the time to read the footprints and to build the index. Then measures the
//! region of the combined mode (`cargo bench --bench candidates -- combined`).

use criterion::{BenchmarkId, Criterion};
use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::geodesy::Geodetic;
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::tile::TileId;
use overfly_flight::locate::candidates::{CandidateQuery, ResidentIndex, SearchCost, candidates, rank};
use overfly_store::{BuiltTile, Declaration, EncodedTile, Reader, Source, Terms, TileContent, Writer};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

const EDGE: u32 = 320;
const ZOOM: u8 = 16;
const FIRST: (u32, u32) = (33_000, 22_000);

fn write(path: &Path) {
    let source = Source {
        content_hash: [1; 32],
        path: PathBuf::from("synthetic.tif"),
        acquired: Some("2018-07-16".into()),
        crs_epsg: None,
        stretch: None,
        horizontal_error_m: Some(1.0),
        gsd_m_per_px: 1.0,
        outline_deg: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
    };
    let declaration = Declaration {
        layer: "ortho".into(),
        sources: vec![source],
        zoom_override: None,
        base_zoom: ZOOM,
        min_zoom: ZOOM,
        terrain: None,
        terms: Terms::default(),
    };
    let mut writer = Writer::begin(path, CONTRACT, declaration).expect("a new store");
    for i in 0..EDGE * EDGE {
        let tile = TileId::new(ZOOM, FIRST.0 + i % EDGE, FIRST.1 + i / EDGE).expect("inside the matrix");
        let content = TileContent {
            image: EncodedTile { media_type: "image/jpeg", bytes: vec![0xff, 0xd8, 0xff], content_hash: [7; 32] },
            descriptors: None,
            cells: None,
            sources: "01".repeat(32),
            acquired: Some("2018-07-16".into()),
            valid_fraction: 1.0,
            horizontal_error_m: Some(1.0),
            valid_outline: None,
            keypoints: 500,
            distinctiveness: 0.4,
        };
        writer.put(&BuiltTile { tile, inputs_hash: [1; 32], content: Some(content) }).expect("room on the disk");
    }
    writer.finish(&|_| true).expect("room on the disk");
}

fn query(centre: Geodetic, drift_m: f64) -> CandidateQuery {
    CandidateQuery {
        centre,
        image: ImageOnGround { across_m: 600.0, along_m: 400.0, heading_rad: 0.7 },
        uncertainty: Uncertainty::Sequential { inaccuracy_m: 30.0, drift_m },
        layer: None,
        max_tiles: None,
        gsd_m_per_px: None,
    }
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("synthetic.gpkg");
    write(&path);
    let store = Reader::open_onboard(&path).expect("a finished store");
    let layer = store.layer("ortho").expect("its layer");
    let start = Instant::now();
    let footprints = store.footprints(layer, ZOOM).expect("its footprints");
    let read_ms = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let index = ResidentIndex::new(footprints);
    println!(
        "{} footprints: read in {read_ms:.0} ms, indexed in {:.0} ms",
        index.len(),
        start.elapsed().as_secs_f64() * 1e3
    );

    let mut criterion = Criterion::default().configure_from_args();
    let centre = TileId::new(ZOOM, FIRST.0 + EDGE / 2, FIRST.1 + EDGE / 2).expect("inside the matrix").centre();
    for drift_m in [100.0, 1_000.0, 10_000.0] {
        let query = query(centre, drift_m);
        let region = Region::new(query.centre, query.image, query.uncertainty).expect("a region");
        let bounds = region.mercator_bounds();
        let cost = SearchCost::new(layer, ZOOM, query.centre, query.image);
        let tiles = candidates(&store, &query).expect("an answer").tiles.len();
        let mut group = criterion.benchmark_group(format!("{tiles} tiles"));
        group.sample_size(20);
        group.bench_function(BenchmarkId::new("filter", "sqlite"), |b| {
            b.iter(|| black_box(store.footprints_in(layer, ZOOM, &bounds).expect("footprints").len()));
        });
        group.bench_function(BenchmarkId::new("filter", "rstar"), |b| {
            b.iter(|| black_box(index.footprints_in(&bounds).len()))
        });
        group.bench_function(BenchmarkId::new("answer", "sqlite"), |b| {
            b.iter(|| black_box(candidates(&store, &query).expect("an answer").containment));
        });
        group.bench_function(BenchmarkId::new("answer", "rstar"), |b| {
            b.iter(|| {
                let region = Region::new(query.centre, query.image, query.uncertainty).expect("a region");
                let met = index.footprints_in(&region.mercator_bounds());
                black_box(rank("ortho", met.into_iter(), &region, None, &cost).containment)
            });
        });
        group.finish();
    }
    // The outline of the combined mode, for turns of the flight of so many radians.
    let mut group = criterion.benchmark_group("combined region");
    group.sample_size(20);
    for turn in [0.3, 1.0, 3.0, 9.0, 100.0] {
        let (execution_s, min_turn_radius_m) = (turn * 500.0 / 50.0, 500.0);
        let uncertainty = Uncertainty::Combined { inaccuracy_m: 30.0, speed_mps: 50.0, execution_s, min_turn_radius_m };
        let question = query(centre, 0.0);
        group.bench_function(BenchmarkId::from_parameter(turn), |b| {
            b.iter(|| black_box(Region::new(question.centre, question.image, uncertainty).expect("a region")));
        });
    }
    group.finish();
    criterion.final_summary();
}
