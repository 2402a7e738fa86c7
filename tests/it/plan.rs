//! `overfly plan`: the models' numbers for an aircraft, and where along a route fixes can be had; and what it refuses.

use overfly_testkit::drawn::drawn_store;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const AIRCRAFT: &str =
    "speed_mps = 27.8\nmin_turn_radius_m = 200\nwidth_px = 256\nheight_px = 192\ngsd_m_per_px = 1.25\n";

fn overfly(folder: &Path, words: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// A line through the middle of the drawn store's layer, from far west of it to its middle.
fn route() -> (String, [f64; 4]) {
    let [west, south, east, north] = <[f64; 4]>::from(drawn_store().layer("ortho").unwrap().bounds_deg);
    let (latitude, middle) = ((south + north) / 2.0, (west + east) / 2.0);
    let start = west - 2.0 * (east - west);
    let text = format!(r#"{{"type":"LineString","coordinates":[[{start},{latitude}],[{middle},{latitude}]]}}"#);
    (text, [west, south, east, north])
}

#[test]
fn says_what_equations_7_and_20_say_of_an_aircraft() {
    let folder = folder_with(&[("a.toml", &format!("{AIRCRAFT}inaccuracy_m = 8\nunit_drift_m = 0.5\n"))]);
    let (exit, said, log) = overfly(folder.path(), &["plan", "--aircraft", "a.toml", "--json", "--out", "planned"]);
    assert_eq!(exit, Some(0), "{log}");
    let plan: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let number = |pointer: &str| plan.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer}"));
    let p = |name: &str| number(&format!("/parameters/{name}"));
    assert_eq!((p("across_m"), p("along_m")), (320.0, 240.0));
    // (7) with the constant, and the parallel fixed point as a root of (19), from the printed parameters alone.
    let area = 328.0 * 248.0 / (320.0 * 240.0);
    let v_max = 240.0 / (p("search_constant_s") + p("seconds_per_tile") * area);
    assert!((number("/sequential/max_speed_mps") / v_max - 1.0).abs() < 1e-9);
    let t1 = number("/parallel/stable_s");
    let edge = 8.0 + 2.0 * 0.5 * t1 / p("relative_s");
    let next = p("search_constant_s") + p("seconds_per_tile") * (320.0 + edge) * (240.0 + edge) / (320.0 * 240.0);
    assert!((next - t1).abs() < 1e-9);
    // Half a metre each 33 ms drifts 15 m/s to every side, the aircraft flies ahead alone: combined searches less.
    assert_eq!(plan["advice"]["mode"], "combined");
    assert_eq!(plan["sensitivity"].as_array().unwrap().len(), 25);
    for name in ["speed.svg", "mission.svg", "settling.svg", "plan.html"] {
        let text = std::fs::read_to_string(folder.path().join("planned").join(name)).unwrap();
        assert!(text.contains("<svg") && !text.contains("NaN") && !text.contains("inf,"), "{name}");
    }
}

#[test]
fn a_route_that_begins_outside_the_map_has_its_gap_there() {
    let (line, [west, ..]) = route();
    let folder = folder_with(&[("a.toml", AIRCRAFT), ("r.geojson", &line)]);
    let db = drawn_store().path().display().to_string();
    let words = ["plan", "--aircraft", "a.toml", "--db", &db, "--route", "r.geojson", "--out", "planned", "--json"];
    let (exit, said, log) = overfly(folder.path(), &words);
    assert_eq!(exit, Some(0), "{log}");
    let lines: Vec<Value> = said.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let (summary, steps) = lines.split_last().unwrap();
    for step in steps {
        let (longitude, covered) = (step["longitude_deg"].as_f64().unwrap(), step["covered"].as_f64().unwrap());
        // The layer's bounds are those of its tiles. Half an image (0.0017 degrees) before them nothing is seen, and half an
        // image beyond the outermost tile (0.0055 degrees), which the imagery need not fill, everything.
        assert!(longitude > west - 0.003 || (covered == 0.0 && step["fix_expected"] == false), "{step}");
        assert!(longitude < west + 0.008 || covered > 0.9, "{step}");
    }
    let verdict = summary["verdict"].as_str().unwrap();
    assert!(verdict.starts_with("the map shows only 23 % of the route: check"), "{verdict}");
    assert!(verdict.contains("; fixes on ") && verdict.contains("none from km 0.0 to "), "{verdict}");
    // The mode is one that holds through the gap.
    let holds = |mode: &str| summary["route"]["longest_gap"][format!("{mode}_holds")] != false;
    assert!(holds(summary["advice"]["mode"].as_str().unwrap()), "{}", summary["advice"]);
    let route = &summary["route"];
    let gap = &route["longest_gap"];
    assert_eq!(gap["from_m"], 0.0);
    // The gap ends where the map begins: two widths of the map away, to a tile (405 m) and an image and a half.
    let begins_m = route["length_m"].as_f64().unwrap() * 2.0 / 2.5;
    assert!((gap["to_m"].as_f64().unwrap() - begins_m).abs() < 405.0 + 360.0, "{gap}");
    let duration_s = gap["duration_s"].as_f64().unwrap();
    assert!((gap["to_m"].as_f64().unwrap() / 27.8 - duration_s).abs() < 1e-6);
    let csv = std::fs::read_to_string(folder.path().join("planned/route.csv")).unwrap();
    assert_eq!(csv.lines().count(), steps.len() + 1);
    let points: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("planned/route.geojson")).unwrap()).unwrap();
    assert_eq!(points["features"].as_array().unwrap().len(), steps.len());
    let page = std::fs::read_to_string(folder.path().join("planned/plan.html")).unwrap();
    assert!(
        page.contains("<h1>Plan</h1><p>the map shows only ") && page.contains("<polyline class=\"track\""),
        "{page}"
    );
    assert!(page.contains("a fix is expected") && page.contains("data:image/jpeg") && !page.contains("src=\"http"));
}

#[test]
fn a_route_wholly_outside_the_map_is_told_by_the_exit_code() {
    let line = r#"{"type":"LineString","coordinates":[[-70,10],[-70,10.01]]}"#;
    let folder = folder_with(&[("a.toml", AIRCRAFT), ("r.geojson", line)]);
    let db = drawn_store().path().display().to_string();
    let words = ["plan", "--aircraft", "a.toml", "--db", &db, "--route", "r.geojson"];
    let (exit, said, log) = overfly(folder.path(), &words);
    assert_eq!(exit, Some(1), "{log}");
    assert!(
        !said.contains("use        parallel") && said.contains("use        none: the map does not show the route"),
        "{said}"
    );
    assert!(said.starts_with("verdict    no fix anywhere") && said.contains("map in 0.0 %"), "{said}");
}

#[test]
fn what_is_no_aircraft_calibration_or_route_is_refused_by_file_and_field() {
    let db = drawn_store().path().display().to_string();
    let empty = r#"{"type":"LineString","coordinates":[]}"#;
    let folder = folder_with(&[
        ("a.toml", AIRCRAFT),
        ("nan.toml", &AIRCRAFT.replace("27.8", "nan")),
        ("more.toml", &format!("{AIRCRAFT}speed_kmh = 100\n")),
        ("few.toml", "speed_mps = 30\n"),
        ("empty.geojson", empty),
    ]);
    let cases: [(&[&str], &str, &str); 7] = [
        (&["--aircraft", "none.toml"], "unreadable", "none.toml"),
        (&["--aircraft", "nan.toml"], "not_an_aircraft", "speed_mps"),
        (&["--aircraft", "more.toml"], "not_an_aircraft", "speed_kmh"),
        (&["--aircraft", "few.toml"], "not_an_aircraft", "min_turn_radius_m"),
        (&["--aircraft", "a.toml", "--calibration", "a.toml"], "not_a_calibration", "a.toml"),
        (&["--aircraft", "a.toml", "--db", &db, "--route", "empty.geojson"], "not_a_route", "empty.geojson"),
        (&["--aircraft", "a.toml", "--route", "empty.geojson"], "usage", "--db"),
    ];
    for (words, code, named) in cases {
        let (exit, _, said) = overfly(folder.path(), &[&["plan"], words].concat());
        assert_eq!(exit, Some(2), "{words:?}: {said}");
        assert!(said.contains(&format!("error[{code}]")) && said.contains(named), "{words:?}: {said}");
    }
}
