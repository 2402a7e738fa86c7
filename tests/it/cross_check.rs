//! `overfly info --cross-check` measures how far the layers of a store lie off each other.

use overfly_flight::cross_check::CrossCheck;
use overfly_ingest::build::{self, Request};
use overfly_store::Reader;
use overfly_testkit::drawn::project;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The shift of the second layer, metres to the east and north.
const SHIFT_M: [f64; 2] = [4.0, -2.5];

/// Builds the first epoch into a layer, its world files shifted.
fn build_shifted(folder: &Path, layer: &str, shift_m: [f64; 2], stated_m: f64) {
    let sources = folder.join(layer);
    std::fs::create_dir(&sources).unwrap();
    for entry in std::fs::read_dir(project("tiles/epoch_1")).unwrap() {
        let path: PathBuf = entry.unwrap().path();
        let to = sources.join(path.file_name().unwrap());
        if path.extension().is_some_and(|extension| extension == "jgw") {
            let mut lines: Vec<f64> =
                std::fs::read_to_string(&path).unwrap().lines().map(|line| line.trim().parse().unwrap()).collect();
            lines[4] += shift_m[0];
            lines[5] += shift_m[1];
            std::fs::write(to, lines.iter().map(|line| format!("{line:.12}\n")).collect::<String>()).unwrap();
        } else {
            std::fs::copy(path, to).unwrap();
        }
    }
    let request = Request {
        db: folder.join("map.gpkg"),
        layer: layer.into(),
        sources: vec![sources],
        horizontal_error_m: Some(stated_m),
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
}

fn info(folder: &Path, words: &[&str]) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .current_dir(folder)
        .args(["info", "map.gpkg", "--cross-check"])
        .args(words)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

#[test]
fn a_layer_that_lies_elsewhere_is_found_with_its_shift() {
    let folder = tempfile::tempdir().unwrap();
    build_shifted(folder.path(), "first", [0.0; 2], 5.0);
    let alone = info(folder.path(), &[]);
    assert!(alone.contains("no two layers") && alone.contains("overfly build --layer"), "{alone}");

    build_shifted(folder.path(), "second", SHIFT_M, 0.5);
    build_shifted(folder.path(), "third", [0.0; 2], 5.0);
    let store = Reader::open(&folder.path().join("map.gpkg")).unwrap();
    let check = CrossCheck::new(&store, 2, &|_, _| ()).unwrap();
    assert_eq!(check.pairs.len(), 3);
    for layer in &check.layers {
        let truth = if layer.layer == "second" { SHIFT_M } else { [0.0; 2] };
        let offset = layer.offset.unwrap();
        let off = (offset.east_m - truth[0]).hypot(offset.north_m - truth[1]);
        // A fifth of a pixel.
        assert!(off < 0.25, "{layer:?}");
        assert!(layer.scatter_m.unwrap() < 0.25, "{layer:?}");
    }

    let text = info(folder.path(), &[]);
    assert!(text.contains("note: layer second states an error of 0.50 m"), "{text}");
    assert!(!text.contains("note: layer first") && !text.contains("note: layer third"), "{text}");
    let json: serde_json::Value = serde_json::from_str(&info(folder.path(), &["--json"])).unwrap();
    let layers = json["cross_check"]["layers"].as_array().unwrap();
    let understated: Vec<bool> = layers.iter().map(|layer| layer["is_understated"].as_bool().unwrap()).collect();
    assert_eq!(understated, [false, true, false]);
}
