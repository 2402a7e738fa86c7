//! `overfly experiment` repeats the paper's section V.D, says which laws hold, and gives the same pairs for the same seed.

use super::needs::real_data;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn overfly(folder: &Path, words: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// A photo of the project's own tiles.
fn photo(name: &str) -> String {
    overfly_testkit::drawn::project("tiles/epoch_1").join(name).display().to_string()
}

/// The summary: the last line.
fn summary(said: &str) -> Value {
    serde_json::from_str(said.lines().last().unwrap()).unwrap()
}

/// Each row of a table as its cells.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn the_papers_pairs_are_cut_registered_judged_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let (west, east) = (photo("west.jpg"), photo("east.jpg"));
    let words = ["experiment", &west, &east, "--quick", "--edge-px", "256", "--out", "found", "--json"];
    let (exit, said, log) = overfly(folder.path(), &words);
    assert_eq!(exit, Some(0), "{log}");
    let found = summary(&said);
    assert_eq!((&found["images"], &found["pairs"], &found["registrations"]), (&9.into(), &40.into(), &160.into()));
    assert_eq!(said.lines().count(), 161);
    assert_eq!(found["false"], 0);
    // What is printed is what the table says: registered, and from which count on every registration is below 0.84 px.
    let samples = rows(&folder.path().join("found/samples.csv"));
    assert_eq!(samples.len(), 160);
    let registered = samples.iter().filter(|r| r[10] == "1").count();
    assert!(registered >= 100 && found["registered"] == registered, "{registered}");
    for (curve, column, scored) in [("program", 11, registered), ("keypoints", 12, registered)] {
        let drifts: Vec<(u64, f64)> = samples
            .iter()
            .filter(|r| r[10] == "1")
            .map(|r| (r[9].parse().unwrap(), r[column].parse().unwrap()))
            .collect();
        let bad = drifts.iter().filter(|d| d.1 >= 1.0 / 1.19).map(|d| d.0).max().unwrap_or(0);
        let from = drifts.iter().map(|d| d.0).filter(|n| *n > bad).min();
        let curve = &found["laws"][curve];
        assert_eq!(curve["scored"], scored);
        assert_eq!(curve["matches_needed"]["by_every_registration"].as_u64(), from);
        assert!(from.unwrap() <= 60, "{from:?}");
    }
    // Drift falls with matches whatever the machine is busy with; times are judged, but not here.
    let figures: Vec<_> = found["shapes"].as_array().unwrap().iter().map(|s| s["figure"].as_u64()).collect();
    assert_eq!(figures, [Some(12), Some(13), Some(14), None, Some(15)]);
    assert!(found["laws"]["keypoints"]["power"].as_f64().unwrap() < -0.25);
    assert!(found["shapes"].as_array().unwrap().iter().all(|s| s["holds"].is_boolean() && s["r2"].is_number()));
    assert_eq!(found["paper"]["matches_needed"], 600.0);
    let page = std::fs::read_to_string(folder.path().join("found/experiment.html")).unwrap();
    assert_eq!(page.matches("<svg").count(), 5);
    assert!(
        page.contains("data:image/jpeg") && !page.contains("NaN") && !page.contains("src=\"http"),
        "loads something"
    );
    for name in ["loading", "matching", "threshold", "total", "drift"] {
        let plot = std::fs::read_to_string(folder.path().join(format!("found/{name}.svg"))).unwrap();
        assert!(plot.starts_with("<svg ") && !plot.contains("NaN"), "{name}");
    }
    let written: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("found/summary.json")).unwrap()).unwrap();
    assert_eq!(written, found);
}

#[test]
fn the_same_seed_gives_the_same_but_for_the_times() {
    let folder = tempfile::tempdir().unwrap();
    let west = photo("west.jpg");
    let run = |out: &str, seed: &str| {
        let words =
            ["experiment", &west, "--quick", "--images", "3", "--pairs", "2", "--edge-px", "192", "--seed", seed];
        let (exit, _, log) = overfly(folder.path(), &[&words[..], &["--out", out]].concat());
        assert_eq!(exit, Some(0), "{log}");
        let timeless = |row: Vec<String>| [&row[..4], &row[9..]].concat();
        let samples: Vec<_> = rows(&folder.path().join(out).join("samples.csv")).into_iter().map(timeless).collect();
        (samples, std::fs::read(folder.path().join(out).join("images.csv")).unwrap())
    };
    let first = run("first", "7");
    assert!(first == run("second", "7"), "the same seed gave something else");
    let other = run("third", "8");
    assert!(first.0 != other.0 && first.1 != other.1);
}

/// A gray GeoTIFF without a place, in strips of 64 rows; its uppermost rows have no pixels.
fn holed_tiff(gray: &image::GrayImage, missing_rows: u32) -> Vec<u8> {
    const ROWS: u32 = 64;
    let (width, height) = gray.dimensions();
    let strips = height.div_ceil(ROWS);
    let mut out = vec![b'I', b'I', 42, 0, 0, 0, 0, 0];
    let (mut offsets, mut sizes) = (Vec::new(), Vec::new());
    for strip in 0..strips {
        let rows = strip * ROWS..((strip + 1) * ROWS).min(height);
        offsets.push(out.len() as u32);
        sizes.push(2 * width * (rows.end - rows.start));
        for (y, x) in rows.flat_map(|y| (0..width).map(move |x| (y, x))) {
            out.extend([gray.get_pixel(x, y)[0], if y < missing_rows { 0 } else { 255 }]);
        }
    }
    let arrays_at = out.len() as u32;
    out.extend(offsets.iter().chain(&sizes).flat_map(|v| v.to_le_bytes()));
    let directory_at = out.len() as u32;
    out[4..8].copy_from_slice(&directory_at.to_le_bytes());
    // Tag, type (3 short, 4 long), count, value or where the values stand; 258: twice eight bits; 338: alpha.
    let entries: [(u16, u16, u32, u32); 10] = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 2, 0x0008_0008),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, strips, arrays_at),
        (277, 3, 1, 2),
        (278, 4, 1, ROWS),
        (279, 4, strips, arrays_at + 4 * strips),
        (338, 3, 1, 2),
    ];
    out.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        out.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        out.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
    }
    out.extend([0; 4]);
    out
}

#[test]
fn orthophotos_are_cut_where_they_have_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let gray = image::open(photo("west.jpg")).unwrap().to_luma8();
    std::fs::write(folder.path().join("holed.tif"), holed_tiff(&gray, 900)).unwrap();
    let words =
        ["experiment", "holed.tif", "--quick", "--images", "4", "--pairs", "2", "--edge-px", "192", "--out", "found"];
    let (exit, _, log) = overfly(folder.path(), &words);
    assert_eq!(exit, Some(0), "{log}");
    let images = rows(&folder.path().join("found/images.csv"));
    assert_eq!(images.len(), 4);
    for row in images {
        // A view's edge lies 96 px from its centre, its corner 135.
        assert!(row[3].parse::<f64>().unwrap() > 900.0 + 96.0, "cut where nothing is: {row:?}");
    }
    std::fs::write(folder.path().join("empty.tif"), holed_tiff(&gray, 2000)).unwrap();
    let (exit, _, log) = overfly(folder.path(), &["experiment", "empty.tif", "--quick", "--out", "none"]);
    assert!(exit == Some(2) && log.contains("error[no_place_for_views]") && log.contains("empty.tif"), "{log}");
}

#[test]
fn says_which_photo_or_option_it_cannot_use() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.jpg"), "no picture").unwrap();
    std::fs::write(folder.path().join("torn.tif"), b"II*\0\xff\xff\xff\xff").unwrap();
    let (west, deep) =
        (photo("west.jpg"), overfly_testkit::drawn::project("tests/fixtures/uint16.tif").display().to_string());
    let cases: [(&[&str], &str, &str); 7] = [
        (&[], "usage", "PHOTO"),
        (&["none.jpg"], "image_unreadable", "none.jpg"),
        (&["text.jpg"], "not_an_image", "text.jpg"),
        (&["torn.tif"], "source_damaged", "torn.tif"),
        (&[&deep], "source_needs_stretch", "--stretch"),
        (&[&west, "--edge-px", "900"], "no_place_for_views", "west.jpg"),
        (&[&west, "--images", "3", "--pairs", "4"], "bad_option", "images"),
    ];
    for (words, code, named) in cases {
        let (exit, _, said) = overfly(folder.path(), &[&["experiment", "--quick", "--out", "found"], words].concat());
        assert_eq!(exit, Some(2), "{words:?}: {said}");
        assert!(said.contains(&format!("error[{code}]")) && said.contains(named), "{words:?}: {said}");
    }
}

/// The published figures of Brighton's photos come out again, except for the times.
#[test]
#[ignore = "needs brighton"]
fn needs_brighton_real_photos_need_a_tenth_of_the_papers_matches() {
    let photos = real_data("brighton/photos");
    let mut names: Vec<_> =
        std::fs::read_dir(&photos).unwrap().map(|e| e.unwrap().path().display().to_string()).collect();
    names.sort();
    let folder = tempfile::tempdir().unwrap();
    let mut words: Vec<&str> = names.iter().step_by(4).map(String::as_str).collect();
    words.extend(["--quick", "--out", "found", "--json"]);
    words.insert(0, "experiment");
    let (exit, said, log) = overfly(folder.path(), &words);
    assert_eq!(exit, Some(0), "{log}");
    let found = summary(&said);
    assert_eq!(found["false"], 0);
    for curve in ["program", "keypoints"] {
        let needed = found["laws"][curve]["matches_needed"]["by_every_registration"].as_u64().unwrap();
        assert!(needed <= 60, "{curve}: {needed}");
    }
}
