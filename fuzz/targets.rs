//! Fuzz targets: functions that take hostile bytes. The fuzzers in `fuzz_targets/` and the short run in `tests/it/fuzz.rs`
//! share them.
//!
//! A target may refuse its input with any error. It must not panic, and a service must not answer 500.

use axum::body::Body;
use axum::http::{Request, StatusCode};
use overfly::server::{Limits, Service, ServiceState, router};
use overfly_core::feature::keypoint::from_blob;
use overfly_core::tile::TileId;
use overfly_flight::frame::{FrameBounds, decode_frame_within};
use overfly_ingest::plan::parse_routes;
use overfly_ingest::raster::{OpenOptions, Orthophoto};
use overfly_store::package::{
    Manifest, PatchHeader, PublicKey, Records, SEAL_LEN, Seal, SecretKey, StalePolicy, acquisition_day, parse_date,
};
use overfly_store::{FORMAT_VERSION, Reader, decode};
use std::path::{Path, PathBuf};
use tower::ServiceExt as _;

/// A function that takes hostile bytes.
type Target = fn(&[u8]);

/// Name and body of every target.
pub const TARGETS: [(&str, Target); 8] = [
    ("geotiff", geotiff),
    ("side_files", side_files),
    ("frame", frame),
    ("blobs", blobs),
    ("route", route),
    ("package", package),
    ("patch", patch),
    ("http", http),
];

/// Returns a folder of the current thread, in memory where possible. It is removed with the thread.
fn folder() -> PathBuf {
    thread_local! {
        static FOLDER: tempfile::TempDir = {
            let shm = Path::new("/dev/shm");
            let root = if shm.is_dir() { shm.to_owned() } else { std::env::temp_dir() };
            tempfile::Builder::new().prefix("overfly-fuzz-").tempdir_in(root).expect("a folder for inputs")
        };
    }
    FOLDER.with(|folder| folder.path().to_owned())
}

/// Opens a source and warps it to a tile.
fn open_and_warp(path: &Path) {
    let Ok(source) = Orthophoto::open(path, &OpenOptions::default()) else { return };
    let description = source.description();
    let pixels = description.width_px.saturating_mul(description.height_px);
    let Some(middle) = description.outline.first() else { return };
    if let Ok(tile) = TileId::containing(*middle, 14) {
        // Blocks of huge images take long and reach no other code.
        if pixels < 1 << 20 {
            let _ = source.warp(tile);
        }
    }
}

/// Reads a GeoTIFF: layout, GeoKeys, bands, blocks.
pub fn geotiff(data: &[u8]) {
    let path = folder().join("a.tif");
    std::fs::write(&path, data).expect("writing to memory");
    open_and_warp(&path);
}

/// Reads a PNG's world file (the bytes before a NUL) and its .prj (the bytes after it).
pub fn side_files(data: &[u8]) {
    const PNG: &[u8] = include_bytes!("four_pixels.png");
    let (world, prj) = data.split_at(data.iter().position(|b| *b == 0).unwrap_or(data.len()));
    let folder = folder();
    for (name, bytes) in [("b.png", PNG), ("b.pgw", world), ("b.prj", prj.get(1..).unwrap_or(&[]))] {
        std::fs::write(folder.join(name), bytes).expect("writing to memory");
    }
    open_and_warp(&folder.join("b.png"));
}

/// Decodes a camera frame.
pub fn frame(data: &[u8]) {
    let _ = decode_frame_within(data, "a frame", FrameBounds { edge_px: 2000, pixels: 1 << 20 });
}

/// Decodes a tile's blobs: descriptors and image.
pub fn blobs(data: &[u8]) {
    let _ = from_blob(data);
    let _ = decode(data);
}

/// Parses a route: GeoJSON, GPX or KML.
pub fn route(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    for route in parse_routes(text).unwrap_or_default() {
        let _ = route.every(route.length_m() / 10.0);
    }
}

/// Parses the seal and the manifest of an exported store, keys, dates and stale policies.
pub fn package(data: &[u8]) {
    if let Some(seal) = data.get(..SEAL_LEN).and_then(|b| b.try_into().ok()).and_then(Seal::from_bytes) {
        assert_eq!(seal.to_bytes(), data[..SEAL_LEN]);
    }
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Ok(manifest) = Manifest::from_text(text) {
        assert_eq!(manifest.to_text(), text);
    }
    let _ = (PublicKey::from_pem(text), SecretKey::from_pem(text), PublicKey::from_hex(text));
    let _ = (text.parse::<StalePolicy>(), parse_date(text), acquisition_day(text));
}

/// Parses a patch: its header and records, or records alone where no header is there.
pub fn patch(data: &[u8]) {
    let mut rest = data;
    if let Ok(header) = PatchHeader::read(&mut rest) {
        let mut bytes = Vec::new();
        header.write(&mut bytes).expect("writing to memory");
        assert_eq!(PatchHeader::read(&mut &bytes[..]).expect("what was written"), header);
    } else {
        rest = data;
    }
    let mut records = Records::new(rest, FORMAT_VERSION);
    while let Ok(Some(record)) = records.tile() {
        let mut bytes = Vec::new();
        record.write(&mut bytes, FORMAT_VERSION).expect("writing to memory");
        let again = Records::new(&bytes[..], FORMAT_VERSION).tile().expect("what was written").expect("a record");
        assert_eq!(again.tile(), record.tile());
    }
    while let Ok(Some(_)) = records.inputs() {}
}

/// Sends a request to the onboard service of a small store. The first line is the path with its query, the rest the request
/// of a fix.
pub fn http(data: &[u8]) {
    thread_local! {
        static SERVICE: (tokio::runtime::Runtime, axum::Router) = service();
    }
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (uri, body) = text.split_once('\n').unwrap_or((text, ""));
    let request = if body.is_empty() {
        Request::builder().uri(uri).body(Body::empty())
    } else {
        let form = format!(
            "--x\r\nContent-Disposition: form-data; name=\"request\"\r\n\r\n{body}\r\n--x\r\n\
             Content-Disposition: form-data; name=\"image\"; filename=\"a.png\"\r\n\r\nno image\r\n--x--\r\n"
        );
        let builder = Request::builder().method("POST").uri(uri);
        builder.header("content-type", "multipart/form-data; boundary=x").body(Body::from(form))
    };
    let Ok(request) = request else { return };
    SERVICE.with(|(runtime, router)| {
        let reply = runtime.block_on(router.clone().oneshot(request)).expect("a router always answers");
        assert_ne!(reply.status(), StatusCode::INTERNAL_SERVER_ERROR, "{uri}");
    });
}

/// Makes the onboard service of a store of a few tiles.
fn service() -> (tokio::runtime::Runtime, axum::Router) {
    let db = folder().join("fuzz.gpkg");
    let tiles = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(|p| p.join("tiles/epoch_1").is_dir());
    let sources = vec![tiles.expect("the project's tiles").join("tiles/epoch_1/west.jpg")];
    let request = overfly_ingest::build::Request {
        db: db.clone(),
        layer: "ortho".into(),
        sources,
        zoom: Some(13),
        threads: 1,
        ..Default::default()
    };
    overfly_ingest::build::run(&request, &mut |_| std::ops::ControlFlow::Continue(())).expect("a store");
    let state = ServiceState::new(Reader::open(&db).expect("a store"), Service::Onboard, Limits::default());
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    (runtime, router(state))
}
