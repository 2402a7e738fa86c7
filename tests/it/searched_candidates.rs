//! The candidates of a fix are the tiles that the fix searches, whatever its height, camera and tilt.

use super::http::Stand;
use super::store::store_of;
use axum::body::Body;
use axum::http::Request;
use axum::http::header::CONTENT_TYPE;
use overfly::server::{Limits, Service};
use overfly_core::camera::Intrinsics;
use overfly_core::pixels::Gray;
use overfly_core::tile::TileId;
use overfly_flight::locate::candidates::searched_candidates;
use overfly_flight::locate::{Answer, FixParameters, FixRequest, Reason, ViewParameters, locate};
use overfly_store::Reader;
use serde_json::json;
use std::collections::BTreeSet;

const ZOOM: u8 = 15;
const COLUMN: u32 = 17_000;
const ROW: u32 = 11_000;
/// Tiles along each edge of the map.
const EDGE: u32 = 7;

fn tiles() -> Vec<TileId> {
    (0..EDGE * EDGE).map(|i| TileId::new(ZOOM, COLUMN + i % EDGE, ROW + i / EDGE).unwrap()).collect()
}

fn camera() -> Intrinsics {
    Intrinsics::centred(160, 120, 175.0)
}

/// A request around the middle of the map.
fn request(height_m: f64, pitch_deg: f64, sigma_m: [f64; 2], heading_deg: Option<f64>) -> FixRequest {
    let middle = TileId::new(ZOOM, COLUMN + EDGE / 2, ROW + EDGE / 2).unwrap().centre();
    let parameters = FixParameters {
        latitude_deg: Some(middle.latitude_deg()),
        longitude_deg: Some(middle.longitude_deg()),
        sigma_east_m: Some(sigma_m[0]),
        sigma_north_m: Some(sigma_m[1]),
        heading_deg,
        view: ViewParameters {
            height_m: Some(height_m),
            camera: Some(camera()),
            pitch_deg: Some(pitch_deg),
            roll_deg: Some(-3.0),
            ..ViewParameters::default()
        },
        ..FixParameters::default()
    };
    parameters.request("ortho").unwrap()
}

/// The tiles that a fix searches, found with a map of one tile at a time.
fn searched(request: &FixRequest) -> BTreeSet<TileId> {
    let folder = tempfile::tempdir().unwrap();
    let frame = Gray::from_values(160, 120, (0..160 * 120).map(|i| (i * 31 % 251) as f32 / 251.0).collect()).unwrap();
    let is_searched = |tile: &TileId| {
        let path = folder.path().join(format!("{}-{}.gpkg", tile.column(), tile.row()));
        store_of(&path, "ortho", &[*tile], 3);
        let (tiles, reason) = match locate(&Reader::open(&path).unwrap(), &frame, request, 1).unwrap() {
            Answer::Fix(fix) => (fix.tiles_searched, None),
            Answer::NoFix(no_fix) => (no_fix.tiles_searched, Some(no_fix.reason)),
        };
        assert_eq!(tiles == 0, reason == Some(Reason::OutsideMap), "{tiles} {reason:?}");
        tiles > 0
    };
    tiles().into_iter().filter(is_searched).collect()
}

#[test]
fn candidates_of_a_fix_are_the_tiles_that_it_searches() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    store_of(&path, "ortho", &tiles(), 3);
    let store = Reader::open(&path).unwrap();
    let mut sizes = BTreeSet::new();
    for (height_m, pitch_deg, sigma_m, heading_deg) in [
        (300.0, 0.0, [20.0, 20.0], Some(10.0)),
        (700.0, 0.0, [150.0, 60.0], Some(10.0)),
        (700.0, 35.0, [150.0, 60.0], Some(10.0)),
        (400.0, 2.0, [60.0, 400.0], Some(300.0)),
    ] {
        let request = request(height_m, pitch_deg, sigma_m, heading_deg);
        let found = searched_candidates(&store, &request, 1_000).unwrap();
        let names: BTreeSet<TileId> = found.tiles.iter().map(|t| TileId::new(t.z, t.x, t.y).unwrap()).collect();
        assert_eq!(names.len(), found.tiles.len(), "each tile once");
        assert_eq!(names, searched(&request), "{request:?}");
        assert!(found.containment > 0.99 && found.tiles.is_sorted_by(|a, b| a.probability >= b.probability));
        sizes.insert(names.len());
    }
    assert!(sizes.len() > 2 && sizes.last() < Some(&((EDGE * EDGE) as usize)), "{sizes:?}");
}

#[test]
fn the_service_answers_them_as_a_fix_counts_them() {
    let middle = TileId::new(ZOOM, COLUMN + 1, ROW + 1).unwrap().centre();
    let camera = json!({
        "width_px": 160, "height_px": 120, "focal_length_px": 175.0, "principal_point_px": [80.0, 60.0],
    });
    let complete = json!({
        "latitude_deg": middle.latitude_deg(), "longitude_deg": middle.longitude_deg(), "sigma_m": 100, "heading_deg": 20,
        "height_m": 400, "camera": camera, "pitch_deg": 4, "roll_deg": 1,
    });
    let without = |names: &[&str]| {
        let mut request = complete.clone();
        names.iter().for_each(|name| drop(request.as_object_mut().unwrap().remove(*name)));
        request.to_string()
    };
    for service in [Service::Preflight, Service::Onboard] {
        let stand = Stand::with(service, Limits::default());
        let ask = |body: String| {
            let request = Request::post("/v1/candidates").header(CONTENT_TYPE, "application/json");
            stand.send(request.body(Body::from(body)).unwrap()).json()
        };
        let found = ask(complete.to_string());
        let count = found["tiles"].as_array().unwrap().len();
        let frame = super::http::png(160, 120);
        let fix = stand.post("/v1/fixes", &[("image", &frame), ("request", complete.to_string().as_bytes())]).json();
        assert_eq!(
            (fix["tiles_searched"].as_u64(), fix["nominal_count"].as_f64()),
            (Some(count as u64), found["nominal_count"].as_f64())
        );
        assert!(count > 1 && found["region"]["type"] == "Polygon", "{found}");
        // The whole layer has 16 tiles.
        let anywhere = ask(without(&["latitude_deg", "longitude_deg", "sigma_m", "heading_deg"]));
        assert_eq!(anywhere["tiles"].as_array().unwrap().len(), 16);
        assert!((anywhere["containment"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        let mut any_layer = complete.clone();
        any_layer["layer"] = "any".into();
        for (body, code, parameter) in [
            (without(&["camera"]), "parameter_missing", "camera"),
            (without(&["height_m"]), "parameter_missing", "height_m"),
            (without(&["height_m", "camera", "pitch_deg", "roll_deg"]), "parameter_missing", "gsd_m_per_px"),
            ("[]".to_owned(), "request_not_valid", "body"),
            (r#"{"gsd_m_per_px": 2.0}"#.to_owned(), "parameter_missing", "camera"),
            (any_layer.to_string(), "layer_not_stated", "layer"),
        ] {
            let problem = ask(body.clone());
            assert_eq!(
                (problem["code"].as_str(), problem["parameter"].as_str()),
                (Some(code), Some(parameter)),
                "{body}"
            );
        }
    }
}
