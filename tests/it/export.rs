//! An export holds what a flight needs and nothing else changes: answers, bytes, rules.

use super::gdal::opens_and_validates;
use super::needs::real_data;
use overfly_core::geodesy::{Geodesic, Geodetic, LocalFrame, MercatorPoint, destination};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::Route;
use overfly_core::tile::TileId;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, Reason, locate};
use overfly_ingest::build::{self, Request};
use overfly_ingest::export::ExportError;
use overfly_ingest::export::{ExportRequest, Exported, export};
use overfly_ingest::plan::parse_routes;
use overfly_lab::trial::{RecordedFlight, RecordedFrame};
use overfly_store::Reader;
use overfly_store::package::{VerifyOptions, verify_package};
use overfly_testkit::drawn::{drawn_store, project};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Straight east across the drawn landscape, over the first row of its flight.
pub fn route(from_deg: [f64; 2], to_deg: [f64; 2]) -> Vec<Route> {
    let line = serde_json::json!({"type": "LineString", "coordinates": [from_deg, to_deg]});
    parse_routes(&line.to_string()).unwrap()
}

pub fn request(routes: Vec<Route>, corridor_m: f64) -> ExportRequest {
    ExportRequest::along(routes, corridor_m)
}

/// The first row of the drawn flight, 300 m on each side.
pub fn drawn_request() -> ExportRequest {
    request(route([15.6053, 48.4961], [15.6120, 48.4961]), 300.0)
}

pub fn export_to(store: &Reader, request: &ExportRequest, out: &Path) -> Exported {
    export(store, request, out, &|_, _| ()).unwrap()
}

fn names(folder: &Path) -> Vec<std::ffi::OsString> {
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    names
}

/// Least distance of a grid of points of a tile, edges included, from points along a route, metres; in the plane at the tile.
fn distance_m(tile: TileId, route: &[Geodetic]) -> f64 {
    let b = tile.mercator_bounds();
    let frame = LocalFrame::at(tile.centre());
    let route: Vec<_> = route.iter().map(|p| frame.enu_from_geodetic(*p)).collect();
    let mut least = f64::INFINITY;
    for i in 0..=64 {
        for j in 0..=64 {
            let x_m = b.min_x_m + (b.max_x_m - b.min_x_m) * f64::from(i) / 64.0;
            let y_m = b.min_y_m + (b.max_y_m - b.min_y_m) * f64::from(j) / 64.0;
            let p = frame.enu_from_geodetic(MercatorPoint { x_m, y_m }.to_geodetic().unwrap());
            for r in &route {
                least = least.min((p.east_m - r.east_m).hypot(p.north_m - r.north_m));
            }
        }
    }
    least
}

#[test]
fn takes_every_tile_that_brute_force_says_and_none_far_off() {
    let store = drawn_store();
    let layer = store.layer("ortho").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut left_out = 0;
    for (index, (from, azimuth_rad, length_m, corridor_m)) in [
        ([15.6053, 48.4961], 1.57, 500.0, 60.0),
        ([15.615, 48.489], 0.6, 700.0, 150.0),
        ([15.60, 48.484], 2.9, 90.0, 20.0),
    ]
    .into_iter()
    .enumerate()
    {
        let start = Geodetic::from_degrees(from[1], from[0]).unwrap();
        let end = destination(start, Geodesic { distance_m: length_m, azimuth_rad }).unwrap();
        let routes = route(from, [end.longitude_deg(), end.latitude_deg()]);
        let along: Vec<_> = routes[0].every(2.0).unwrap().iter().map(|p| p.position).collect();
        let out = folder.path().join(format!("{index}.gpkg"));
        export_to(store, &request(routes, corridor_m), &out);
        let cut = Reader::open(&out).unwrap();
        let taken = cut.layer("ortho").unwrap();
        let mut near = Vec::new();
        for zoom in layer.min_zoom..=layer.base_zoom {
            for footprint in store.footprints(layer, zoom).unwrap() {
                let tile = footprint.tile;
                let (found, away_m) = (cut.stored_tile(taken, tile).unwrap(), distance_m(tile, &along));
                let gsd_m_per_px = tile.gsd().mean_m_per_px();
                // 40 px are read past the corridor, and the tiles around; a rectangle's corner lies sqrt(2) as far.
                let far_m = 1.42 * (corridor_m + 50.0 * gsd_m_per_px + 512.0 * gsd_m_per_px) + 10.0;
                if away_m <= corridor_m + 39.9 * gsd_m_per_px || zoom == layer.min_zoom {
                    assert!(found.is_some(), "{tile} is {away_m:.1} m off and missing");
                    near.push(tile);
                } else if away_m > far_m {
                    assert!(found.is_none(), "{tile} is {away_m:.1} m off");
                }
                left_out += usize::from(found.is_none());
                if found.is_some() {
                    assert_eq!(found, store.stored_tile(layer, tile).unwrap());
                }
            }
        }
        for tile in &near {
            for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let [column, row] = [tile.column() as i32 + dx, tile.row() as i32 + dy].map(|v| v as u32);
                let beside = TileId::new(tile.zoom(), column, row).unwrap();
                let (there, here) = (store.footprint(layer, beside).unwrap(), cut.footprint(taken, beside).unwrap());
                assert_eq!(there.is_some(), here.is_some(), "{beside}, beside {tile}");
            }
        }
        let options = VerifyOptions { key: None, today: overfly_testkit::injury::a_day(), every_tile: true };
        let verified = verify_package(&out, &options, &|_, _| ()).unwrap();
        assert!(verified.store.ok && verified.sealed && verified.tile_by_tile, "{verified:?}");
    }
    assert!(left_out > 10, "{left_out} tiles left out");
}

#[test]
fn the_same_request_gives_the_same_bytes_whatever_the_routes_format() {
    let folder = tempfile::tempdir().unwrap();
    let gpx = "<gpx><rte><rtept lat='48.4961' lon='15.6053'/><rtept lat='48.4961' lon='15.6120'/></rte></gpx>";
    let kml = "<kml><LineString><coordinates>15.6053,48.4961 15.6120,48.4961</coordinates></LineString></kml>";
    let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
    export_to(drawn_store(), &drawn_request(), &a);
    // Over an older export, which goes away only when the new one is whole.
    export_to(drawn_store(), &request(parse_routes(gpx).unwrap(), 500.0), &b);
    for (text, out) in [(gpx, &b), (kml, &c)] {
        export_to(drawn_store(), &request(parse_routes(text).unwrap(), 300.0), out);
        assert!(std::fs::read(&a).unwrap() == std::fs::read(out).unwrap());
    }
    assert_eq!(names(folder.path()), ["a", "b", "c"], "nothing is left beside");
    let cut = Reader::open(&a).unwrap();
    assert!(cut.sources(cut.layer("ortho").unwrap()).unwrap().iter().all(|s| s.path.components().count() == 1));
}

/// The frames of the drawn flight with their truth and sensors.
fn frames() -> Vec<(PathBuf, Geodetic, FixRequest)> {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let asked = |frame: &RecordedFrame| {
        let truth = frame.true_position.unwrap();
        let request = FixRequest {
            layer: "ortho".into(),
            position: PositionPrior::Square { centre: truth, half_width_m: 40.0 },
            heading: Some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: 3f64.to_radians() }),
            view: frame.view(&flight.camera),
            scale_sigma_ratio: 0.03,
            time_s: None,
        };
        (frame.path.clone(), truth, request)
    };
    flight.frames.iter().map(asked).collect()
}

/// An answer as if it were from the store of another one: only an extract's digest differs.
fn with_map_of(other: &Answer, answer: Answer) -> Answer {
    let mut answer = answer;
    match &mut answer {
        Answer::Fix(fix) => fix.map.store_digest.clone_from(&other.map().store_digest),
        Answer::NoFix(none) => none.map.store_digest.clone_from(&other.map().store_digest),
    }
    answer
}

#[test]
fn searches_inside_the_corridor_answer_as_over_the_full_store_and_outside_say_so() {
    let full = drawn_store();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    let routes = route([15.6045, 48.49615], [15.6155, 48.49615]);
    let along: Vec<_> = routes[0].every(5.0).unwrap().iter().map(|p| p.position).collect();
    // Half an image's diagonal (270 m), the prior's corner (57 m), a third of its edge (116 m), and 10 m off the route.
    let corridor_m = 455.0;
    export_to(full, &request(routes, corridor_m), &out);
    let cut = overfly_store::package::open_onboard(&out, None, &[], overfly_testkit::injury::a_day()).unwrap().store;
    let (mut inside, mut outside) = (0, 0);
    for (path, truth, request) in frames() {
        let near = LocalFrame::at(truth);
        let off_m = along.iter().map(|p| near.enu_from_geodetic(*p).length_m()).fold(f64::INFINITY, f64::min);
        let frame = read_frame(&path).unwrap();
        let answer = locate(&cut, &frame, &request, 2).unwrap();
        if off_m <= 12.0 {
            let expected = with_map_of(&answer, locate(full, &frame, &request, 2).unwrap());
            assert_eq!(answer, expected, "{}", path.display());
            inside += 1;
        } else if let Answer::NoFix(none) = &answer
            && none.reason == Reason::OutsideMap
        {
            let said = none.detail.contains("outside the layer") || none.detail.contains("no tile");
            assert!(said, "{}", none.detail);
            outside += 1;
        }
        if let Answer::Fix(fix) = &answer {
            assert!(near.enu_from_geodetic(fix.position).length_m() < 5.0, "{}: a wrong fix", path.display());
        }
    }
    assert!(inside >= 5 && outside >= 3, "{inside} inside, {outside} outside");
}

fn overfly(args: &[&str]) {
    let done = Command::new(env!("CARGO_BIN_EXE_overfly")).args(args).output().unwrap();
    assert!(done.status.success(), "{args:?}: {}", String::from_utf8_lossy(&done.stderr));
}

/// The rows of `evaluate fixes` over a store, but for the time they took.
fn scored(db: &Path, flight: &Path, results: &Path) -> Vec<Vec<String>> {
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (db, flight, out) = (text(db), text(flight), text(results));
    let fixes = ["evaluate", "fixes", "--db", &db, "--flight", &flight, "--attitude-sigma-deg", "0"];
    overfly(&[&fixes[..], &["--prior-error-m", "100", "--out", &out]].concat());
    let mut csv = csv::Reader::from_path(results.join("fixes.csv")).unwrap();
    let elapsed = csv.headers().unwrap().iter().position(|h| h == "elapsed_ms").unwrap();
    let row = |r: csv::StringRecord| {
        r.iter().enumerate().filter(|(i, _)| *i != elapsed).map(|(_, v)| v.to_owned()).collect::<Vec<_>>()
    };
    csv.records().map(|r| row(r.unwrap())).collect()
}

/// How far each frame of a flight lies from a route, metres.
fn off_route_m(flight: &Path, route: &Route) -> Vec<f64> {
    let along: Vec<_> = route.every(10.0).unwrap().iter().map(|p| p.position).collect();
    let mut truths = csv::Reader::from_path(flight.join("flight.csv")).unwrap();
    let off_m = |row: csv::StringRecord| {
        let truth = Geodetic::from_degrees(row[2].parse().unwrap(), row[3].parse().unwrap()).unwrap();
        let near = LocalFrame::at(truth);
        along.iter().map(|p| near.enu_from_geodetic(*p).length_m()).fold(f64::INFINITY, f64::min)
    };
    truths.records().map(|row| off_m(row.unwrap())).collect()
}

/// The imagery of North Dakota of 2018, and a flight over it.
#[test]
#[ignore = "needs naip"]
fn needs_naip_along_three_kilometres_answers_as_the_full_store() {
    let source = real_data("naip/m_4709963_se_14_1_20180716.tif");
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (db, out, line) = (at("n18.gpkg"), at("cut.gpkg"), at("route.geojson"));
    let request = Request {
        db: db.clone(),
        layer: "ortho".into(),
        sources: vec![source],
        zoom: Some(16),
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    let ends = [[-99.1830, 47.0163], [-99.1435, 47.0163]];
    std::fs::write(&line, serde_json::json!({"type": "LineString", "coordinates": ends}).to_string()).unwrap();
    let [from, to, along] = [&db, &out, &line].map(|path| path.to_str().unwrap());
    overfly(&["export", "--db", from, "--route", along, "--corridor-m", "1500", "--out", to]);
    let flight = real_data("naip/flight_2018");
    let (full, cut) = (scored(&db, &flight, &at("full")), scored(&out, &flight, &at("cut")));
    let off_m = off_route_m(&flight, &route(ends[0], ends[1])[0]);
    assert_eq!((full.len(), cut.len()), (off_m.len(), off_m.len()));
    let mut inside = 0;
    for (off_m, (a, b)) in off_m.into_iter().zip(full.iter().zip(&cut)) {
        // The prior lies up to 100 m off per axis, its square reaches as far again; half of 256 x 192 px of 5 m.
        if off_m + 200.0 * std::f64::consts::SQRT_2 + 2.5 * 320.0 <= 1500.0 + 64.0 * 1.6 {
            assert_eq!(a, b);
            inside += 1;
        }
    }
    eprintln!("{inside} frames inside, the same answers");
    assert!(inside >= 10, "{inside}");
}

#[test]
fn no_search_of_an_aircraft_that_drifts_along_the_route_reaches_beyond() {
    let store = drawn_store();
    let layer = store.layer("ortho").unwrap();
    let aircraft: overfly_ingest::plan::Aircraft = toml::from_str(
        "speed_mps = 30\nmin_turn_radius_m = 400\nwidth_px = 200\nheight_px = 150\ngsd_m_per_px = 1\nunit_drift_m = 0.02\ninaccuracy_m = 10\n",
    )
    .unwrap();
    let parameters = aircraft.parameters(&overfly_core::coupling::Calibration::PROJECT, None).unwrap();
    let drift = overfly_ingest::export::CorridorDrift(parameters);
    let routes = route([15.6010, 48.4961], [15.6080, 48.4965]);
    let points = routes[0].every(25.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    export_to(store, &ExportRequest { drift: Some(drift), ..request(routes, 30.0) }, &out);
    let cut = Reader::open(&out).unwrap();
    let taken = cut.layer("ortho").unwrap();
    let (mut searched, mut widest_m) = (0, 0.0f64);
    for point in points {
        // As equations 2 and 3 have it, without a fix since the start, and 30 m beside the route.
        let count = point.way_m / parameters.speed_mps / parameters.relative_s;
        let drift_m = parameters.drift_growth.drift_m(count, parameters.unit_drift_m).unwrap();
        widest_m = widest_m.max(drift_m);
        for side in [0.5, -0.5] {
            let off = Geodesic { distance_m: 29.0, azimuth_rad: point.heading.radians() + side * std::f64::consts::PI };
            let centre = destination(point.position, off).unwrap();
            let (across_m, along_m) = (parameters.across_m, parameters.along_m);
            let image = ImageOnGround { across_m, along_m, heading_rad: point.heading.radians() + side };
            let known = Uncertainty::Sequential { inaccuracy_m: parameters.inaccuracy_m, drift_m };
            let region = Region::new(centre, image, known).unwrap();
            for footprint in store.footprints(layer, layer.base_zoom).unwrap() {
                if region.meets(&footprint.tile.mercator_bounds()) {
                    searched += 1;
                    assert!(cut.footprint(taken, footprint.tile).unwrap().is_some(), "{}", footprint.tile);
                }
            }
        }
    }
    assert!(searched > 100 && widest_m > 5.0, "{searched} {widest_m}");
}

#[test]
fn drops_in_the_stated_order_and_refuses_what_cannot_be_made_so_small() {
    let store = drawn_store();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    let whole = export_to(store, &drawn_request(), &out);
    assert!(whole.dropped.is_empty());
    let with = |max_bytes: u64| ExportRequest { max_bytes: Some(max_bytes), ..drawn_request() };
    let smaller = export_to(store, &with(whole.bytes - 1), &out);
    assert_eq!(smaller.dropped.iter().map(|d| d.what.as_str()).collect::<Vec<_>>(), ["keypoint descriptors"]);
    assert!(smaller.bytes < whole.bytes && smaller.bytes == std::fs::metadata(&out).unwrap().len());
    let rough = export_to(store, &ExportRequest { jpeg_quality: Some(40), ..drawn_request() }, &out);
    let imagery = |e: &Exported| e.parts.iter().map(|p| p.bytes.imagery).sum::<u64>();
    assert!(imagery(&rough) < imagery(&whole) && rough.dropped[0].what.contains("JPEG 40"), "{rough:?}");
    assert!(Reader::open(&out).unwrap().manifest().unwrap().contains("JPEG 40 instead of 90, as asked"));
    let options = VerifyOptions { key: None, today: overfly_testkit::injury::a_day(), every_tile: true };
    assert!(verify_package(&out, &options, &|_, _| ()).unwrap().store.ok);
    let coarser = export_to(store, &with(smaller.bytes - 1), &out);
    assert!(coarser.dropped[1].what.starts_with("level 1") && coarser.dropped[1].effect.contains("pixels are"));
    let cut = Reader::open(&out).unwrap();
    assert_eq!(cut.layer("ortho").unwrap().base_zoom + 1, store.layer("ortho").unwrap().base_zoom);
    assert!(cut.manifest().unwrap().contains("keypoint descriptors"));
    let before = std::fs::read(&out).unwrap();
    let refused = export(store, &with(20_000), &out, &|_, _| ()).unwrap_err();
    assert_eq!((refused.code(), refused.is_unusable_input()), ("too_large", true));
    assert!(std::fs::read(&out).unwrap() == before && names(folder.path()) == ["cut.gpkg"], "untouched");
}

#[test]
fn refuses_what_cannot_be_exported() {
    let store = drawn_store();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    let refusal = |request: ExportRequest, out: &Path| export(store, &request, out, &|_, _| ()).unwrap_err();
    let elsewhere = request(route([0.0, 0.0], [0.1, 0.0]), 300.0);
    assert_eq!(refusal(elsewhere, &out).code(), "no_tile_in_corridor");
    assert_eq!(refusal(ExportRequest { layers: vec!["y".into()], ..drawn_request() }, &out).code(), "no_such_layer");
    assert_eq!(refusal(drawn_request(), store.path()).code(), "same_file");
    assert_eq!(refusal(drawn_request(), &folder.path().join("no/cut.gpkg")).code(), "no_such_folder");
    assert_eq!(refusal(request(route([0.0, 86.0], [0.1, 86.0]), 300.0), &out).code(), "position_out_of_range");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_damaged_tile_is_never_exported() {
    let folder = tempfile::tempdir().unwrap();
    let (db, out) = (folder.path().join("s.gpkg"), folder.path().join("cut.gpkg"));
    std::fs::copy(drawn_store().path(), &db).unwrap();
    let connection = rusqlite::Connection::open(&db).unwrap();
    connection.execute("UPDATE ortho SET tile_data = substr(tile_data, 1, length(tile_data) - 1)", []).unwrap();
    drop(connection);
    let refused = export(&Reader::open(&db).unwrap(), &drawn_request(), &out, &|_, _| ()).unwrap_err();
    assert!(matches!(&refused, ExportError::Store(e) if e.code() == "damaged_store"), "{refused}");
    assert_eq!(names(folder.path()), ["s.gpkg"]);
}

#[test]
fn nothing_is_built_into_an_exported_store() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    export_to(drawn_store(), &drawn_request(), &out);
    let before = std::fs::read(&out).unwrap();
    let request = Request {
        db: out.clone(),
        layer: "ortho".into(),
        sources: vec![project("tiles/epoch_1")],
        threads: 1,
        ..Request::default()
    };
    let refused = build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(refused.to_string().contains("exported store"), "{refused}");
    assert!(std::fs::read(&out).unwrap() == before);
}

#[test]
fn a_dry_run_prints_bytes_and_coverage_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    let line = folder.path().join("route.geojson");
    std::fs::write(&line, r#"{"type":"LineString","coordinates":[[15.6053,48.4961],[15.6120,48.4961]]}"#).unwrap();
    let run = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
        command.args(["export", "--json", "--corridor-m", "300", "--db"]).arg(drawn_store().path());
        let done = command.arg("--route").arg(&line).arg("--out").arg(&out).args(more).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let text = String::from_utf8(done.stdout).unwrap();
        let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        lines
    };
    let dry = run(&["--dry-run"]);
    assert_eq!(names(folder.path()), ["route.geojson"]);
    let summary = dry.last().unwrap();
    assert_eq!((summary["dry_run"].as_bool(), summary["widest_m"].as_f64()), (Some(true), Some(300.0)));
    assert!(dry.len() >= 3 && dry[0]["covered"].as_f64().unwrap() > 0.3, "{}", dry[0]);
    let wet = run(&[]);
    assert_eq!(wet.last().unwrap()["parts"], summary["parts"]);
    let (stated, real) = (summary["bytes"].as_u64().unwrap(), wet.last().unwrap()["bytes"].as_u64().unwrap());
    let tiles: u64 = summary["parts"].as_array().unwrap().iter().map(|p| p["tiles"].as_u64().unwrap()).sum();
    // Pages are filled in part; footprints, indexes and GeoPackage tables take half a megabyte in all.
    assert!(real > stated && real < stated + 800_000 + 16_384 * tiles, "{stated} {real}");
    // Grown by an aircraft's drift it takes no less.
    let grown = run(&["--dry-run", "--aircraft", project("docs/plan/aircraft.toml").to_str().unwrap()]);
    assert!(grown.last().unwrap()["widest_m"].as_f64().unwrap() > 600.0, "{}", grown.last().unwrap());
}

#[test]
#[ignore = "needs gdal"]
fn needs_gdal_gdal_opens_an_export_and_its_validator_finds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cut.gpkg");
    export_to(drawn_store(), &drawn_request(), &out);
    opens_and_validates(&out);
}

#[test]
fn no_injury_is_missed_and_no_answer_is_wrong_after_one() {
    let folder = tempfile::tempdir().unwrap();
    let (out, copy) = (folder.path().join("cut.gpkg"), folder.path().join("injured.gpkg"));
    export_to(drawn_store(), &drawn_request(), &out);
    let sound = overfly_testkit::injury::SoundStore::read(&out);
    let injuries = sound.injuries(240, 30, 30, 7);
    let (path, truth, asked) = frames().swap_remove(2);
    let frame = read_frame(&path).unwrap();
    let (mut count, mut fixes) = (0, 0);
    let tally = sound.endure(&copy, &injuries, |path, tally| {
        count += 1;
        let Ok(onboard) = overfly_store::package::open_onboard(path, None, &[], overfly_testkit::injury::a_day())
        else {
            return;
        };
        // A fix over what is left is the right one, or there is none.
        if let (0, Ok(Answer::Fix(fix))) = (count % 5, locate(&onboard.store, &frame, &asked, 2)) {
            fixes += 1;
            if LocalFrame::at(truth).enu_from_geodetic(fix.position).length_m() > 5.0 {
                tally.failures.push(format!("a wrong fix: {fix:?}"));
            }
        }
    });
    eprintln!("{tally:?}, {fixes} fixes");
    assert!(fixes > 20, "{fixes} fixes");
    assert!(tally.failures.is_empty(), "{:#?}", tally.failures);
    assert!(tally.injuries >= 290 && tally.degraded > 20 && tally.refused_onboard > 20, "{tally:?}");
}
