//! `POST /v1/fixes` with `hints`: what the request states wrongly is named, within the time allowed, and a hint is no fix.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE};
use overfly::server::{Limits, Service, ServiceState, router};
use overfly_ingest::build;
use overfly_store::Reader;
use overfly_testkit::drawn::{drawn_store, project};
use overfly_testkit::soak::client::post;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tower::ServiceExt;

/// The drawn landscape in the layer `ortho`, and a place far away in the layer `far`.
fn two_layers(folder: &Path) -> PathBuf {
    let db = folder.join("map.gpkg");
    std::fs::copy(drawn_store().path(), &db).unwrap();
    let sources = vec![project("tests/fixtures/degrees.tif")];
    let request =
        build::Request { db: db.clone(), layer: "far".into(), sources, threads: 2, ..build::Request::default() };
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    db
}

fn service(db: &Path, service: Service) -> Router {
    let (store, limits) = match service {
        Service::Preflight => (Reader::open(db).unwrap(), Limits::default()),
        Service::Onboard => (Reader::open_onboard(db).unwrap(), Limits::within(256_000_000)),
    };
    // Time for slow machines.
    let limits = Limits { answer_time: Duration::from_secs(400), hints_time: Duration::from_secs(120), ..limits };
    router(ServiceState::new(store, service, Limits { registrations: 1, ..limits }))
}

/// A request for the drawn frame 19, right but for `changes`.
fn asked(changes: Value) -> Request<Body> {
    let mut request = json!({
        "layer": "ortho", "latitude_deg": 48.4915, "longitude_deg": 15.6160, "sigma_m": 200, "heading_deg": 271.6,
        "height_m": 500.4, "hints": true, "hints_limit_s": 120,
        "camera": {"width_px": 320, "height_px": 240, "focal_length_px": 400, "principal_point_px": [161.3, 118.9],
                   "distortion": [-0.06, 0.015, 0.0004, -0.0003, 0.0]},
    });
    for (name, value) in changes.as_object().unwrap() {
        request[name] = value.clone();
    }
    let frame = std::fs::read(project("tiles/flight/frames/019.jpg")).unwrap();
    let whole = post("/v1/fixes", &[("image", &frame), ("request", request.to_string().as_bytes())]);
    let head = whole.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
    let kind = "multipart/form-data; boundary=b";
    let body = whole[head + 4..].to_vec();
    let request = Request::post("/v1/fixes").header(CONTENT_TYPE, kind).header(CONTENT_LENGTH, body.len());
    request.body(Body::from(body)).unwrap()
}

async fn answer(app: Router, request: Request<Body>) -> Value {
    let response = app.oneshot(request).await.unwrap();
    serde_json::from_slice(&to_bytes(response.into_body(), 1 << 20).await.unwrap()).unwrap()
}

fn wait<T>(asking: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap().block_on(asking)
}

#[test]
fn hints_name_the_wrong_statement_and_are_no_fix() {
    let folder = tempfile::tempdir().unwrap();
    let db = two_layers(folder.path());
    for app in [service(&db, Service::Preflight), service(&db, Service::Onboard)] {
        for (changes, kind, words) in [
            (json!({"heading_deg": 1.6}), "heading", ", not 1.6: check heading_deg"),
            (json!({"heading_deg": 4.74}), "heading_in_radians", "not 4.74: heading_deg looks like radians"),
            (json!({"height_m": 1641}), "height_in_feet", "not 1641 m: height_m looks like feet (ratio 3.28)"),
            (json!({"layer": "far"}), "layer", "matches in the layer ortho: try layer ortho"),
        ] {
            let said = wait(answer(app.clone(), asked(changes.clone())));
            assert_eq!(said["status"], "no_fix", "{changes}: {said}");
            let hint = &said["hints"][0];
            assert_eq!(hint["kind"], kind, "{changes}: {said}");
            assert!(hint["message"].as_str().unwrap().contains(words), "{changes}: {said}");
            for position in ["latitude_deg", "longitude_deg", "image_centre", "covariance_m2"] {
                assert!(said[position].is_null() && hint[position].is_null(), "{position}: {said}");
            }
        }
        let right = wait(answer(app.clone(), asked(json!({}))));
        assert!(right["status"] == "fix" && right["hints"].is_null(), "{right}");
    }
}

#[test]
fn hints_are_searched_only_where_they_are_asked_for_and_within_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let db = two_layers(folder.path());
    let app = service(&db, Service::Onboard);
    let unasked = wait(answer(app.clone(), asked(json!({"heading_deg": 1.6, "hints": false, "hints_limit_s": null}))));
    assert!(unasked["status"] == "no_fix" && unasked["hints"].is_null(), "{unasked}");
    let none = wait(answer(app.clone(), asked(json!({"heading_deg": 1.6, "hints_limit_s": 0}))));
    assert_eq!((&none["hints"], &none["hints_complete"]), (&json!([]), &json!(false)), "{none}");
    for (changes, words) in [
        (json!({"hints": false}), "needs hints = true"),
        (json!({"hints_limit_s": 121}), "must be in [0, 120]"),
        (json!({"hints_limit_s": -1}), "must be in [0, 120]"),
    ] {
        let refused = wait(answer(app.clone(), asked(changes)));
        assert_eq!(
            (&refused["code"], &refused["parameter"]),
            (&json!("parameter_out_of_range"), &json!("hints_limit_s"))
        );
        assert!(refused["detail"].as_str().unwrap().contains(words), "{refused}");
    }
    // A search of the whole layer with a wrong scale finds nothing for a long time.
    let hopeless =
        json!({"latitude_deg": null, "longitude_deg": null, "sigma_m": null, "height_m": 5_000, "hints_limit_s": 0.05});
    let start = Instant::now();
    let said = wait(answer(app, asked(hopeless)));
    let elapsed = start.elapsed().as_secs_f64() - said["elapsed_ms"].as_f64().unwrap() / 1e3;
    assert_eq!((&said["status"], &said["hints_complete"]), (&json!("no_fix"), &json!(false)), "{said}");
    assert!(elapsed < 5.0, "the hints took {elapsed} s: {said}");
}

#[test]
fn hints_end_when_a_fix_waits_for_its_turn() {
    let folder = tempfile::tempdir().unwrap();
    let db = two_layers(folder.path());
    let app = service(&db, Service::Onboard);
    // Without a heading, only other layers and scales are tried.
    let slow = json!({"heading_deg": null, "height_m": 3_000, "sigma_m": 2_000});
    let (hinted, fixes, waited) = wait(async {
        let hinted = tokio::spawn(answer(app.clone(), asked(slow)));
        let mut fixes = Vec::new();
        let start = Instant::now();
        while !hinted.is_finished() && start.elapsed() < Duration::from_secs(100) {
            fixes.push(answer(app.clone(), asked(json!({"hints": false, "hints_limit_s": null}))).await);
        }
        (hinted.await.unwrap(), fixes, start.elapsed())
    });
    assert_eq!(hinted["status"], "no_fix", "{hinted}");
    assert_eq!(hinted["hints_complete"], false, "{hinted}");
    assert!(fixes.iter().all(|fix| fix["status"] == "fix"), "{fixes:?}");
    assert!(waited < Duration::from_secs(60), "{waited:?}");
}
