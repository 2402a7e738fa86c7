//! `overfly demo` does what the README's first command promises.

use serde_json::Value;
use std::time::Instant;

/// Of 40 frames: fewer is a step backwards.
const AT_LEAST_RIGHT: u64 = 38;

#[test]
fn locates_the_sample_flight_and_writes_a_page_that_loads_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let started = Instant::now();
    let run = assert_cmd::Command::cargo_bin("overfly")
        .unwrap()
        .args(["demo", "--json", "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let count = |key: &str| last[key].as_u64().unwrap();
    assert_eq!((count("frames"), count("false")), (40, 0), "{last}");
    assert!(count("right") >= AT_LEAST_RIGHT, "{last}");
    // Shadows and crops differ between map and flight, so the error is more than noise; 1.5 m is the map's 1.5 pixels.
    assert!(last["error_m"]["median"].as_f64().unwrap() < 1.5, "{last}");
    assert!(started.elapsed().as_secs() < 120, "the demo took {:?}", started.elapsed());

    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("<svg class=\"map\"") && page.contains("frames/039.jpg"));
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "src=\"/"] {
        assert!(!page.contains(outside), "the report loads something: {outside}");
    }
    let flown = last["flown"].as_array().unwrap();
    let modes: Vec<_> = flown.iter().map(|f| f["mode"].as_str().unwrap()).collect();
    assert_eq!(modes, ["sequential", "parallel", "combined"]);
    assert!(
        flown.iter().all(|f| f["false"] == 0 && f["position_error_m"]["p95"].as_f64().unwrap() < 15.0),
        "{flown:?}"
    );
    let page = std::fs::read_to_string(folder.path().join("flown.html")).unwrap();
    assert!(page.contains("<h2>combined</h2>") && !page.contains("src=\"http"));
    let fixes = std::fs::read_to_string(folder.path().join("fixes.csv")).unwrap();
    assert_eq!(fixes.lines().count(), 41);
}

#[test]
fn says_what_to_do_without_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let run = assert_cmd::Command::cargo_bin("overfly")
        .unwrap()
        .arg("demo")
        .args(["--tiles", "no/such/folder", "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--tiles DIR"));
}
