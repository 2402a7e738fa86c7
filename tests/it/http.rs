//! The service answers as DESIGN names it, and hostile requests get a problem document, never a 5xx, never a crash.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::header::{CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{Method, Request, StatusCode};
use overfly::server::{Limits, Service, ServiceState, router};
use overfly_core::tile::TileId;
use overfly_store::Reader;
use serde_json::Value;
use std::io::Cursor;
use std::time::Duration;
use tower::ServiceExt;

const BOUNDARY: &str = "x-overfly-boundary";
const ZOOM: u8 = 15;
const COLUMN: u32 = 17_000;
const ROW: u32 = 11_000;

/// A router over a small store; the folder lives as long as it.
pub struct Stand {
    folder: tempfile::TempDir,
    app: Router,
}

/// An answer, read whole.
pub struct Reply {
    status: StatusCode,
    headers: axum::http::HeaderMap,
    body: Vec<u8>,
}

impl Reply {
    /// The body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {:?}", String::from_utf8_lossy(&self.body)))
    }

    /// Checks that this is a whole problem document with a 4xx status, and returns its code and parameter.
    pub fn problem(&self) -> (u16, String, Option<String>) {
        assert!(self.status.is_client_error(), "{}: {}", self.status, String::from_utf8_lossy(&self.body));
        assert_eq!(self.headers[CONTENT_TYPE], "application/problem+json");
        let json = self.json();
        assert_eq!(json["status"], self.status.as_u16());
        for key in ["type", "title", "code", "detail"] {
            assert!(json[key].as_str().is_some_and(|s| !s.is_empty()), "{key} in {json}");
        }
        let parameter = json["parameter"].as_str().map(str::to_owned);
        (self.status.as_u16(), json["code"].as_str().unwrap().to_owned(), parameter)
    }
}

impl Stand {
    /// A service on the ground.
    pub fn new() -> Self {
        Self::with(Service::Preflight, Limits::default())
    }

    /// A service of a kind, within limits.
    pub fn with(service: Service, limits: Limits) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.gpkg");
        let tiles: Vec<TileId> = (0..16).map(|i| TileId::new(ZOOM, COLUMN + i % 4, ROW + i / 4).unwrap()).collect();
        super::store::store_of(&path, "ortho", &tiles, 3);
        let store = match service {
            Service::Preflight => Reader::open(&path).unwrap(),
            Service::Onboard => Reader::open_onboard(&path).unwrap(),
        };
        Self { folder, app: router(ServiceState::new(store, service, limits)) }
    }

    /// A service on the ground over any store.
    pub fn over(store: Reader) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Self { folder, app: router(ServiceState::new(store, Service::Preflight, Limits::default())) }
    }

    /// The answer to a request.
    pub fn send(&self, request: Request<Body>) -> Reply {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.block_on(async {
            let response = self.app.clone().oneshot(request).await.unwrap();
            let (parts, body) = response.into_parts();
            Reply { status: parts.status, headers: parts.headers, body: to_bytes(body, 1 << 28).await.unwrap().into() }
        })
    }

    /// The answer to a GET.
    pub fn get(&self, path: &str) -> Reply {
        self.send(Request::get(path).body(Body::empty()).unwrap())
    }

    /// The answer to a form.
    pub fn post(&self, path: &str, parts: &[(&str, &[u8])]) -> Reply {
        let content_type = format!("multipart/form-data; boundary={BOUNDARY}");
        self.send(Request::post(path).header(CONTENT_TYPE, content_type).body(Body::from(form(parts))).unwrap())
    }
}

fn form(parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (name, bytes) in parts {
        body.extend(format!("--{BOUNDARY}\r\ncontent-disposition: form-data; name=\"{name}\"\r\n\r\n").into_bytes());
        body.extend_from_slice(bytes);
        body.extend_from_slice(b"\r\n");
    }
    body.extend(format!("--{BOUNDARY}--\r\n").into_bytes());
    body
}

/// A frame.
pub fn png(width_px: u32, height_px: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let image = image::GrayImage::from_fn(width_px, height_px, |x, y| image::Luma([((x * 7) ^ (y * 13)) as u8]));
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn centre() -> (f64, f64) {
    let c = TileId::new(ZOOM, COLUMN + 1, ROW + 1).unwrap().centre();
    (c.latitude_deg(), c.longitude_deg())
}

/// A complete question, with parameters replaced (`Some`) or left out (`None`).
pub fn question(changes: &[(&str, Option<&str>)]) -> String {
    let (latitude, longitude) = centre();
    let mut parameters: Vec<(String, String)> = [
        ("latitude_deg", latitude.to_string().as_str()),
        ("longitude_deg", longitude.to_string().as_str()),
        ("heading_deg", "30"),
        ("across_m", "600"),
        ("along_m", "400"),
        ("inaccuracy_m", "50"),
        ("drift_m", "100"),
    ]
    .map(|(n, v)| (n.to_owned(), v.to_owned()))
    .into();
    for (name, value) in changes {
        parameters.retain(|(n, _)| n != name);
        parameters.extend(value.map(|v| ((*name).to_owned(), v.to_owned())));
    }
    let pairs: Vec<String> = parameters.iter().map(|(n, v)| format!("{n}={v}")).collect();
    format!("/v1/candidates?{}", pairs.join("&"))
}

#[test]
fn candidates_have_the_names_of_the_design() {
    let stand = Stand::new();
    let reply = stand.get(&question(&[]));
    assert_eq!(reply.status, StatusCode::OK);
    let json = reply.json();
    let keys: Vec<&str> = json.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, ["containment", "estimated_s", "nominal_count", "region", "tiles"]);
    assert!((json["nominal_count"].as_f64().unwrap() - 850.0 * 650.0 / (600.0 * 400.0)).abs() < 1e-9);
    assert_eq!(json["region"]["type"], "Polygon");
    let ring = json["region"]["coordinates"][0].as_array().unwrap();
    assert_eq!(ring.first(), ring.last());
    let best = &json["tiles"][0];
    let keys: BTreeSetOf = best.as_object().unwrap().keys().cloned().collect();
    let expected = [
        "id",
        "layer",
        "z",
        "x",
        "y",
        "bounds_deg",
        "probability",
        "valid_fraction",
        "keypoints",
        "distinctiveness",
        "gsd_m_per_px",
        "acquired",
    ];
    assert_eq!(keys, expected.map(str::to_owned).into());
    assert_eq!((best["z"].as_u64(), best["x"].as_u64()), (Some(ZOOM.into()), Some(u64::from(COLUMN) + 1)));
    assert!(json["containment"].as_f64().unwrap() > 0.999);
    let one = stand.get(&question(&[("max_tiles", Some("1"))])).json();
    assert_eq!(one["tiles"].as_array().unwrap().len(), 1);
}

type BTreeSetOf = std::collections::BTreeSet<String>;

#[test]
fn a_covariance_is_taken_instead_of_drift() {
    let changes = [
        ("inaccuracy_m", None),
        ("drift_m", None),
        ("sigma_east_m", Some("80")),
        ("sigma_north_m", Some("60")),
        ("correlation", Some("0.5")),
    ];
    let json = Stand::new().get(&question(&changes)).json();
    assert!(json["containment"].as_f64().unwrap() >= 0.997, "{json}");
}

const PARALLEL: [(&str, Option<&str>); 5] = [
    ("mode", Some("parallel")),
    ("drift_m", None),
    ("unit_drift_m", Some("5")),
    ("execution_s", Some("2")),
    ("relative_s", Some("0.1")),
];

const COMBINED: [(&str, Option<&str>); 5] = [
    ("mode", Some("combined")),
    ("drift_m", None),
    ("speed_mps", Some("50")),
    ("execution_s", Some("4")),
    ("min_turn_radius_m", Some("300")),
];

#[test]
fn the_parallel_mode_is_the_sequential_one_with_its_drift() {
    let stand = Stand::new();
    let parallel = stand.get(&question(&PARALLEL)).json();
    // 2 s of relative registrations of 0.1 s, 5 m each.
    assert_eq!(parallel, stand.get(&question(&[("drift_m", Some("100"))])).json());
    assert!((parallel["nominal_count"].as_f64().unwrap() - 850.0 * 650.0 / (600.0 * 400.0)).abs() < 1e-9);
}

#[test]
fn the_combined_mode_looks_ahead_of_the_last_fix() {
    let stand = Stand::new();
    let json = stand.get(&question(&COMBINED)).json();
    // (28): 200 m of flight no tighter than 300 m, 600 m across, over one image.
    let swept_m2 = 2.0 * 200f64.powi(3) / 900.0 + 600.0 * 200.0;
    assert!((json["nominal_count"].as_f64().unwrap() - swept_m2 / 240_000.0).abs() < 1e-9);
    let longer = [&COMBINED[..], &[("execution_s", Some("60"))]].concat();
    assert!(stand.get(&question(&longer)).json()["nominal_count"].as_f64().unwrap() > 50.0, "by area from 300 m on");
    // The region lies about 200 m in the direction of the heading of the last fix.
    let mean = |json: &Value| {
        let ring = json["region"]["coordinates"][0].as_array().unwrap();
        let of = |k: usize| {
            let all: Vec<f64> = ring.iter().map(|p| p[k].as_f64().unwrap()).collect();
            let (low, high) = all.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
            (low + high) / 2.0
        };
        [of(0), of(1)]
    };
    let [_, north] = mean(&stand.get(&question(&[&COMBINED[..], &[("heading_deg", Some("0"))]].concat())).json());
    let [_, south] = mean(&stand.get(&question(&[&COMBINED[..], &[("heading_deg", Some("180"))]].concat())).json());
    let apart_m = (north - south) * 111_200.0;
    assert!((300.0..400.0).contains(&apart_m), "{apart_m}");
}

#[test]
fn each_mode_names_what_it_misses_and_what_it_does_not_take() {
    let stand = Stand::new();
    for (mode, needed, foreign) in [
        (&PARALLEL, &["inaccuracy_m", "unit_drift_m", "execution_s", "relative_s"][..], ["drift_m", "speed_mps"]),
        (
            &COMBINED,
            &["inaccuracy_m", "speed_mps", "execution_s", "min_turn_radius_m"][..],
            ["drift_m", "sigma_east_m"],
        ),
    ] {
        for &name in needed {
            let asked = |value| stand.get(&question(&[&mode[..], &[(name, value)]].concat()));
            let (status, code, parameter) = asked(None).problem();
            assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_missing", Some(name)));
            for value in ["NaN", "inf", "-1", "abc", "1e308", "-1e308"] {
                let reply = asked(Some(value));
                // As large as numbers go: a region too large, or straight flight, or no drift, never a crash.
                if value == "1e308" && reply.status == StatusCode::OK {
                    assert!(["min_turn_radius_m", "relative_s"].contains(&name), "{name}");
                    continue;
                }
                let (status, code, parameter) = reply.problem();
                assert_eq!(status, 400, "{name}={value}");
                assert!(
                    parameter.as_deref() == Some(name) || (value == "1e308" && code == "region_too_large"),
                    "{name}={value}: {code} {parameter:?}"
                );
            }
        }
        for name in needed.iter().filter(|name| !["inaccuracy_m", "unit_drift_m"].contains(name)) {
            let (status, code, parameter) = stand.get(&question(&[&mode[..], &[(name, Some("0"))]].concat())).problem();
            assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_out_of_range", Some(*name)));
        }
        for name in foreign {
            let (status, code, parameter) = stand.get(&question(&[&mode[..], &[(name, Some("3"))]].concat())).problem();
            assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_conflict", Some(name)));
        }
    }
}

#[test]
fn hostile_parameters_are_refused_by_name() {
    let stand = Stand::new();
    let numbers = ["latitude_deg", "longitude_deg", "heading_deg", "across_m", "along_m", "inaccuracy_m", "drift_m"];
    for name in numbers {
        for value in
            ["NaN", "nan", "inf", "-inf", "Infinity", "1e999", "", "abc", "1;2", "%00", "%ff", "1e308", "-1e308"]
        {
            let (status, code, parameter) = stand.get(&question(&[(name, Some(value))])).problem();
            assert_eq!(status, 400, "{name}={value}");
            assert!(
                parameter.as_deref() == Some(name) || code == "region_too_large",
                "{name}={value}: {code} {parameter:?}"
            );
        }
        let (status, code, parameter) = stand.get(&question(&[(name, None)])).problem();
        assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_missing", Some(name)));
        let repeated = format!("{}&{name}=1", question(&[]));
        let (status, code, parameter) = stand.get(&repeated).problem();
        assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_repeated", Some(name)));
    }
    for (name, value) in [
        ("latitude_deg", "85.06"),
        ("latitude_deg", "-90.1"),
        ("longitude_deg", "180.1"),
        ("heading_deg", "360"),
        ("heading_deg", "-1"),
        ("across_m", "0"),
        ("along_m", "-5"),
        ("inaccuracy_m", "-0.1"),
        ("drift_m", "-1"),
        ("drift_m", "1e7"),
        ("max_tiles", "0"),
        ("max_tiles", "-1"),
        ("max_tiles", "1.5"),
        ("max_tiles", "99999999999999999999999"),
        ("gsd_m_per_px", "0"),
        ("mode", "fast"),
        ("speed_mps", "3"),
        ("sigma_east_m", "3"),
        ("unknown", "3"),
        ("Latitude_deg", "3"),
    ] {
        let (status, code, parameter) = stand.get(&question(&[(name, Some(value))])).problem();
        assert_eq!(status, 400, "{name}={value}");
        let blamed = parameter.unwrap_or_default();
        assert!(
            blamed == name || code == "region_too_large" || name == "sigma_east_m",
            "{name}={value}: {code} {blamed}"
        );
    }
    assert_eq!(stand.get(&question(&[("layer", Some("none"))])).problem().1, "no_such_layer");
    let long = "x".repeat(20_000);
    assert_eq!(stand.get(&question(&[(&long, Some("1"))])).problem().0, 400);
}

#[test]
fn the_store_describes_itself() {
    let stand = Stand::new();
    let store = stand.get("/v1/store").json();
    assert_eq!(store["digest"].as_str().unwrap().len(), 64);
    assert_eq!(store["tiles"], 16);
    assert_eq!(store["layers"], stand.get("/v1/layers").json());
    assert_eq!(stand.get("/v1/layers").json()[0]["name"], "ortho");
    let coverage = stand.get("/v1/coverage");
    assert_eq!(coverage.headers[CONTENT_TYPE], "application/geo+json");
    let feature = &coverage.json()["features"][0];
    assert_eq!(
        (feature["geometry"]["type"].as_str(), feature["properties"]["tiles"].as_u64()),
        (Some("Polygon"), Some(16))
    );
    assert_eq!(stand.get("/v1/coverage?layer=none").problem().0, 404);
    assert_eq!(stand.get("/v1/store?x=1").problem().1, "parameter_unknown");
}

#[test]
fn tiles_are_cached_by_their_content() {
    let stand = Stand::new();
    let path = format!("/v1/tiles/ortho/{ZOOM}/{COLUMN}/{ROW}");
    let first = stand.get(&path);
    assert_eq!((first.status, first.headers[CONTENT_TYPE].to_str().unwrap()), (StatusCode::OK, "image/jpeg"));
    assert!(image::load_from_memory(&first.body).is_ok());
    let tag = first.headers[ETAG].clone();
    for (given, status) in [
        (tag.to_str().unwrap(), 304),
        ("*", 304),
        ("\"other\"", 200),
        (&format!("\"a\", W/{}", tag.to_str().unwrap()), 304),
    ] {
        let again = stand.send(Request::get(&path).header(IF_NONE_MATCH, given).body(Body::empty()).unwrap());
        assert_eq!(again.status.as_u16(), status, "{given}");
        assert_eq!(again.headers[ETAG], tag);
        assert_eq!(again.body.is_empty(), status == 304);
    }
    let tilejson = stand.get("/v1/tiles/ortho/tilejson.json").json();
    assert_eq!(
        (tilejson["tilejson"].as_str(), tilejson["tileSize"].as_u64(), tilejson["maxzoom"].as_u64()),
        (Some("3.0.0"), Some(512), Some(15))
    );
    let head = stand.send(Request::head(&path).body(Body::empty()).unwrap());
    assert_eq!((head.status, head.body.len()), (StatusCode::OK, 0));
}

#[test]
fn hostile_tile_names_are_refused() {
    let stand = Stand::new();
    for (path, status) in [
        ("ortho/15/17000/1", 404),
        ("none/15/17000/11000", 404),
        ("ortho/24/0/0", 400),
        ("ortho/300/0/0", 400),
        ("ortho/3/8/0", 400),
        ("ortho/-1/0/0", 400),
        ("ortho/x/0/0", 400),
        ("ortho/1/1e1/0", 400),
        ("ortho/1/+1/0", 400),
        ("ortho/1/0/99999999999999999999", 400),
        ("ortho/1/0/0.jpg", 400),
        ("%ff/1/0/0", 400),
        ("..%2f..%2fetc/1/0/0", 404),
        ("ortho%22;drop/1/0/0", 404),
        ("none/tilejson.json", 404),
        ("ortho/15/17000/11000/descriptors", 404),
        ("ortho/15/17000", 404),
    ] {
        assert_eq!(stand.get(&format!("/v1/tiles/{path}")).problem().0, status, "{path}");
    }
}

#[test]
fn a_client_that_accepts_only_bytes_gets_a_tile_as_such() {
    let stand = Stand::new();
    let accepting = |accepted: &str| {
        let path = format!("/v1/tiles/ortho/{ZOOM}/{COLUMN}/{ROW}");
        let request = Request::get(path).header("accept", accepted).body(Body::empty()).unwrap();
        let reply = stand.send(request);
        (
            reply.headers[CONTENT_TYPE].to_str().unwrap().to_owned(),
            reply.headers["vary"].to_str().unwrap().to_owned(),
            reply.body,
        )
    };
    let [image, bytes] = ["*/*", "application/octet-stream"].map(accepting);
    assert!(image.2 == bytes.2, "the same bytes");
    assert_eq!((&*image.0, &*bytes.0), ("image/jpeg", "application/octet-stream"));
    assert_eq!((&*image.1, &*bytes.1), ("accept", "accept"));
}

#[test]
fn unknown_paths_and_methods_get_a_problem_document() {
    let stand = Stand::new();
    assert_eq!(stand.get("/v2/candidates").problem().1, "no_such_route");
    assert_eq!(stand.get("/page/../Cargo.toml").problem().0, 404);
    for (method, path) in [
        (Method::PUT, "/v1/candidates"),
        (Method::GET, "/v1/fixes"),
        (Method::DELETE, "/v1/store"),
        (Method::PUT, "/v1/tiles/ortho/1/0/0"),
    ] {
        let reply = stand.send(Request::builder().method(method.clone()).uri(path).body(Body::empty()).unwrap());
        assert_eq!(reply.problem(), (405, "method_not_allowed".to_owned(), None), "{method} {path}");
    }
}

#[test]
fn no_route_writes() {
    for service in [Service::Preflight, Service::Onboard] {
        let stand = Stand::with(service, Limits::default());
        // Exports are no part of the store, and there are none onboard (`http_exports`).
        let exports = (service == Service::Onboard).then_some("/v1/exports");
        for path in exports.into_iter().chain(["/v1/builds", "/v1/layers", "/v1/tiles/ortho/15/17000/11000"]) {
            for method in [Method::POST, Method::PUT, Method::DELETE, Method::PATCH] {
                let reply = stand.send(Request::builder().method(method).uri(path).body(Body::empty()).unwrap());
                assert!(matches!(reply.problem().0, 404 | 405));
            }
        }
    }
}

const REQUEST: &[u8] = br#"{"gsd_m_per_px": 1.0}"#;

#[test]
fn hostile_forms_are_refused() {
    let stand = Stand::new();
    let frame = png(64, 48);
    let fixes = |parts: &[(&str, &[u8])]| stand.post("/v1/fixes", parts).problem();
    assert_eq!(fixes(&[("request", REQUEST)]).1, "part_missing");
    assert_eq!(fixes(&[("image", &frame), ("image", &frame), ("request", REQUEST)]).1, "part_repeated");
    assert_eq!(fixes(&[("image", &frame), ("picture", &frame)]).1, "part_unknown");
    for json in [
        "",
        "{",
        "[]",
        "null",
        "{\"gsd\": 1}",
        "{\"gsd_m_per_px\": \"1\"}",
        "{\"gsd_m_per_px\": NaN}",
        "{\"gsd_m_per_px\": 1e999}",
        "{\"gsd_m_per_px\": 1, \"gsd_m_per_px\": 2}",
    ] {
        let (status, code, _) = fixes(&[("image", &frame), ("request", json.as_bytes())]);
        assert_eq!((status, code.as_str()), (400, "request_not_valid"), "{json}");
    }
    let nested = "[".repeat(100_000);
    assert_eq!(fixes(&[("image", &frame), ("request", nested.as_bytes())]).0, 400);
    let (status, code, parameter) = fixes(&[("image", &frame), ("request", b"{\"gsd_m_per_px\": -1}")]);
    assert_eq!((status, code.as_str(), parameter.as_deref()), (400, "parameter_out_of_range", Some("gsd_m_per_px")));
    assert_eq!(fixes(&[("image", &frame), ("request", br#"{"gsd_m_per_px": 1, "layer": "none"}"#)]).1, "no_such_layer");
    assert_eq!(stand.post("/v1/motions", &[("image_a", &frame)]).problem().1, "part_missing");
    let plain =
        stand.send(Request::post("/v1/fixes").header(CONTENT_TYPE, "text/plain").body(Body::from("x")).unwrap());
    assert_eq!(plain.problem().0, 415);
    let none = stand.send(Request::post("/v1/fixes").body(Body::empty()).unwrap());
    assert_eq!(none.problem().0, 415);
    let mut cut = form(&[("image", &frame), ("request", REQUEST)]);
    cut.truncate(cut.len() / 2);
    let content_type = format!("multipart/form-data; boundary={BOUNDARY}");
    let cut = stand.send(Request::post("/v1/fixes").header(CONTENT_TYPE, content_type).body(Body::from(cut)).unwrap());
    assert_eq!(cut.problem().1, "body_broken");
}

#[test]
fn what_is_not_an_image_or_damaged_is_refused() {
    let stand = Stand::new();
    let fixes = |image: &[u8]| stand.post("/v1/fixes", &[("image", image), ("request", REQUEST)]).problem();
    assert_eq!(fixes(b"").0, 415);
    assert_eq!(fixes(b"no image at all").0, 415);
    assert_eq!(fixes(b"II*\0\x08\0\0\0").0, 415);
    assert_eq!(fixes(b"GIF89a\x01\0\x01\0\0\0\0").0, 415);
    let whole = png(300, 200);
    for length in [8, 20, 33, 60, whole.len() / 2, whole.len() - 20] {
        let (status, code, parameter) = fixes(&whole[..length]);
        assert_eq!((status, code.as_str(), parameter.as_deref()), (422, "image_damaged", Some("image")), "{length}");
    }
    let mut changed = whole.clone();
    changed[whole.len() / 2] ^= 4;
    assert_eq!(fixes(&changed).1, "image_damaged");
    let jpeg = [0xff, 0xd8, 0xff, 0xe0, 0, 16, b'J', b'F', b'I', b'F', 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 0xff, 0xd9];
    assert_eq!(fixes(&jpeg).0, 422);
    assert_eq!(fixes(b"RIFF\x10\0\0\0WEBPVP8 \0\0\0\0").0, 422);
}

/// A PNG header that promises `width_px` x `height_px`, with hardly any data.
fn promise(width_px: u32, height_px: u32) -> Vec<u8> {
    let mut bytes = png(1, 1);
    bytes[16..20].copy_from_slice(&width_px.to_be_bytes());
    bytes[20..24].copy_from_slice(&height_px.to_be_bytes());
    let mut crc = !0u32;
    for &byte in &bytes[12..29] {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

#[test]
fn a_decompression_bomb_is_refused_before_it_is_decoded() {
    let stand = Stand::new();
    for (width_px, height_px) in
        [(20_001, 1), (1, 20_001), (10_000, 10_000), (u32::MAX >> 1, u32::MAX >> 1), (1_000_000_000, 1_000_000_000)]
    {
        let image = promise(width_px, height_px);
        let (status, code, _) = stand.post("/v1/fixes", &[("image", &image), ("request", REQUEST)]).problem();
        assert!(status == 413 || code == "image_damaged", "{width_px} x {height_px}: {status} {code}");
    }
    let mut bomb = Cursor::new(Vec::new());
    image::GrayImage::new(9_000, 9_000).write_to(&mut bomb, image::ImageFormat::Png).unwrap();
    let bomb = bomb.into_inner();
    assert!(bomb.len() < 1_000_000);
    let (status, code, _) = stand.post("/v1/motions", &[("image_a", &bomb), ("image_b", &bomb)]).problem();
    assert_eq!((status, code.as_str()), (413, "image_too_large"));
}

#[test]
fn a_body_beyond_the_limit_is_refused() {
    let stand = Stand::with(Service::Preflight, Limits { body_bytes: 10_000, ..Limits::default() });
    let (status, code, _) = stand.post("/v1/fixes", &[("image", &vec![0; 20_000]), ("request", REQUEST)]).problem();
    assert_eq!((status, code.as_str()), (413, "body_too_large"));
}

#[test]
fn a_body_that_does_not_arrive_is_refused() {
    let stand = Stand::with(Service::Preflight, Limits { body_time: Duration::from_millis(100), ..Limits::default() });
    let content_type = format!("multipart/form-data; boundary={BOUNDARY}");
    let never = Body::from_stream(tokio_stream::pending::<Result<Vec<u8>, std::io::Error>>());
    let reply = stand.send(Request::post("/v1/fixes").header(CONTENT_TYPE, content_type).body(never).unwrap());
    assert_eq!((reply.problem().0, reply.problem().1.as_str()), (408, "body_too_slow"));
}

#[test]
fn an_answer_that_takes_too_long_is_given_up() {
    let limits = Limits { answer_time: Duration::from_millis(1), ..Limits::default() };
    let stand = Stand::with(Service::Preflight, limits);
    // Decoding these alone takes longer.
    let frame = png(3_000, 3_000);
    let reply = stand.post("/v1/motions", &[("image_a", &frame), ("image_b", &frame)]);
    assert_eq!((reply.status.as_u16(), reply.json()["code"].as_str()), (503, Some("time_limit")));
    assert_eq!(reply.headers[CONTENT_TYPE], "application/problem+json");
}

#[test]
fn a_store_that_was_changed_under_the_service_is_not_answered_from() {
    for service in [Service::Preflight, Service::Onboard] {
        let stand = Stand::with(service, Limits::default());
        let path = stand.folder.path().join("s.gpkg");
        let refused = |what: &str| {
            for asked in ["/v1/layers", "/v1/store", "/readyz", &format!("/v1/tiles/ortho/{ZOOM}/{COLUMN}/{ROW}")] {
                let reply = stand.get(asked);
                let code = (reply.status.as_u16(), reply.json()["code"].as_str().map(str::to_owned));
                assert_eq!(code, (503, Some("store_changed".into())), "{what}: {asked}");
            }
            assert_eq!(stand.get("/healthz").status, StatusCode::OK);
        };
        assert_eq!(stand.get("/readyz").status, StatusCode::OK);
        let kept = stand.folder.path().join("kept.gpkg");
        std::fs::rename(&path, &kept).unwrap();
        refused("removed");
        std::fs::copy(&kept, &path).unwrap();
        refused("replaced");
        std::fs::rename(&kept, &path).unwrap();
        assert_eq!(stand.get("/readyz").status, StatusCode::OK, "the same file again");
    }
}

#[test]
fn a_store_that_is_touched_but_the_same_is_answered_from_on_the_ground() {
    let stand = Stand::new();
    let file = std::fs::File::options().write(true).open(stand.folder.path().join("s.gpkg")).unwrap();
    file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    assert_eq!(stand.get("/readyz").status, StatusCode::OK);
    let onboard = Stand::with(Service::Onboard, Limits::default());
    let file = std::fs::File::options().write(true).open(onboard.folder.path().join("s.gpkg")).unwrap();
    file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    assert_eq!(onboard.get("/readyz").status.as_u16(), 503);
}

#[test]
fn a_fix_and_a_motion_are_answers_even_where_there_is_none() {
    let stand = Stand::new();
    let frame = png(128, 96);
    let (latitude_deg, longitude_deg) = centre();
    let request = serde_json::json!({
        "latitude_deg": latitude_deg, "longitude_deg": longitude_deg, "sigma_m": 100, "heading_deg": 10, "gsd_m_per_px": 3, "time_s": 12.5,
    });
    let fix = stand.post("/v1/fixes", &[("image", &frame), ("request", request.to_string().as_bytes())]);
    assert_eq!(fix.status, StatusCode::OK, "{}", String::from_utf8_lossy(&fix.body));
    assert!(["fix", "no_fix"].contains(&fix.json()["status"].as_str().unwrap()));
    assert_eq!(fix.json()["time_s"], 12.5);
    let motion = stand.post("/v1/motions", &[("image_a", &frame), ("image_b", &frame), ("request", REQUEST)]);
    assert_eq!(motion.status, StatusCode::OK, "{}", String::from_utf8_lossy(&motion.body));
    assert!(motion.json()["status"].is_string());
}

#[test]
fn openapi_names_every_route_and_every_parameter() {
    let stand = Stand::new();
    let api = stand.get("/openapi.json").json();
    assert!(api["openapi"].as_str().unwrap().starts_with("3.1"));
    let paths: Vec<&str> = api["paths"].as_object().unwrap().keys().map(String::as_str).collect();
    for path in [
        "/v1/candidates",
        "/v1/fixes",
        "/v1/motions",
        "/v1/store",
        "/v1/layers",
        "/v1/coverage",
        "/v1/tiles/{layer}/{z}/{x}/{y}",
        "/v1/tiles/{layer}/tilejson.json",
        "/v1/tiles/{layer}/{z}/{x}/{y}/descriptors",
        "/healthz",
        "/readyz",
        "/metrics",
    ] {
        assert!(paths.contains(&path), "{path}");
    }
    let text = api.to_string();
    for name in ["CandidateQuery", "Problem", "Candidates", "FixParameters", "MotionReply", "NoFix"] {
        let wanted = name != "CandidateQuery";
        assert_eq!(api["components"]["schemas"].get(name).is_some(), wanted, "{name}");
    }
    // Every reference leads somewhere.
    for reference in text.split("\"#/components/schemas/").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(api["components"]["schemas"].get(reference).is_some(), "{reference}");
    }
    // A parameter that the documentation names is one that the service knows, and the other way round.
    let named: BTreeSetOf = api["paths"]["/v1/candidates"]["get"]["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["name"].as_str().unwrap().to_owned())
        .collect();
    let refusal = stand.get("/v1/candidates?no_such=1").json();
    let known = refusal["detail"].as_str().unwrap().split_once("it takes ").unwrap().1;
    assert_eq!(named, known.split(", ").map(str::to_owned).collect());
}

#[test]
fn those_who_run_it_see_how_it_fares() {
    let stand = Stand::new();
    assert_eq!((stand.get("/healthz").status, stand.get("/readyz").status), (StatusCode::OK, StatusCode::OK));
    stand.get(&question(&[]));
    stand.get("/nothing/here");
    let text = String::from_utf8(stand.get("/metrics").body).unwrap();
    assert!(
        text.contains(r#"overfly_http_requests_total{method="GET",route="/v1/candidates",status="200"} 1"#),
        "{text}"
    );
    assert!(text.contains("overfly_http_request_seconds_bucket") && text.contains("overfly_store_tiles 16"), "{text}");
    assert!(!text.contains("nothing/here"));
}

#[test]
fn fixes_and_motions_are_counted_by_their_outcome() {
    let stand = Stand::new();
    let metrics = || String::from_utf8(stand.get("/metrics").body).unwrap();
    assert!(metrics().contains("\noverfly_fixes_total 0\n"), "{}", metrics());
    let frame = png(128, 96);
    let (latitude_deg, longitude_deg) = centre();
    let ask = |latitude_deg: f64| {
        let request = serde_json::json!({
            "latitude_deg": latitude_deg, "longitude_deg": longitude_deg, "sigma_m": 100, "heading_deg": 10, "gsd_m_per_px": 3,
        });
        stand.post("/v1/fixes", &[("image", &frame), ("request", request.to_string().as_bytes())]).json()
    };
    assert_eq!(ask(latitude_deg - 2.0)["reason"], "outside_map");
    assert_eq!(ask(latitude_deg - 3.0)["reason"], "outside_map");
    stand.post("/v1/motions", &[("image_a", &frame), ("image_b", &frame), ("request", REQUEST)]);
    let text = metrics();
    for line in [
        "# TYPE overfly_no_fixes_total counter",
        r#"overfly_no_fixes_total{reason="outside_map"} 2"#,
        "overfly_fix_seconds_count 2",
        r#"overfly_no_motions_total{reason="identical_images"} 1"#,
        "overfly_motion_seconds_count 1",
        "# HELP overfly_fix_seconds Time from a decoded frame to a fix or no fix",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
}

#[test]
fn the_map_page_needs_nothing_but_the_service() {
    let stand = Stand::new();
    let page = stand.get("/");
    let html = String::from_utf8(page.body).unwrap();
    assert!(page.headers[CONTENT_TYPE].to_str().unwrap().starts_with("text/html"));
    let mut text = html.clone();
    for part in html.split("/page/").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        let reply = stand.get(&format!("/page/{part}"));
        assert_eq!(reply.status, StatusCode::OK, "{part}");
        text.push_str(&String::from_utf8(reply.body).unwrap());
    }
    // The name of a vocabulary, which nobody fetches.
    let text = text.replace("http://www.w3.org/2000/svg", "");
    assert!(!text.contains("https://") && !text.contains("http://"), "the page asks elsewhere");
}
