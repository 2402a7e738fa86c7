//! A store that is built anew or replaced under the service is served from the next request on; what is broken or not proved is not.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, Request};
use overfly::server::{Limits, Service, ServiceState, StoreRefusal, router};
use overfly_core::tile::TileId;
use overfly_ingest::export::ExportRequest;
use overfly_store::Reader;
use overfly_store::package::{SecretKey, generate};
use overfly_testkit::drawn::drawn_store;
use overfly_testkit::soak::client::ServedStore;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tower::ServiceExt;

struct Reply {
    status: u16,
    headers: HeaderMap,
    text: String,
}

impl Reply {
    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.text).unwrap_or_else(|e| panic!("{e}: {}", self.text))
    }
}

fn get(app: &Router, path: &str) -> Reply {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    runtime.block_on(async {
        let response = app.clone().oneshot(Request::get(path).body(Body::empty()).unwrap()).await.unwrap();
        let (parts, body) = response.into_parts();
        let bytes = to_bytes(body, 1 << 24).await.unwrap();
        Reply {
            status: parts.status.as_u16(),
            headers: parts.headers,
            text: String::from_utf8_lossy(&bytes).into_owned(),
        }
    })
}

/// A service over the store at `path`, which it opens anew.
fn service(path: &Path) -> Router {
    let again = path.to_owned();
    let reopen = move || match Reader::open(&again) {
        Ok(store) => Ok((store, vec!["opened again".to_owned()])),
        Err(error) => Err(StoreRefusal { code: error.code(), reason: "it is broken".to_owned() }),
    };
    let state = ServiceState::new(Reader::open(path).unwrap(), Service::Preflight, Limits::default());
    router(state.with_reopening(reopen))
}

/// A store of one tile, made beside `path`.
fn made(path: &Path, layer: &str, seed: u8) -> PathBuf {
    let made = path.with_extension(format!("{layer}{seed}"));
    super::store::store_of(&made, layer, &[TileId::new(3, 1, 1).unwrap()], seed);
    made
}

/// Asks until the status is the expected one.
fn until(status: u16, mut ask: impl FnMut() -> Reply) -> Reply {
    let start = Instant::now();
    loop {
        let reply = ask();
        if reply.status == status {
            return reply;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "{}: {}", reply.status, reply.text);
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_store_that_was_replaced_is_served_from_the_next_request_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    std::fs::rename(made(&path, "ortho", 1), &path).unwrap();
    let app = service(&path);
    let first = get(&app, "/v1/store").json()["digest"].as_str().unwrap().to_owned();
    let health = get(&app, "/healthz");
    assert_eq!((health.text.as_str(), &health.headers["overfly-store-digest"]), ("ok\n", &first.parse().unwrap()));

    std::fs::rename(made(&path, "ortho", 2), &path).unwrap();
    let store = get(&app, "/v1/store").json();
    assert_ne!(store["digest"], first);
    assert!(store["health"]["reopened_s"].as_f64().unwrap() >= 0.0, "{store}");
    assert_eq!(store["health"]["warnings"], serde_json::json!(["opened again"]));
    let health = get(&app, "/healthz");
    let digest = store["digest"].as_str().unwrap();
    assert_eq!(health.headers["overfly-store-digest"], digest);
    assert!(health.text.contains(&format!("reopened: 0 s ago, digest {digest}\n")), "{}", health.text);
    assert_eq!(get(&app, "/readyz").status, 200);

    // A build in the same file.
    super::store::store_of(&path, "other", &[TileId::new(3, 2, 2).unwrap()], 3);
    assert_eq!(get(&app, "/v1/layers").json().as_array().unwrap().len(), 2);
}

#[test]
fn a_broken_store_is_not_served_and_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    std::fs::rename(made(&path, "ortho", 1), &path).unwrap();
    let app = service(&path);
    let (good, broken) = (made(&path, "ortho", 2), folder.path().join("broken"));
    std::fs::write(&broken, "no store at all").unwrap();
    for is_removed in [false, true] {
        if is_removed {
            std::fs::remove_file(&path).unwrap();
        } else {
            std::fs::rename(&broken, &path).unwrap();
        }
        for asked in ["/v1/store", "/v1/layers", "/readyz", "/v1/store"] {
            let reply = get(&app, asked);
            let json = reply.json();
            assert_eq!((reply.status, json["code"].as_str()), (503, Some("store_changed")), "{asked}: {json}");
            assert!(json["detail"].as_str().unwrap().contains("it is broken"), "{json}");
        }
        let health = get(&app, "/healthz");
        assert!(health.status == 200 && health.text.starts_with("degraded\n"), "{}", health.text);
        assert!(health.text.contains("it is broken"), "{}", health.text);
        std::fs::copy(&good, &path).unwrap();
        until(200, || get(&app, "/v1/store"));
        assert!(!get(&app, "/healthz").text.contains("degraded"));
    }
}

#[test]
fn onboard_only_what_the_key_signed_takes_the_place_of_the_store() {
    let folder = tempfile::tempdir().unwrap();
    let key = |name: &str| {
        let secret = folder.path().join(name);
        let (public, _) = generate(&secret).unwrap();
        (secret, public)
    };
    let ((ground, public), (other, _)) = (key("ground"), key("other"));
    let export = |name: &str, corridor_m: f64, key: Option<&Path>, serial: u64| {
        let key = key.map(|path| SecretKey::read(path).unwrap());
        let out = folder.path().join(name);
        let request = ExportRequest { key, corridor_m, serial: Some(serial), ..crate::export::drawn_request() };
        let digest = crate::export::export_to(drawn_store(), &request, &out).digest;
        (out, digest)
    };
    let (served, first) = export("served.gpkg", 200.0, Some(&ground), 8);
    let arguments = ["--require-signature".to_owned(), public.display().to_string()];
    let program = Path::new(env!("CARGO_BIN_EXE_overfly"));
    let service = ServedStore::start(program, &served, &arguments, &folder.path().join("log")).unwrap();
    let ask = |path: &str| {
        let reply = service.client().get(path).unwrap();
        Reply { status: reply.status, headers: HeaderMap::new(), text: String::from_utf8(reply.body).unwrap() }
    };
    assert_eq!(ask("/v1/store").json()["digest"], first);
    for (name, key, serial, code) in [
        ("unsigned.gpkg", None, 9, "unsigned_store"),
        ("foreign.gpkg", Some(other.as_path()), 9, "wrong_key"),
        ("older.gpkg", Some(ground.as_path()), 7, "older_serial"),
    ] {
        let (path, _) = export(name, 250.0, key, serial);
        std::fs::rename(path, &served).unwrap();
        let refused = until(503, || ask("/v1/store"));
        let text = until(503, || ask("/readyz")).text;
        assert!(refused.text.contains("store_changed"), "{}", refused.text);
        assert!(!text.contains(folder.path().to_str().unwrap()), "{text}");
        assert_eq!(ask("/healthz").status, 200);
        // The reason is that of the newest file, once it has been looked at.
        let start = Instant::now();
        while !ask("/v1/store").text.contains(&format!("({code})")) {
            assert!(start.elapsed() < Duration::from_secs(60), "{}", ask("/v1/store").text);
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    let (path, second) = export("new.gpkg", 1_500.0, Some(&ground), 8);
    std::fs::rename(path, &served).unwrap();
    let store = until(200, || ask("/v1/store")).json();
    assert_eq!(store["digest"], second);
    assert_ne!(first, second);
    assert!(ask("/healthz").text.contains(&second));
}

#[test]
fn a_store_that_is_copied_over_with_an_equal_change_counter_has_changed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    std::fs::rename(made(&path, "ortho", 1), &path).unwrap();
    let reader = Reader::open(&path).unwrap();
    let new = std::fs::read(made(&path, "ortho", 2)).unwrap();
    let change_counter = |bytes: &[u8]| bytes[24..28].to_vec();
    assert_eq!(change_counter(&std::fs::read(&path).unwrap()), change_counter(&new), "SQLite sees no change");
    std::thread::sleep(Duration::from_millis(20));
    let mut file = std::fs::File::options().write(true).open(&path).unwrap();
    file.write_all(&new).unwrap();
    assert_eq!(reader.check_unchanged().unwrap_err().code(), "store_changed");
}

#[test]
fn a_store_that_is_copied_over_is_opened_only_when_all_of_it_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    std::fs::rename(made(&path, "ortho", 1), &path).unwrap();
    let new = std::fs::read(made(&path, "ortho", 2)).unwrap();
    let (again, whole, opened) = (path.clone(), new.len() as u64, Arc::new(AtomicUsize::new(0)));
    let count = opened.clone();
    let reopen = move || {
        count.fetch_add(1, Ordering::Relaxed);
        assert_eq!(std::fs::metadata(&again).unwrap().len(), whole, "half a copy is opened");
        Reader::open_proved(&again)
            .map(|store| (store, Vec::new()))
            .map_err(|error| StoreRefusal { code: error.code(), reason: error.to_string() })
    };
    let state = ServiceState::new(Reader::open(&path).unwrap(), Service::Preflight, Limits::default());
    let app = router(state.with_reopening(reopen));
    let first = get(&app, "/v1/store").json()["digest"].as_str().unwrap().to_owned();
    std::thread::scope(|scope| {
        let copying = scope.spawn(|| {
            // As `cp` does: the same file, cut to nothing and written again.
            let mut file = std::fs::File::create(&path).unwrap();
            for part in new.chunks(new.len().div_ceil(30)) {
                file.write_all(part).unwrap();
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        let mut statuses = Vec::new();
        while !copying.is_finished() {
            let reply = get(&app, "/v1/store");
            let json = reply.json();
            if reply.status == 503 {
                assert_eq!(json["code"], "store_changed", "{json}");
            } else {
                assert_eq!((reply.status, json["digest"].as_str()), (200, Some(first.as_str())), "{json}");
            }
            statuses.push(reply.status);
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(statuses.contains(&503), "{statuses:?}");
    });
    let store = until(200, || get(&app, "/v1/store")).json();
    assert_ne!(store["digest"], first.as_str());
    assert_eq!(opened.load(Ordering::Relaxed), 1);
}
