//! `--layer any`: the newest layer that shows the place answers, and the evidence counts every layer that may be searched.

use super::http::Stand;
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::{Answer, Fix, FixRequest, HeadingPrior, PositionPrior, locate};
use overfly_ingest::build::{self, BuildError, Request};
use overfly_lab::trial::RecordedFlight;
use overfly_store::{ANY_LAYER, Reader};
use overfly_testkit::drawn::project;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A frame over the west of the drawn map.
const FRAME: usize = 5;

fn build(db: &Path, layer: &str, source: &Path, date: Option<&str>) -> Result<(), BuildError> {
    let request = Request {
        db: db.into(),
        layer: layer.into(),
        sources: vec![source.into()],
        date: date.map(str::to_owned),
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).map(|_| ())
}

/// The second epoch, mirrored where it lies: other ground at the same place.
fn mirrored(folder: &Path) -> PathBuf {
    let source = project("tiles/epoch_2/whole.jpg");
    let path = folder.join("mirrored.png");
    image::open(&source).unwrap().fliph().save(&path).unwrap();
    std::fs::copy(source.with_extension("jgw"), path.with_extension("pgw")).unwrap();
    std::fs::copy(source.with_extension("prj"), path.with_extension("prj")).unwrap();
    path
}

/// Where stores of several layers lie, made once for all tests.
fn maps() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let made = || {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (project("tiles/epoch_1"), project("tiles/epoch_2"));
        let other = mirrored(folder.path());
        let at = |name: &str| folder.path().join(name);
        for (db, layer, source, date) in [
            ("both.gpkg", "a", &old, Some("2018-05-01")),
            ("both.gpkg", "b", &new, Some("2021-05-01")),
            ("old_only.gpkg", "a", &other, Some("2021-05-01")),
            ("old_only.gpkg", "b", &old, Some("2018-05-01")),
            ("undated.gpkg", "a", &other, Some("1950-05-01")),
            ("undated.gpkg", "b", &old, None),
            ("undated.gpkg", "c", &new, None),
        ] {
            build(&at(db), layer, source, date).unwrap();
        }
        folder
    };
    FOLDER.get_or_init(made).path()
}

fn frame() -> (PathBuf, Gray, FixRequest) {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let frame = &flight.frames[FRAME];
    let request = FixRequest {
        layer: ANY_LAYER.into(),
        position: PositionPrior::Square { centre: frame.true_position.unwrap(), half_width_m: 300.0 },
        heading: Some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: 0.05 }),
        view: frame.view(&flight.camera),
        scale_sigma_ratio: 0.03,
        time_s: None,
    };
    (frame.path.clone(), read_frame(&frame.path).unwrap(), request)
}

fn fix(db: &str, layer: &str) -> (Reader, Fix) {
    let store = Reader::open(&maps().join(db)).unwrap();
    let (_, gray, request) = frame();
    let answer = locate(&store, &gray, &FixRequest { layer: layer.into(), ..request }, 2).unwrap();
    let Answer::Fix(fix) = answer else { panic!("{db} {layer}: {answer:?}") };
    (store, fix)
}

#[test]
fn the_newest_layer_answers_where_both_show_the_place() {
    let (store, found) = fix("both.gpkg", ANY_LAYER);
    assert_eq!((found.map.layer.as_str(), found.map.layer_date.as_deref()), ("b", Some("2021-05-01")));
    assert_eq!((found.map.layers_searched, found.map.layers_charged), (vec!["b".to_owned()], 2));
    assert_eq!(found.map.store_digest, store.digest());
}

#[test]
fn an_older_layer_answers_where_the_newest_shows_other_ground_and_every_layer_is_charged() {
    let (_, found) = fix("old_only.gpkg", ANY_LAYER);
    assert_eq!((found.map.layer.as_str(), found.map.layer_date.as_deref()), ("b", Some("2018-05-01")));
    assert_eq!(found.map.layers_searched, ["a", "b"]);
    for (db, winner, layers) in [("old_only.gpkg", "b", 2), ("both.gpkg", "b", 2), ("undated.gpkg", "b", 3)] {
        let (any, alone) = (fix(db, ANY_LAYER).1, fix(db, winner).1);
        assert_eq!((any.map.layer.as_str(), any.map.layers_charged, alone.map.layers_charged), (winner, layers, 1));
        let more = any.log10_false_alarms.unwrap() - alone.log10_false_alarms.unwrap();
        assert!((more - (layers as f64).log10()).abs() < 1e-9, "{db}: {more}");
        assert_eq!((any.position, any.covariance), (alone.position, alone.covariance), "{db}");
        assert!(any.false_fix_probability >= alone.false_fix_probability && any.tiles_searched >= alone.tiles_searched);
    }
}

#[test]
fn layers_without_a_date_are_last_and_in_the_order_of_their_names() {
    let (_, found) = fix("undated.gpkg", ANY_LAYER);
    assert_eq!((found.map.layers_searched, found.map.layer_date), (vec!["a".to_owned(), "b".to_owned()], None));
}

#[test]
fn no_fix_names_the_layers_and_the_store_too() {
    let store = Reader::open(&maps().join("both.gpkg")).unwrap();
    let (_, gray, request) = frame();
    let blank = Gray::filled(gray.width_px(), gray.height_px(), 80.0);
    let Answer::NoFix(none) = locate(&store, &blank, &request, 2).unwrap() else { panic!("a fix") };
    assert_eq!((none.map.layers_searched, none.map.layer.as_str()), (vec!["b".to_owned(), "a".to_owned()], "b"));
    assert_eq!((none.map.store_digest.as_str(), none.map.layers_charged), (store.digest(), 2));
}

/// Exit code and both streams of `overfly fix` over a store, with a layer.
fn said(db: &str, layer: &str, more: &[&str]) -> (Option<i32>, String) {
    let (path, ..) = frame();
    let done = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .args(["fix", "--db"])
        .arg(maps().join(db))
        .arg("--image")
        .arg(path)
        .args(["--height-m", "520", "--heading-deg"])
        .arg(frame().2.heading.unwrap().heading_rad.to_degrees().rem_euclid(360.0).to_string())
        .arg("--camera")
        .arg(project("tiles/flight/camera.toml"))
        .args(["--layer", layer])
        .args(more)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout) + &text(&done.stderr))
}

#[test]
fn the_command_line_names_layer_date_store_and_the_maps_error() {
    let (exit, text) = said("old_only.gpkg", ANY_LAYER, &[]);
    assert_eq!(exit, Some(0), "{text}");
    let digest = Reader::open(&maps().join("old_only.gpkg")).unwrap().digest().to_owned();
    for part in [
        &format!("map        layer b of 2018-05-01, store {digest}; searched a, b of 2 layers"),
        "map error  3.00 m per axis, a default: nothing states the map's error",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let (_, json) = said("old_only.gpkg", ANY_LAYER, &["--json"]);
    let answer: serde_json::Value = serde_json::from_str(json.lines().next().unwrap()).unwrap();
    assert_eq!((&answer["layer"], &answer["layer_date"]), (&"b".into(), &"2018-05-01".into()));
    assert_eq!((&answer["store_digest"], &answer["layers_charged"]), (&digest.into(), &2.into()));
    assert_eq!((&answer["map_error_known"], &answer["map_error_m"]), (&false.into(), &3.0.into()));
    let (exit, text) = said("both.gpkg", "c", &[]);
    assert!(exit == Some(2) && text.contains("no layer \"c\"; the layers are a, b"), "{text}");
}

#[test]
fn over_http_the_answers_name_layer_date_store_and_the_maps_error_too() {
    let store = Reader::open(&maps().join("old_only.gpkg")).unwrap();
    let digest = store.digest().to_owned();
    let stand = Stand::over(store);
    let (path, _, request) = frame();
    let PositionPrior::Square { centre, .. } = request.position else { panic!("a square") };
    let image = std::fs::read(path).unwrap();
    let ask = |layer: &str, heading_deg: f64| {
        let json = serde_json::json!({
            "latitude_deg": centre.latitude_deg(), "longitude_deg": centre.longitude_deg(), "sigma_m": 100.0,
            "heading_deg": heading_deg, "gsd_m_per_px": 1.3, "height_sigma_ratio": 0.05, "layer": layer,
        });
        stand.post("/v1/fixes", &[("image", &image), ("request", json.to_string().as_bytes())])
    };
    let heading_deg = request.heading.unwrap().heading_rad.to_degrees().rem_euclid(360.0);
    let (any, alone) = (ask("any", heading_deg).json(), ask("b", heading_deg).json());
    assert_eq!((&any["status"], &any["layer"], &any["layer_date"]), (&"fix".into(), &"b".into(), &"2018-05-01".into()));
    assert_eq!((&any["store_digest"], &any["layers_charged"]), (&digest.clone().into(), &2.into()));
    assert_eq!(any["layers_searched"], serde_json::json!(["a", "b"]));
    assert_eq!((&any["map_error_m"], &any["map_error_known"]), (&3.0.into(), &false.into()));
    let more = any["log10_false_alarms"].as_f64().unwrap() - alone["log10_false_alarms"].as_f64().unwrap();
    assert!((more - 2f64.log10()).abs() < 1e-9, "{more}");
    let none = ask("any", (heading_deg + 90.0) % 360.0).json();
    assert_eq!((&none["status"], &none["store_digest"]), (&"no_fix".into(), &digest.into()));
    assert_eq!(none["layers_searched"], serde_json::json!(["a", "b"]));
    assert_eq!(ask("c", heading_deg).problem().1, "no_such_layer");
    let schemas = stand.get("/openapi.json").json()["components"]["schemas"].to_string();
    for name in ["map_error_known", "map_error_m", "layer_date", "store_digest", "layers_charged"] {
        assert!(schemas.contains(name), "{name}");
    }
}

#[test]
fn no_new_layer_is_called_any() {
    let db = maps().join("new.gpkg");
    let error = build(&db, ANY_LAYER, &project("tiles/epoch_2"), None).unwrap_err();
    assert!(error.code() == "layer_name" && error.to_string().contains("any, which stands for all layers"), "{error}");
    assert!(!db.exists());
}
