//! Exports over HTTP: the file that the command line writes, whole or in ranges; on the ground only.

use crate::export::{drawn_request, export_to};
use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::header::{CONTENT_RANGE, CONTENT_TYPE, ETAG, HeaderName, IF_NONE_MATCH, IF_RANGE, LOCATION, RANGE};
use axum::http::{HeaderMap, Request, StatusCode};
use overfly::server::{ExportLimits, Limits, Service, ServiceState, router};
use overfly_ingest::export::preview;
use overfly_store::Reader;
use overfly_testkit::drawn::drawn_store;
use overfly_testkit::soak::client::ServedStore;
use serde_json::{Value, json};
use std::process::Command;
use std::time::{Duration, Instant};
use tower::ServiceExt;

struct Reply {
    status: StatusCode,
    headers: HeaderMap,
    body: Vec<u8>,
}

impl Reply {
    fn json(&self) -> Value {
        let shown = String::from_utf8_lossy(&self.body[..self.body.len().min(500)]);
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {shown:?}"))
    }

    fn code(&self) -> String {
        self.json()["code"].as_str().unwrap_or_default().to_owned()
    }
}

fn service(service: Service) -> Router {
    keeping(service, ExportLimits::default())
}

fn keeping(service: Service, exports: ExportLimits) -> Router {
    let limits = Limits { exports, ..Limits::default() };
    router(ServiceState::new(Reader::open(drawn_store().path()).unwrap(), service, limits))
}

fn send(app: &Router, request: Request<Body>) -> Reply {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    runtime.block_on(async {
        let response = app.clone().oneshot(request).await.unwrap();
        let (parts, body) = response.into_parts();
        Reply { status: parts.status, headers: parts.headers, body: to_bytes(body, 1 << 28).await.unwrap().into() }
    })
}

fn post(app: &Router, body: &Value) -> Reply {
    let request = Request::post("/v1/exports").header(CONTENT_TYPE, "application/json");
    send(app, request.body(Body::from(body.to_string())).unwrap())
}

fn get(app: &Router, path: &str, range: Option<&str>) -> Reply {
    let request = range.iter().fold(Request::get(path), |request, range| request.header(RANGE, *range));
    send(app, request.body(Body::empty()).unwrap())
}

/// Asks until the export is written or has failed.
fn fetched(app: &Router, path: &str) -> Reply {
    loop {
        let reply = get(app, path, None);
        if reply.status != StatusCode::ACCEPTED {
            return reply;
        }
        assert_eq!(reply.json()["done"], false);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

fn along(from_deg: [f64; 2], to_deg: [f64; 2], corridor_m: f64) -> Value {
    json!({"route": {"type": "LineString", "coordinates": [from_deg, to_deg]}, "corridor_m": corridor_m})
}

#[test]
fn the_file_is_that_of_the_command_and_comes_in_ranges() {
    let app = service(Service::Preflight);
    let asked = along([15.6053, 48.4961], [15.6120, 48.4961], 300.0);
    let begun = post(&app, &asked);
    assert_eq!(begun.status, StatusCode::ACCEPTED, "{}", begun.json());
    let place = begun.headers[LOCATION].to_str().unwrap().to_owned();
    assert_eq!(place, format!("/v1/exports/{}", begun.json()["id"].as_str().unwrap()));
    let whole = fetched(&app, &place);
    assert_eq!(
        (whole.status, &whole.headers[CONTENT_TYPE]),
        (StatusCode::OK, &"application/geopackage+sqlite3".parse().unwrap())
    );

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flight.gpkg");
    let exported = export_to(drawn_store(), &drawn_request(), &path);
    assert!(whole.body == std::fs::read(&path).unwrap(), "other bytes than the command's");
    assert_eq!(whole.headers[ETAG], format!("\"{}\"", exported.file_digest));

    let len = whole.body.len();
    for (range, from, to) in [
        ("bytes=0-99", 0, 100),
        ("bytes=16000-16999", 16_000, 17_000),
        ("bytes=-500", len - 500, len),
        (&format!("bytes={}-", len - 7), len - 7, len),
    ] {
        let part = get(&app, &place, Some(range));
        assert_eq!(part.status, StatusCode::PARTIAL_CONTENT, "{range}");
        assert!(part.body == whole.body[from..to], "{range}");
        assert_eq!(part.headers[CONTENT_RANGE], format!("bytes {from}-{}/{len}", to - 1));
    }
    assert_eq!(get(&app, &place, Some(&format!("bytes={len}-"))).status, StatusCode::RANGE_NOT_SATISFIABLE);
    let beyond = get(&app, &place, Some(&format!("bytes={len}-")));
    assert_eq!(beyond.headers[CONTENT_RANGE], format!("bytes */{len}"));
    // A range of another file than the one begun is the whole; one seen before is not sent again.
    let with = |name: HeaderName, value: String| {
        let request = Request::get(&place).header(RANGE, "bytes=0-5").header(name, value);
        send(&app, request.body(Body::empty()).unwrap())
    };
    let etag = format!("\"{}\"", exported.file_digest);
    assert_eq!(with(IF_RANGE, etag.clone()).body.len(), 6);
    assert_eq!(with(IF_RANGE, "\"another\"".into()).body.len(), len);
    assert_eq!(with(IF_NONE_MATCH, etag).status, StatusCode::NOT_MODIFIED);
    // Asked for again, in other words, it is there already.
    let mut other = asked.clone();
    other["route"]["bbox"] = json!([15.6, 48.4, 15.7, 48.5]);
    let again = post(&app, &other);
    assert_eq!((again.status, &again.headers[LOCATION]), (StatusCode::OK, &place.parse().unwrap()));
    assert_eq!(again.json()["done"], true);
}

#[test]
fn what_cannot_be_exported_is_told_without_the_servers_paths() {
    let app = service(Service::Preflight);
    let nowhere = post(&app, &along([1.0, 1.0], [1.1, 1.0], 300.0));
    assert_eq!(nowhere.status, StatusCode::ACCEPTED);
    let failed = fetched(&app, nowhere.headers[LOCATION].to_str().unwrap());
    assert_eq!((failed.status.as_u16(), failed.code()), (422, "no_tile_in_corridor".into()));
    assert!(!String::from_utf8_lossy(&failed.body).contains(drawn_store().path().to_str().unwrap()));
    // What failed is tried anew.
    assert_eq!(post(&app, &along([1.0, 1.0], [1.1, 1.0], 300.0)).status, StatusCode::ACCEPTED);

    let good = along([15.6053, 48.4961], [15.6120, 48.4961], 300.0);
    let with = |key: &str, value: Value| {
        let mut body = good.clone();
        body[key] = value;
        body
    };
    for (body, status, code) in [
        (json!({"corridor_m": 1.0}), 400, "request_not_valid"),
        (json!([1, 2]), 400, "request_not_valid"),
        (with("route", json!("south")), 400, "parameter_out_of_range"),
        (with("corridor_m", json!(-1.0)), 400, "parameter_out_of_range"),
        (with("jpeg_quality", json!(0)), 400, "parameter_out_of_range"),
        (with("valid_until", json!("soon")), 400, "parameter_out_of_range"),
        (with("valid_until", json!("2020-01-01")), 400, "parameter_out_of_range"),
        (with("serial", json!(-1)), 400, "parameter_out_of_range"),
        (with("serial", json!(1u64 << 63)), 400, "request_not_valid"),
        (with("max_bytes", json!(-1)), 400, "parameter_out_of_range"),
        (with("layers", json!(["none"])), 404, "no_such_layer"),
        (with("sign", json!("ground.key")), 400, "request_not_valid"),
    ] {
        let reply = post(&app, &body);
        assert_eq!((reply.status.as_u16(), reply.code()), (status, code.into()), "{body}");
        assert_eq!(reply.headers[CONTENT_TYPE], "application/problem+json");
    }
    assert_eq!(get(&app, "/v1/exports/none", None).code(), "no_such_export");
    assert_eq!(get(&app, "/v1/exports/..%2f..%2fetc%2fpasswd", None).code(), "no_such_export");
}

#[test]
fn onboard_there_is_no_such_route() {
    let app = service(Service::Onboard);
    let reply = post(&app, &along([15.6053, 48.4961], [15.6120, 48.4961], 300.0));
    assert_eq!((reply.status.as_u16(), reply.code()), (404, "no_such_route".into()));
    assert!(String::from_utf8_lossy(&reply.body).contains("on the ground only"));
    let api = get(&app, "/openapi.json", None).json();
    assert!(api["paths"].as_object().unwrap().keys().all(|path| !path.contains("export")), "{api}");
    let ground = get(&service(Service::Preflight), "/openapi.json", None).json();
    assert!(ground["paths"]["/v1/exports"]["post"].is_object());
}

fn delete(app: &Router, path: &str) -> Reply {
    send(app, Request::delete(path).body(Body::empty()).unwrap())
}

/// Exports the surroundings of a place, and returns where the file is.
fn exported(app: &Router, longitude_deg: f64) -> String {
    let begun = post(app, &along([longitude_deg, 48.4961], [longitude_deg + 0.001, 48.4961], 200.0));
    let place = begun.headers[LOCATION].to_str().unwrap().to_owned();
    assert_eq!(fetched(app, &place).status, StatusCode::OK);
    place
}

/// The places of all exports, the one begun first first.
fn listed(app: &Router) -> Vec<String> {
    let list = get(app, "/v1/exports", None).json();
    list.as_array().unwrap().iter().map(|entry| format!("/v1/exports/{}", entry["id"].as_str().unwrap())).collect()
}

#[test]
fn exports_are_listed_and_deleted() {
    let app = service(Service::Preflight);
    assert_eq!(get(&app, "/v1/exports", None).json(), json!([]));
    let place = exported(&app, 15.6053);
    let failed = post(&app, &along([1.0, 1.0], [1.1, 1.0], 300.0));
    fetched(&app, failed.headers[LOCATION].to_str().unwrap());
    let list = get(&app, "/v1/exports", None).json();
    assert_eq!(list[0]["bytes"], get(&app, &place, None).body.len());
    assert_eq!((&list[0]["done"], &list[0]["error"]), (&json!(true), &json!(null)), "{list}");
    assert_eq!((&list[1]["bytes"], &list[1]["error"]), (&json!(null), &json!("no_tile_in_corridor")), "{list}");
    assert!(list[0]["age_s"].as_f64().unwrap() >= 0.0);
    assert_eq!(delete(&app, &place).status, StatusCode::NO_CONTENT);
    assert_eq!(get(&app, &place, None).code(), "no_such_export");
    assert_eq!(delete(&app, &place).code(), "no_such_export");
    assert_eq!(listed(&app).len(), 1);
}

#[test]
fn exports_are_bounded_in_number_bytes_and_age() {
    let few = keeping(Service::Preflight, ExportLimits { count: 2, ..ExportLimits::default() });
    let places = [15.6053, 15.6153, 15.6203].map(|longitude_deg| exported(&few, longitude_deg));
    assert_eq!(listed(&few), places[1..]);

    let bytes = get(&few, &places[2], None).body.len() as u64;
    // Room for one of them and a half.
    let small = keeping(Service::Preflight, ExportLimits { bytes: bytes * 3 / 2, ..ExportLimits::default() });
    exported(&small, 15.6153);
    let last = exported(&small, 15.6203);
    assert_eq!(listed(&small), [last]);
    let tiny = keeping(Service::Preflight, ExportLimits { bytes: 1000, ..ExportLimits::default() });
    let begun = post(&tiny, &along([15.6053, 48.4961], [15.6120, 48.4961], 300.0));
    let refused = fetched(&tiny, begun.headers[LOCATION].to_str().unwrap());
    assert_eq!((refused.status.as_u16(), refused.code()), (422, "export_too_large".into()));

    let brief = keeping(Service::Preflight, ExportLimits { age: Duration::from_millis(1), ..ExportLimits::default() });
    let begun = post(&brief, &along([15.6053, 48.4961], [15.6120, 48.4961], 300.0));
    let place = begun.headers[LOCATION].to_str().unwrap().to_owned();
    let start = Instant::now();
    // Until it is removed the answer may be its progress or its file.
    while get(&brief, &place, None).status != StatusCode::NOT_FOUND {
        assert!(start.elapsed() < Duration::from_secs(120), "the export is still kept");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_dry_run_says_what_would_be_exported_and_writes_nothing() {
    let app = service(Service::Preflight);
    let mut asked = along([15.6053, 48.4961], [15.6120, 48.4961], 300.0);
    asked["dry_run"] = json!(true);
    let reply = post(&app, &asked);
    assert_eq!(reply.status, StatusCode::OK);
    let would = preview(&Reader::open(drawn_store().path()).unwrap(), &drawn_request()).unwrap();
    let (json, expected) = (reply.json(), serde_json::to_value(&would).unwrap());
    assert_eq!(json["dry_run"], true);
    for key in ["parts", "bytes", "coverage", "widest_m"] {
        assert_eq!(json[key], expected[key], "{key}");
    }
    assert_eq!(get(&app, "/v1/exports", None).json(), json!([]));
    let mut nowhere = along([1.0, 1.0], [1.1, 1.0], 300.0);
    nowhere["dry_run"] = json!(true);
    assert_eq!(post(&app, &nowhere).code(), "no_tile_in_corridor");
}

#[test]
fn what_a_killed_service_left_is_removed_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let temporary = folder.path().join("tmp");
    std::fs::create_dir(&temporary).unwrap();
    let start = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
        command
            .arg("serve")
            .arg("--db")
            .arg(drawn_store().path())
            .args(["--listen", "127.0.0.1:0"])
            .env("TMPDIR", &temporary);
        ServedStore::start_command(command, &folder.path().join("log")).unwrap()
    };
    let folders = || -> Vec<_> { std::fs::read_dir(&temporary).unwrap().map(|entry| entry.unwrap().path()).collect() };
    let killed = start();
    let left = folders();
    assert_eq!(left.len(), 1);
    std::fs::write(left[0].join("half.gpkg.overfly-new"), b"half").unwrap();
    // Dropped, it is killed.
    drop(killed);
    assert_eq!(folders(), left);
    let _service = start();
    assert_eq!(folders().len(), 1);
    assert!(!left[0].exists());
}
