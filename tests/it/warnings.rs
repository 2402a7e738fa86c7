//! What the program warns of before work that would be regretted, and its estimates of that work.

use super::needs::real_data;
use overfly_testkit::drawn::{drawn_store, project};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn overfly(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap()
}

fn summary(done: &Output) -> Value {
    let text = String::from_utf8_lossy(&done.stdout);
    serde_json::from_str(text.lines().last().unwrap_or_else(|| panic!("{done:?}"))).unwrap()
}

/// East across the drawn landscape and far beyond its edge.
fn route(folder: &Path) -> PathBuf {
    let path = folder.join("route.geojson");
    std::fs::write(&path, r#"{"type":"LineString","coordinates":[[15.600,48.4915],[15.660,48.4915]]}"#).unwrap();
    path
}

/// An export of the drawn store along [`route`].
fn export(folder: &Path, more: &[&str]) -> Output {
    route(folder);
    let db = drawn_store().path().display().to_string();
    let words = ["export", "--json", "--db", &db, "--route", "route.geojson", "--out", "out.gpkg"];
    overfly(folder, &[&words, more].concat())
}

#[test]
fn an_export_warns_first_of_what_the_flight_will_lack() {
    let folder = tempfile::tempdir().unwrap();
    let aircraft = project("docs/plan/aircraft.toml").display().to_string();
    for more in [&["--dry-run"][..], &[]] {
        let words = [&["--corridor-m", "0.3km", "--aircraft", &aircraft], more].concat();
        let done = export(folder.path(), &words);
        assert!(done.status.success(), "{done:?}");
        let log = String::from_utf8_lossy(&done.stderr);
        assert!(log.starts_with("WARNING: the route leaves the map"), "{log}");
        assert!(log.contains("WARNING: the corridor was widened from 300 m to up to "), "{log}");
        let codes: Vec<Value> =
            summary(&done)["warnings"].as_array().unwrap().iter().map(|w| w["code"].clone()).collect();
        assert_eq!(codes, ["route_leaves_map", "corridor_widened"]);
    }
}

#[test]
fn an_unfinished_layer_is_named_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("map.gpkg");
    std::fs::copy(drawn_store().path(), &db).unwrap();
    let request = overfly_ingest::build::Request {
        db,
        layer: "autumn".into(),
        sources: vec![project("tiles/epoch_2")],
        threads: 1,
        ..Default::default()
    };
    overfly_ingest::build::run(&request, &mut |_| std::ops::ControlFlow::Break(())).unwrap_err();
    route(folder.path());
    let words = ["export", "--db", "map.gpkg", "--route", "route.geojson", "--out", "out.gpkg", "--corridor-m", "300"];
    let done = overfly(folder.path(), &words);
    let log = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && log.starts_with("WARNING: layer autumn is unfinished and is left out"), "{log}");
}

#[test]
fn too_little_imagery_is_refused_with_the_share() {
    let folder = tempfile::tempdir().unwrap();
    let done = export(folder.path(), &["--corridor-m", "300", "--require-covered", "0.95"]);
    let said = summary(&done);
    assert_eq!((done.status.code(), said["error"].as_str()), (Some(2), Some("not_covered")));
    assert!(said["message"].as_str().unwrap().contains(" % of the corridor"), "{said}");
    assert!(!folder.path().join("out.gpkg").exists());
    let enough = export(folder.path(), &["--corridor-m", "300", "--require-covered", "0.2"]);
    assert!(enough.status.success() && folder.path().join("out.gpkg").exists(), "{enough:?}");
}

#[test]
fn a_zoom_far_beyond_the_imagery_is_warned_of_before_the_build() {
    let folder = tempfile::tempdir().unwrap();
    let source = project("tests/fixtures/degrees.tif").display().to_string();
    let plain = summary(&overfly(folder.path(), &["build", "--db", "s.gpkg", &source, "--dry-run", "--json"]));
    assert_eq!(plain["finer_by"], 0);
    let zoom = (plain["base_zoom"].as_u64().unwrap() + 2).to_string();
    for more in [&["--dry-run"][..], &[]] {
        let done = overfly(folder.path(), &[&["build", "--db", "s.gpkg", &source, "--zoom", &zoom], more].concat());
        let log = String::from_utf8_lossy(&done.stderr);
        assert!(log.contains("WARNING: the zoom is 2 levels finer than the imagery"), "{log}");
    }
}

#[test]
fn what_a_build_takes_away_or_moves_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let source = project("tests/fixtures/degrees.tif").display().to_string();
    let build = |more: &[&str]| {
        let done = overfly(folder.path(), &[&["build", "--db", "s.gpkg", &source, "--json"], more].concat());
        assert!(done.status.success(), "{done:?}");
        (summary(&done), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (first, log) = build(&["--layer", "y2018"]);
    assert!(!log.contains("WARNING") && log.contains("the source has no date and counts as oldest"), "{log}");
    // The name of the layer is forgotten.
    for more in [&["--dry-run"][..], &[]] {
        let (_, log) = build(more);
        assert!(log.contains("s.gpkg has other layers (y2018), and this build makes one more, ortho"), "{log}");
    }
    assert!(!build(&[]).1.contains("WARNING"), "the layer is there now");
    assert!(!build(&["--layer", "y2020"]).1.contains("WARNING"), "the layer is named");
    // A coarser zoom removes what is finer.
    let zoom = (first["base_zoom"].as_u64().unwrap() - 1).to_string();
    for more in [&["--dry-run"][..], &[]] {
        let (_, log) = build(&[&["--layer", "y2018", "--zoom", &zoom], more].concat());
        assert!(
            log.contains("WARNING: the zoom is coarser than the layer has been: the build removes its finest"),
            "{log}"
        );
    }
    // Another CRS moves the imagery.
    let utm = project("tests/fixtures/south_utm.tif").display().to_string();
    for more in [&["--dry-run", "--json"][..], &["--json"]] {
        let words = [&["build", "--db", "moved.gpkg", &utm, "--crs", "32733"], more].concat();
        let done = overfly(folder.path(), &words);
        let log = String::from_utf8_lossy(&done.stderr);
        assert!(log.contains("note: --crs EPSG:32733") && log.contains("overrides what "), "{log}");
        assert_eq!(summary(&done)["overridden_crs"].as_array().unwrap().len(), 1);
    }
}

#[test]
fn an_unfinished_build_is_found_under_its_layer() {
    let folder = tempfile::tempdir().unwrap();
    let request = overfly_ingest::build::Request {
        db: folder.path().join("map.gpkg"),
        layer: "autumn".into(),
        sources: vec![project("tiles/epoch_2")],
        threads: 1,
        ..Default::default()
    };
    overfly_ingest::build::run(&request, &mut |_| std::ops::ControlFlow::Break(())).unwrap_err();
    let done = overfly(folder.path(), &["build", "--db", "map.gpkg", "--layer", "other"]);
    let log = String::from_utf8_lossy(&done.stderr);
    assert!(log.contains("layer other has no unfinished build to resume (layer autumn has one)"), "{log}");
}

/// Estimates a build and an export, makes both, and compares the sizes.
fn estimates_hold(folder: &Path, source: &str, line: &str) {
    let build = ["build", "--json", "--db", "map.gpkg", source];
    std::fs::write(folder.join("line.geojson"), line).unwrap();
    let export = [
        "export",
        "--json",
        "--db",
        "map.gpkg",
        "--route",
        "line.geojson",
        "--corridor-m",
        "400m",
        "--out",
        "flight.gpkg",
    ];
    for words in [&build[..], &export[..]] {
        let estimated = summary(&overfly(folder, &[words, &["--dry-run"]].concat()));
        let made = summary(&overfly(folder, words));
        let bytes = |value: &Value, key: &str| value[key].as_f64().unwrap_or_else(|| panic!("{value}"));
        let ratio = bytes(&estimated, "estimated_bytes") / bytes(&made, "bytes");
        assert!((0.8..1.2).contains(&ratio), "{words:?}: {ratio}");
    }
}

#[test]
fn dry_runs_estimate_the_drawn_tiles_within_a_fifth() {
    let folder = tempfile::tempdir().unwrap();
    let line = r#"{"type":"LineString","coordinates":[[15.6053,48.4961],[15.6120,48.4961]]}"#;
    estimates_hold(folder.path(), &project("tiles/epoch_1").display().to_string(), line);
}

#[test]
#[ignore = "needs naip"]
fn needs_naip_dry_runs_estimate_real_imagery_within_a_fifth() {
    let folder = tempfile::tempdir().unwrap();
    let source = real_data("naip/m_4709963_se_14_1_20160816.tif").display().to_string();
    let line = r#"{"type":"LineString","coordinates":[[-99.18,47.02],[-99.14,47.02]]}"#;
    estimates_hold(folder.path(), &source, line);
}

#[test]
fn ctrl_c_says_how_to_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let source = project("tiles/epoch_1").display().to_string();
    // Far too fine, so that the build lasts until the signal.
    let words = ["build", "--db", "s.gpkg", &source, "--zoom", "20", "--threads", "1"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    let mut child =
        command.current_dir(folder.path()).args(words).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let mut log = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    // The warning comes after the first tile.
    while !said.contains("WARNING") {
        assert!(std::io::BufRead::read_line(&mut log, &mut said).unwrap() > 0, "{said}");
    }
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
    std::io::Read::read_to_string(&mut log, &mut said).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{said}");
    assert!(said.contains("run the same build again to resume it"), "{said}");
}

#[test]
fn a_build_says_that_it_waits_for_another_and_stops_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let source = project("tests/fixtures/degrees.tif").display().to_string();
    assert!(overfly(folder.path(), &["build", "--db", "s.gpkg", &source]).status.success());
    let other = rusqlite::Connection::open(folder.path().join("s.gpkg")).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let words = ["build", "--db", "s.gpkg", &source, "--layer", "second"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    let mut child =
        command.current_dir(folder.path()).args(words).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let mut log = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    while !said.contains("waiting for another build of s.gpkg") {
        assert!(std::io::BufRead::read_line(&mut log, &mut said).unwrap() > 0, "{said}");
    }
    let start = std::time::Instant::now();
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    std::io::Read::read_to_string(&mut log, &mut said).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{said}");
    assert!(start.elapsed().as_secs_f64() < 5.0 && said.contains("run the same build again to resume it"), "{said}");
    other.execute_batch("ROLLBACK").unwrap();
    assert!(overfly(folder.path(), &words).status.success());
}
