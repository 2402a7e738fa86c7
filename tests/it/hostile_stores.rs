//! Tests: a store that someone altered is refused by whoever passes it on or flies it.

use overfly_core::geodesy::Geodetic;
use overfly_core::route::Route;
use overfly_ingest::export::{ExportRequest, export};
use overfly_store::package::{open_onboard, parse_date};
use overfly_store::{Reader, StoreError, verify};
use overfly_testkit::hostile::{ALTERATIONS, alter, sound_store};
use std::path::Path;

fn exported(store: &Reader, out: &Path) -> Result<(), String> {
    let bounds = store.layer("ortho").unwrap().bounds_deg;
    let (south, north) = (bounds.south_deg, bounds.north_deg);
    let point = |latitude_deg| Geodetic::from_degrees(latitude_deg, (bounds.west_deg + bounds.east_deg) / 2.0).unwrap();
    let route = Route::from_lines(vec![vec![point(south), point(north)]]).unwrap();
    let request = ExportRequest::along(route, 2000.0);
    export(store, &request, out, &|_, _| ()).map(|_| ()).map_err(|e| e.to_string())
}

/// Whether a result refuses the store itself, and not something else.
fn refuses<T>(result: Result<T, StoreError>) -> bool {
    result.is_err_and(|e| ["damaged_store", "foreign_schema"].contains(&e.code()))
}

#[test]
fn an_altered_store_is_neither_verified_nor_exported_nor_served_nor_flown() {
    let folder = tempfile::tempdir().unwrap();
    let sound = folder.path().join("sound.gpkg");
    sound_store(&sound);
    let out = folder.path().join("out.gpkg");
    exported(&Reader::open(&sound).unwrap(), &out).unwrap();
    assert!(verify(&sound, &|_, _| ()).unwrap().ok);
    for (what, sql) in ALTERATIONS {
        let altered = folder.path().join("altered.gpkg");
        std::fs::copy(&sound, &altered).unwrap();
        alter(&altered, sql);
        assert!(!verify(&altered, &|_, _| ()).is_ok_and(|found| found.ok), "verified with {what}");
        assert!(refuses(Reader::open_proved(&altered)), "served with {what}");
        assert!(refuses(Reader::open_onboard(&altered)), "flown with {what}");
        let today = parse_date("2026-11-22").unwrap();
        assert!(open_onboard(&altered, None, &[], today).is_err(), "flown with {what}");
        let passed_on = Reader::open(&altered).map_err(|e| e.to_string()).and_then(|store| exported(&store, &out));
        assert!(passed_on.is_err(), "exported with {what}");
    }
}

#[test]
fn a_store_with_its_tiles_elsewhere_and_hashes_to_match_has_another_digest() {
    let folder = tempfile::tempdir().unwrap();
    let (here, there) = (folder.path().join("here.gpkg"), folder.path().join("there.gpkg"));
    let tiles = |column: u32| vec![overfly_core::tile::TileId::new(12, column, 900).unwrap()];
    super::store::store_of(&here, "ortho", &tiles(700), 3);
    super::store::store_of(&there, "ortho", &tiles(701), 3);
    let digest = |path: &Path| Reader::open(path).unwrap().layer("ortho").unwrap().digest.clone().unwrap();
    assert_ne!(digest(&here), digest(&there));
    alter(&there, &format!("UPDATE overfly_layers SET digest = x'{}'", digest(&here)));
    assert!(refuses(Reader::open_proved(&there)) && refuses(Reader::open_onboard(&there)));
}
