//! `overfly calibrate` measures this machine and writes what `overfly plan` reads.

use overfly_core::coupling::Calibration;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn overfly(folder: &Path, words: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_quick_calibration_of_the_demos_imagery_is_one_that_plan_takes() {
    let folder = tempfile::tempdir().unwrap();
    let (exit, said, log) =
        overfly(folder.path(), &["calibrate", "--quick", "--edge-px", "256", "--out", "mine.toml", "--json"]);
    assert_eq!(exit, Some(0), "{log}");
    let last: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    let written: Calibration = toml::from_str(&text).unwrap();
    assert_eq!(written.check(), Ok(()));
    // What is printed is what is written, to the digits written; on a busy machine a line through two times may begin at 0.
    let printed = last["relative"]["load_s"].as_f64().unwrap();
    assert!((written.relative.load_s - printed).abs() <= 1e-3 * printed, "{} {printed}", written.relative.load_s);
    // A registration that describes 150 to 600 keypoints takes some time, and on no machine a minute; a drift of these
    // exactly known pairs is a fraction of a pixel.
    assert!(written.relative.total_s(written.images.descriptor_count).unwrap() < 60.0);
    let drift_px = written.unit_drift_m(256.0, 256.0, 1.0, written.images.matched_count).unwrap();
    assert!(drift_px > 0.0 && drift_px < 0.5, "{drift_px}");
    assert_eq!(last["laws"]["rows"].as_array().unwrap().len(), 2);
    for beside in ["loading.svg", "matching.svg", "threshold.svg", "total.svg", "drift.svg", "search.svg"] {
        let plot = std::fs::read_to_string(folder.path().join(format!("mine-{beside}"))).unwrap();
        assert!(plot.starts_with("<svg ") && !plot.contains("NaN"), "{beside}");
    }
    let samples = std::fs::read_to_string(folder.path().join("mine-samples.csv")).unwrap();
    assert_eq!(samples.lines().count(), 1 + 5 * 2);
}

#[test]
fn says_which_photo_or_store_it_cannot_use() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.jpg"), "no picture").unwrap();
    for (words, code, named) in [
        (&["calibrate", "none.jpg", "--quick"][..], "frame_", "none.jpg"),
        (&["calibrate", "text.jpg", "--quick"], "", "text.jpg"),
        (&["calibrate", "--quick", "--edge-px", "1200"], "no_place_for_views", "west.jpg"),
        (&["calibrate", "--quick", "--tiles", "nowhere"], "no_tiles", "--tiles DIR"),
        (&["calibrate", "--quick", "--edge-px", "128", "--db", "none.gpkg"], "store_not_found", "none.gpkg"),
    ] {
        let (exit, _, said) = overfly(folder.path(), words);
        assert_eq!(exit, Some(2), "{words:?}: {said}");
        assert!(said.contains(named) && (code.ends_with('_') || said.contains(code)), "{words:?}: {said}");
    }
}
