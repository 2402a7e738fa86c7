//! Mistakes that people make on the command line, and the sentence that each wants: the file, the cause, the remedy.

use super::export::drawn_request;
use overfly_ingest::build::{self, Request};
use overfly_ingest::export::{ExportRequest, export};
use overfly_store::package::{SecretKey, generate};
use overfly_testkit::drawn::{drawn_store, project};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

/// The command line, in which MAPPED stands for an orthophoto, the exit code, and what the answer must say.
type Mistake<'a> = (&'a str, i32, &'a [&'a str]);

/// A folder with a map, an export, its keys and what else people confuse with them.
fn desk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::copy(drawn_store().path(), at("map.gpkg")).unwrap();
    generate(&at("ground.key")).unwrap();
    generate(&at("other.key")).unwrap();
    let key = Some(SecretKey::read(&at("ground.key")).unwrap());
    let serial = Some(6);
    export(drawn_store(), &ExportRequest { key, serial, ..drawn_request() }, &at("flight.gpkg"), &|_, _| ()).unwrap();
    export(drawn_store(), &ExportRequest { serial, ..drawn_request() }, &at("unsigned.gpkg"), &|_, _| ()).unwrap();
    export(drawn_store(), &drawn_request(), &at("unnumbered.gpkg"), &|_, _| ()).unwrap();
    std::fs::copy(at("map.gpkg"), at("precious.gpkg")).unwrap();
    // A library without a clock refuses no date.
    let future = Request {
        db: at("future.gpkg"),
        layer: "ortho".into(),
        sources: vec![project("tests/fixtures/degrees.tif")],
        date: Some("2112-07-31".into()),
        threads: 1,
        ..Request::default()
    };
    build::run(&future, &mut |_| ControlFlow::Continue(())).unwrap();
    for name in ["flight.gpkg", "map.gpkg"] {
        let whole = std::fs::read(at(name)).unwrap();
        std::fs::write(at(&format!("half-{name}")), &whole[..whole.len() / 2]).unwrap();
        std::fs::write(at(&format!("begun-{name}")), &whole[..50]).unwrap();
    }
    std::fs::copy(project("tiles/flight/frames/019.jpg"), at("frame.jpg")).unwrap();
    std::fs::copy(project("tiles/flight/camera.toml"), at("camera.toml")).unwrap();
    std::fs::copy(project("docs/plan/aircraft.toml"), at("aircraft.toml")).unwrap();
    let texts = [
        ("route.geojson", r#"{"type":"LineString","coordinates":[[15.6053,48.4961],[15.6120,48.4961]]}"#),
        ("swapped.geojson", r#"{"type":"LineString","coordinates":[[48.4961,15.6053],[48.4961,15.6120]]}"#),
        ("beyond.geojson", r#"{"type":"LineString","coordinates":[[48.4961,-99.19],[48.4961,-99.18]]}"#),
        ("no-scale.toml", "speed_mps = 30\nmin_turn_radius_m = 400\nwidth_px = 640\nheight_px = 480\n"),
        ("point.geojson", r#"{"type":"Point","coordinates":[15.6,48.49]}"#),
        ("route.csv", "48.4961,15.6053\n48.4961,15.6120\n"),
        ("notes.txt", "hello"),
        ("half-camera.toml", "width_px = 400\n"),
        ("empty.gpkg", ""),
    ];
    for (name, text) in texts {
        std::fs::write(at(name), text).unwrap();
    }
    std::fs::create_dir(at("photos")).unwrap();
    folder
}

/// Exit code, and both streams.
fn said(folder: &Path, words: &str) -> (Option<i32>, String) {
    let mapped = project("tests/fixtures/degrees.tif").display().to_string();
    let done = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .current_dir(folder)
        .args(words.split_whitespace().map(|word| if word == "MAPPED" { &mapped } else { word }))
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout) + &text(&done.stderr))
}

/// A command, its exit code, and what it must say.
type OwnedMistake<'a> = (String, i32, Vec<&'a str>);

fn check_owned(lines: &[OwnedMistake<'_>]) {
    let mistakes: Vec<Mistake<'_>> = lines.iter().map(|(w, e, p)| (w.as_str(), *e, p.as_slice())).collect();
    check(&mistakes);
}

fn check(mistakes: &[Mistake<'_>]) {
    let folder = desk();
    let wrong: Vec<String> = mistakes
        .iter()
        .filter_map(|(words, expected, parts)| {
            let (exit, said) = said(folder.path(), words);
            let missing: Vec<_> = parts.iter().filter(|part| !said.contains(**part)).collect();
            let good = exit == Some(*expected) && missing.is_empty() && !said.contains("panicked");
            (!good).then(|| format!("{words}\n  exit {exit:?}, expected {expected}; missing {missing:?}\n  {said}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What every command says of half a copy.
const CUT_OFF: &str = " MB: copying was cut off; copy it again";

const FRAME: &str = "fix --db map.gpkg --image frame.jpg";

#[test]
fn where_a_frame_is_to_be_located() {
    let prior = format!("{FRAME} --latitude-deg 48.4915 --longitude-deg 15.6160 --sigma-m 200");
    let camera = "--height-m 500.4 --camera camera.toml";
    let lines: Vec<OwnedMistake<'_>> = vec![
        (
            format!(
                "{FRAME} --latitude-deg 15.6160 --longitude-deg 48.4915 --sigma-m 200 --heading-deg 271.6 {camera}"
            ),
            3,
            vec!["outside_map", "layer ortho spans latitude", "if latitude and longitude are swapped"],
        ),
        (
            format!("{FRAME} --latitude-deg 115.6 --longitude-deg 48.4915 --sigma-m 200 {camera}"),
            2,
            vec!["latitude_deg = 115.6", "[-85.051128, 85.051128]"],
        ),
        (
            format!("{FRAME} --latitude-deg 48,4915 --longitude-deg 15.6 --sigma-m 200 {camera}"),
            2,
            vec!["--latitude-deg", "a decimal is written with a point: 48.4915", "as in 47.02"],
        ),
        (format!("{prior} --heading-deg 400 {camera}"), 2, vec!["heading_deg = 400", "in [0, 360)"]),
    ];
    check_owned(&lines);
}

#[test]
fn where_a_unit_is_another() {
    let prior = format!("{FRAME} --latitude-deg 48.4915 --longitude-deg 15.6160 --sigma-m 200");
    let camera = "--height-m 500.4 --camera camera.toml";
    let lines: Vec<OwnedMistake<'_>> = vec![
        (
            format!("{prior} --heading-deg 4.74 {camera} --explain --explain-limit-s 120"),
            3,
            vec!["no fix", "not 4.74: --heading-deg looks like radians"],
        ),
        (
            format!("{prior} --heading-deg 271.6 --height-m 1641 --camera camera.toml --explain --explain-limit-s 120"),
            3,
            vec!["not 1641 m: --height-m looks like feet (ratio 3.28)"],
        ),
        (
            format!(
                "{prior} --heading-deg 271.6 --height-m 0.5004 --camera camera.toml --explain --explain-limit-s 120"
            ),
            3,
            vec!["matches at a height of 500 m, not 0.5004 m: --height-m looks like kilometres"],
        ),
        (
            format!("{prior} --heading-deg 271.6 --gsd-m-per-px 4.1 --explain --explain-limit-s 120"),
            3,
            vec!["matches at 1.25 m/px, not 4.1: --gsd-m-per-px looks like feet (ratio 3.28)"],
        ),
        (
            format!("{prior} --heading-deg 271.6 --gsd-m-per-px 450"),
            3,
            vec!["inconsistent_scale", "and the whole layer covers", "is its scale right?"],
        ),
    ];
    check_owned(&lines);
}

#[test]
fn where_a_camera_is_described() {
    let prior = format!("{FRAME} --latitude-deg 48.4915 --longitude-deg 15.6160 --sigma-m 200");
    let camera = "--height-m 500.4 --camera camera.toml";
    let lines: Vec<OwnedMistake<'_>> = vec![
        (format!("{prior} --heading-deg 271.6 --height-m 500"), 2, vec!["not provided", "--camera <FILE>"]),
        (format!("{prior} --heading-deg 271.6"), 2, vec!["--gsd-m-per-px, or --height-m with --camera"]),
        (format!("{FRAME} --latitude-deg 48.49 {camera}"), 2, vec!["not provided", "--longitude-deg", "--sigma-m"]),
        (format!("{prior} {camera} --layer summer"), 2, vec!["map.gpkg: no layer \"summer\"; the layers are ortho"]),
        (format!("{prior} {camera} --pitch-deg 80"), 2, vec!["pitch_deg = 80", "at most 45 degrees"]),
        (
            format!("{prior} --height-m 500 --camera half-camera.toml"),
            2,
            vec!["half-camera.toml", "missing field `height_px`", "`overfly fix --help` describes camera.toml"],
        ),
        (
            format!("{prior} --height-m 500 --camera frame.jpg"),
            2,
            vec!["frame.jpg does not describe a camera: it is not text"],
        ),
        (format!("{prior} --height-m 500 --camera none.toml"), 2, vec!["none.toml: No such file", "check the name"]),
        (format!("{prior} --heigth-m 500"), 2, vec!["--heigth-m", "a similar argument exists: '--height-m'"]),
    ];
    check_owned(&lines);
}

#[test]
fn hints_name_other_headings_scales_and_layers_and_are_no_fix() {
    let folder = desk();
    let far = project("tests/fixtures/degrees.tif").display().to_string();
    assert_eq!(said(folder.path(), &format!("build --db map.gpkg --layer far {far}")).0, Some(0));
    let prior = format!("{FRAME} --latitude-deg 48.4915 --longitude-deg 15.6160 --sigma-m 200 --camera camera.toml");
    let ask = |more: &str| said(folder.path(), &format!("{prior} {more} --explain --explain-limit-s 120 --json"));
    for (more, kind, words) in [
        ("--layer ortho --heading-deg 92 --height-m 500.4", "heading", ", not 92.0: check --heading-deg"),
        ("--layer ortho --heading-deg 271.6 --height-m 1000", "scale", "matches at 0.50 times the stated scale"),
        ("--layer far --heading-deg 271.6 --height-m 500.4", "layer", "matches in the layer ortho: try --layer ortho"),
    ] {
        let (exit, said) = ask(more);
        assert_eq!(exit, Some(3), "{more}: {said}");
        let answer: serde_json::Value = serde_json::from_str(said.lines().next().unwrap()).unwrap();
        assert_eq!((answer["status"].as_str(), answer["hints"][0]["kind"].as_str()), (Some("no_fix"), Some(kind)));
        assert!(answer["hints"][0]["message"].as_str().unwrap().contains(words), "{more}: {answer}");
    }
    let (exit, said) = ask("--layer ortho --heading-deg 271.6 --height-m 500.4");
    assert!(exit == Some(0) && !said.contains("hints"), "{said}");
}

#[test]
fn where_a_file_is_another_one() {
    check(&[
        ("fix --db map.gpkg --image none.jpg --gsd-m-per-px 1", 2, &["none.jpg: No such file", "check the name"]),
        ("fix --db map.gpkg --image photos --gsd-m-per-px 1", 2, &["photos", "name one image, not a folder"]),
        ("fix --db map.gpkg --image notes.txt --gsd-m-per-px 1", 2, &["notes.txt", "name a PNG, JPEG or WebP image"]),
        ("fix --db photos --image frame.jpg --gsd-m-per-px 1", 2, &["photos: not an overfly store: a folder"]),
        ("fix --db empty.gpkg --image frame.jpg --gsd-m-per-px 1", 2, &["empty.gpkg", "an empty file"]),
        (
            "fix --db map.gpk --image frame.jpg --gsd-m-per-px 1",
            2,
            &["map.gpk: no such file; check the name, or copy the store again"],
        ),
        ("fix --db half-map.gpkg --image frame.jpg --gsd-m-per-px 1", 2, &[CUT_OFF]),
        (
            "candidates --db half-flight.gpkg --latitude-deg 48.49 --longitude-deg 15.61 --heading-deg 0 --across-m 400 --along-m 300 --inaccuracy-m 20 --drift-m 250",
            2,
            &[CUT_OFF],
        ),
        ("info half-map.gpkg", 2, &[CUT_OFF]),
        ("info begun-map.gpkg", 2, &["only 50 bytes: copying was cut off; copy it again"]),
        ("diff half-map.gpkg map.gpkg", 2, &[CUT_OFF]),
        ("diff map.gpkg half-flight.gpkg", 2, &[CUT_OFF]),
        ("serve --db half-map.gpkg", 2, &[CUT_OFF]),
        ("export --db half-map.gpkg --route route.geojson --corridor-m 300 --out out.gpkg", 2, &[CUT_OFF]),
        (
            "candidates --db map.gpkg --layer any --latitude-deg 48.49 --longitude-deg 15.61 --heading-deg 0 --across-m 400 --along-m 300 --inaccuracy-m 20 --drift-m 250",
            2,
            &["only a fix searches them all: the store has ortho", "name one with --layer"],
        ),
        ("plan --aircraft no-scale.toml", 2, &["state gsd_m_per_px, or height_m with field_of_view_deg"]),
        (
            "plan --aircraft aircraft.toml --db map.gpkg --route beyond.geojson",
            2,
            &["latitude -99.19", "longitude first"],
        ),
        ("info notes.txt", 2, &["notes.txt: not an overfly store", "not an SQLite file"]),
        ("motion frame.jpg none.jpg", 2, &["none.jpg: No such file", "check the name"]),
        ("plan --aircraft camera.toml", 2, &["camera.toml does not describe an aircraft", "attitude_sigma_deg"]),
        ("plan --aircraft aircraft.toml --route route.geojson", 2, &["not provided", "--db <FILE>"]),
        ("evaluate fixes --db map.gpkg --flight photos", 2, &["photos/flight.csv", "a flight is a folder with"]),
        ("merge map.gpkg flight.gpkg --out all.gpkg", 2, &["flight.gpkg", "cut to one flight", "merge the stores"]),
        ("diff map.gpkg none.gpkg", 2, &["none.gpkg: no such file", "check the name"]),
    ]);
}

#[test]
fn where_a_map_is_built() {
    check(&[
        ("build --db new.gpkg none.tif", 2, &["none.tif: No such file", "check the name"]),
        ("build --db new.gpkg photos", 2, &["photos: no orthophoto in this folder", "name files or folders"]),
        ("build --db new.gpkg notes.txt", 2, &["notes.txt", "text that begins with \"hello\"", "gdal_translate"]),
        ("build --db new.gpkg flight.gpkg", 2, &["flight.gpkg: a GeoPackage", "name files or folders of orthophotos"]),
        ("build --db new.gpkg frame.jpg", 2, &["frame.jpg: no georeference", "add a world file"]),
        ("build --db flight.gpkg frame.jpg --crs EPSG:32633", 2, &["frame.jpg: no georeference"]),
        ("build --db photos", 2, &["photos: not an overfly store: a folder"]),
        ("build --db none/new.gpkg none.tif", 2, &["none.tif"]),
        (
            "build --db new.gpkg photos --date 2112-07-31",
            2,
            &["2112-07-31 is in the future: today is", "check the date, or set the clock"],
        ),
        ("layer describe --db map.gpkg ortho --date 2112-07-31", 2, &["2112-07-31 is in the future: today is"]),
        ("build --db map.gpkg --layer winter", 2, &["layer winter has no unfinished build to resume", "name files"]),
        (
            "build --db frame.jpg frame.jpg",
            2,
            &["frame.jpg: not an overfly store", "--db names the store that is made"],
        ),
        // Nobody, not even root, makes a file there.
        ("build --db /sys/new.gpkg MAPPED --date 2018-07-16", 2, &["/sys/new.gpkg: no permission"]),
        ("build --db half-map.gpkg MAPPED", 2, &[CUT_OFF]),
        ("build --db new.gpkg photos --date 16.07.2018", 2, &["\"16.07.2018\" is not a date", "YYYY-MM-DD"]),
        ("build --db new.gpkg photos --layer Summer", 2, &["invalid layer name \"Summer\"", "a-z 0-9"]),
        ("build --db new.gpkg photos --crs WGS84", 2, &["'WGS84'", "as in 32614 or EPSG:32614"]),
        ("build --db new.gpkg photos --zoom 30", 2, &["'30'", "a zoom from 0 to 23, as in 16"]),
        ("build --db new.gpkg photos --horizontal-error-m 1,5", 2, &["written with a point: 1.5", "as in 400"]),
        ("build --db map.gpkg --rename-layer", 2, &["unexpected argument '--rename-layer'", "overfly layer rename"]),
        ("build --db map.gpkg --remove-layer --layer summer", 2, &["no layer \"summer\"; the layers are ortho"]),
        ("build --db map.gpkg --remove-source none.tif", 2, &["no source \"none.tif\"", "`overfly info --json`"]),
        ("build --db new.gpkg photos --layer any", 2, &["invalid layer name \"any\"", "stands for all layers"]),
        ("layer rename --db map.gpkg ortho any", 2, &["invalid layer name \"any\"", "stands for all layers"]),
        ("layer rename --db map.gpkg ortho ortho", 2, &["\"ortho\" exists already", "choose another name"]),
        ("layer rename --db map.gpkg summer winter", 2, &["no layer \"summer\"; the layers are ortho"]),
        ("layer rename --db map.gpkg ortho", 2, &["not provided", "<NEW>"]),
        (
            "layer rename --db flight.gpkg ortho y2018",
            2,
            &["sealed by its digest", "exported from", "export that again"],
        ),
        ("layer remove --db flight.gpkg ortho --yes", 2, &["sealed by its digest", "export that again"]),
        ("layer remove --db flight.gpkg ortho --dry-run", 2, &["sealed by its digest", "export that again"]),
        ("layer describe --db flight.gpkg ortho --licence CC0-1.0", 2, &["sealed by its digest", "export that again"]),
        ("layer remove --db map.gpkg ortho", 2, &["ortho was not removed", "--dry-run", "--yes"]),
        ("layer remove --db none.gpkg ortho --yes", 2, &["none.gpkg: no such file", "check the name"]),
        ("layer describe --db map.gpkg ortho", 2, &["not provided", "--description <TEXT>"]),
        ("layer describe --db map.gpkg ortho --date 16.07.2018", 2, &["\"16.07.2018\" is not a date", "YYYY-MM-DD"]),
        ("layer delete --db map.gpkg ortho", 2, &["unrecognized subcommand 'delete'", "--help"]),
        ("biuld --db map.gpkg", 2, &["unrecognized subcommand 'biuld'", "'build'"]),
    ]);
}

#[test]
fn where_a_flight_is_exported() {
    let with = |more: &str| format!("export --db map.gpkg --out out.gpkg {more}");
    let good = "--route route.geojson --corridor-m 300";
    let lines: Vec<OwnedMistake<'_>> = vec![
        (with("--route route.geojson --corridor-m 0,4"), 2, vec!["with a point: 0.4", "0.4km or 1300ft"]),
        (with("--route route.geojson --corridor-m -300"), 2, vec!["'-300'", "must be greater than zero", "as in 400"]),
        (with("--route route.geojson --corridor-m 400mm"), 2, vec!["'400mm'", "as in 400"]),
        (with("--route route.geojson"), 2, vec!["not provided", "--corridor-m <W>"]),
        (with("--route swapped.geojson --corridor-m 300"), 2, vec!["no tile meets the corridor", "longitude first"]),
        (with("--route beyond.geojson --corridor-m 300"), 2, vec!["latitude -99.19", "longitude first"]),
        (with("--route route.geojson --corridor-m 1nm"), 2, vec!["a nautical mile is nmi or NM", "m, km, ft, nmi or NM"]),
        (with("--route route.geojson --corridor-m 0.8 --dry-run"), 0, vec!["WARNING: the corridor is 0.8 m wide", "0.8km"]),
        (
            "export --db future.gpkg --out out.gpkg --route route.geojson --corridor-m 300 --serial 1 --sign ground.key".into(),
            2,
            vec!["the store holds imagery of 2112-07-31", "set the clock, or correct the date"],
        ),
        (with("--route route.csv --corridor-m 300"), 2, vec!["route.csv is not a route", "GeoJSON, GPX or KML"]),
        (with("--route point.geojson --corridor-m 300"), 2, vec!["point.geojson", "a Point", "GeoJSON, GPX or KML"]),
        (with("--route none.gpx --corridor-m 300"), 2, vec!["none.gpx", "No such file", "check the name"]),
        (with(&format!("{good} --serial 1 --sign ground.key.pub")), 2, vec!["ground.key.pub", "needs the secret key"]),
        (with(&format!("{good} --serial 1 --sign none.key")), 2, vec!["none.key: no such file", "overfly keygen"]),
        (with(&format!("{good} --layer summer")), 2, vec!["no layer \"summer\"; the layers are ortho"]),
        (with(&format!("{good} --valid-until 31.12.2099")), 2, vec!["'31.12.2099'", "as in 2027-03-31"]),
        (with(&format!("{good} --valid-until 2020-01-01")), 2, vec!["2020-01-01 has passed", "today is"]),
        (with(&format!("{good} --max-bytes 5M")), 2, vec!["'5M'", "5000000, 5MB or 64MiB"]),
        (with(&format!("{good} --max-bytes 1kB")), 2, vec!["at least", "narrow the corridor"]),
        (with(&format!("{good} --require-covered 95")), 2, vec!["'95'", "as in 0.95"]),
    ];
    check_owned(&lines);
}

#[test]
fn where_a_file_would_be_written() {
    let lines: Vec<OwnedMistake<'_>> = vec![
        ("export --db map.gpkg --route route.geojson --corridor-m 300 --out map.gpkg".into(), 2, vec!["its inputs"]),
        (
            "export --db map.gpkg --route route.geojson --corridor-m 300 --out notes.txt".into(),
            2,
            vec!["notes.txt", "not overwritten", "choose another name"],
        ),
        (
            "export --db map.gpkg --route route.geojson --corridor-m 300 --out precious.gpkg".into(),
            2,
            vec!["precious.gpkg: a map exists there and is not overwritten", "choose another name"],
        ),
        (
            "merge map.gpkg map.gpkg --out precious.gpkg".into(),
            2,
            vec!["precious.gpkg: a map exists there and is not overwritten"],
        ),
        ("merge map.gpkg map.gpkg --out flight.gpkg".into(), 2, vec!["flight.gpkg: an export exists there"]),
        (
            "sign unsigned.gpkg --key ground.key --out precious.gpkg".into(),
            2,
            vec!["precious.gpkg: a map exists there and is not overwritten"],
        ),
        ("diff map.gpkg flight.gpkg --out precious.gpkg".into(), 2, vec!["precious.gpkg: a map exists there"]),
        (
            "export --db map.gpkg --route route.geojson --corridor-m 300 --out flight.gpkg --serial 2".into(),
            0,
            vec!["WARNING: flight.gpkg is replaced, an export of serial 6; the new one has serial 2", "serial 2; "],
        ),
        (
            "export --db map.gpkg --route route.geojson --corridor-m 300 --out none/out.gpkg".into(),
            2,
            vec!["none/out.gpkg: its folder does not exist", "create the folder"],
        ),
        (
            "export --db route.geojson --route map.gpkg --corridor-m 300 --out o.gpkg".into(),
            2,
            vec!["route.geojson: not an overfly store", "check the name"],
        ),
        // Nobody, not even root, makes a file there.
        (
            "export --db map.gpkg --route route.geojson --corridor-m 300 --out /sys/out.gpkg".into(),
            2,
            vec!["/sys/out.gpkg: no permission", "choose another path"],
        ),
    ];
    check_owned(&lines);
}

#[test]
fn where_an_aircraft_is_loaded() {
    check(&[
        ("verify flight.gpkg --key other.key.pub", 3, &["NOT GOOD", "[wrong_key]", "the right key"]),
        ("verify flight.gpkg --key ground.key", 2, &["ground.key: it is a secret key", "the public key, KEY.pub"]),
        ("verify flight.gpkg --key none.pub", 2, &["none.pub: no such file", "the public key, KEY.pub"]),
        ("verify unsigned.gpkg --key ground.key.pub", 3, &["NOT GOOD", "not signed", "ask the planner"]),
        ("verify half-flight.gpkg", 3, &["NOT GOOD", " MB: copying was cut off; copy it again"]),
        ("verify half-map.gpkg", 3, &["NOT GOOD", " MB: copying was cut off; copy it again"]),
        ("verify begun-flight.gpkg", 3, &["NOT GOOD", "only 50 bytes: copying was cut off; copy it again"]),
        ("verify empty.gpkg", 3, &["NOT GOOD", "an empty file: copying was cut off; copy it again"]),
        ("verify unsigned.gpkg", 0, &["GOOD: unsigned.gpkg (NOT signed: anyone may have made this file)"]),
        ("verify future.gpkg", 0, &["of 2112-07-31, which is in the FUTURE: the date or the clock is wrong"]),
        ("verify none.gpkg", 2, &["none.gpkg: no such file", "copy the store again"]),
        ("serve --db half-flight.gpkg --onboard", 2, &["copying was cut off; copy it again"]),
        ("serve --db map.gpkg --onboard --require-signature ground.key.pub", 2, &["not signed", "ask the planner"]),
        (
            "serve --db flight.gpkg --onboard --stale-after-days y2019:730=refuse",
            2,
            &["no_such_layer", "no layer \"y2019\"; the layers are ortho"],
        ),
        (
            "serve --db future.gpkg --onboard --stale-after-days 730=warn",
            2,
            &["clock_implausible", "set the clock; if it is right, ask the planner"],
        ),
        ("serve --db map.gpkg --require-signature ground.key.pub", 2, &["not provided", "--onboard"]),
        ("serve --db map.gpkg --listen 8787", 2, &["8787 is not an address", "127.0.0.1:8787"]),
        ("serve --db map.gpkg --memory 1MB", 2, &["must be at least 32MB", "128MB or 1GiB"]),
        ("apply flight.gpkg map.gpkg", 2, &["map.gpkg: not a patch", "copy the patch again"]),
        ("diff unsigned.gpkg flight.gpkg --out sign.patch", 0, &["sign.patch: "]),
        (
            "apply map.gpkg sign.patch",
            2,
            &["map.gpkg: it is a map, and the patch makes an export of it", "to another file with --out"],
        ),
        ("apply unsigned.gpkg sign.patch --out precious.gpkg", 2, &["precious.gpkg: a map exists there"]),
        ("apply unsigned.gpkg sign.patch --out applied.gpkg", 0, &["applied.gpkg: serial 6; "]),
        ("apply none.gpkg none.patch", 2, &["none.patch", "no such file"]),
        ("keygen --out ground.key", 2, &["ground.key: exists", "choose another name"]),
        ("sign map.gpkg --key ground.key --out s.gpkg", 2, &["map.gpkg: not an export"]),
        ("sign unnumbered.gpkg --key ground.key --out s.gpkg", 2, &["it has no serial", "with --serial N"]),
        ("sign unsigned.gpkg --key ground.key --out s.gpkg", 0, &["s.gpkg: serial 6; ", "signed by"]),
        ("sign flight.gpkg --key ground.key --out s.gpkg", 2, &["flight.gpkg: signed already"]),
    ]);
}
