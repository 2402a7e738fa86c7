//! A replayed flight gives the same positions as ever: `tests/reference/positions.csv`, kept in git. A difference is a change of
//! behaviour; the commit that changes the file says why.

use std::path::Path;
use std::process::Command;

fn overfly(args: &[&str]) {
    let done = Command::new(env!("CARGO_BIN_EXE_overfly")).args(args).output().unwrap();
    assert!(done.status.success(), "{args:?}: {}", String::from_utf8_lossy(&done.stderr));
}

/// The first few lines that differ.
fn differences(expected: &str, found: &str) -> String {
    let lines = expected.lines().zip(found.lines()).filter(|(a, b)| a != b);
    lines.take(5).map(|(a, b)| format!("- {a}\n+ {b}\n")).collect()
}

#[test]
fn the_drawn_flight_gives_the_positions_kept_in_git() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let path = |path: &Path| path.to_str().unwrap().to_owned();
    let (db, out) = (path(&folder.path().join("walk.gpkg")), path(&folder.path().join("flown")));
    let (tiles, flight) = (path(&root.join("tiles/epoch_1")), path(&root.join("tiles/flight")));
    overfly(&["build", "--db", &db, &tiles, "--date", "2018-06-12", "--horizontal-error-m", "0"]);
    overfly(&["fly", "--db", &db, "--flight", &flight, "--mode", "all", "--out", &out]);
    let expected = std::fs::read_to_string(root.join("tests/reference/positions.csv")).unwrap();
    let found = std::fs::read_to_string(Path::new(&out).join("positions.csv")).unwrap();
    assert_eq!(expected.lines().count(), 161, "40 images in each of four modes");
    assert!(
        expected == found,
        "positions changed; if that is meant, copy the new file to tests/reference and say why in the commit:\n{}",
        differences(&expected, &found)
    );
}
