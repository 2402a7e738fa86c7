//! Tests: what a layer covers is the ground of which it has pixels, not the extent of its tiles.

use overfly_core::geodesy::Geodetic;
use overfly_core::region::{ImageOnGround, Uncertainty};
use overfly_flight::locate::candidates::{CandidateQuery, Geometry, candidates};
use overfly_flight::locate::coverage::coverage;
use overfly_store::Reader;
use overfly_testkit::hostile::sound_store;

/// A store of a photo of 900 x 700 m whose middle third, 300 x 233 m, has no pixels.
fn holed() -> (tempfile::TempDir, Reader) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("holed.gpkg");
    sound_store(&path);
    let reader = Reader::open(&path).unwrap();
    (folder, reader)
}

/// The photo's corner lies at 500000 m east, 5400001 m north of EPSG:32633: on the meridian of 15 degrees, at 48.75 degrees.
fn place(east_m: f64, south_m: f64) -> Geodetic {
    let metres_per_degree = 111_200.0;
    let (latitude_deg, longitude_deg): (f64, f64) = (48.753_11, 15.0);
    let per_degree_east = metres_per_degree * latitude_deg.to_radians().cos();
    Geodetic::from_degrees(latitude_deg - south_m / metres_per_degree, longitude_deg + east_m / per_degree_east)
        .unwrap()
}

fn query(centre: Geodetic, drift_m: f64) -> CandidateQuery {
    CandidateQuery {
        centre,
        image: ImageOnGround { across_m: 60.0, along_m: 40.0, heading_rad: 0.0 },
        uncertainty: Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m },
        layer: None,
        max_tiles: None,
        gsd_m_per_px: None,
    }
}

fn area_m2(ring: &[[f64; 2]]) -> f64 {
    let doubled: f64 = ring.windows(2).map(|p| p[0][0] * p[1][1] - p[1][0] * p[0][1]).sum();
    let latitude_rad = ring[0][1].to_radians();
    doubled.abs() / 2.0 * 111_200.0 * 111_200.0 * latitude_rad.cos()
}

#[test]
fn a_hole_holds_no_probability() {
    let (_folder, store) = holed();
    let found = |east_m, south_m, drift_m| candidates(&store, &query(place(east_m, south_m), drift_m)).unwrap();
    let (ground, hole) = (found(150.0, 120.0, 30.0), found(450.0, 350.0, 30.0));
    assert!(ground.containment > 0.99, "{}", ground.containment);
    assert!(hole.containment < 0.01 && !hole.tiles.is_empty(), "{}", hole.containment);
    assert!(hole.tiles.iter().all(|tile| tile.valid_fraction < 1.0));
    // The hole is 11 % of the photo; a search of just the photo's extent finds the rest.
    let all = found(450.0, 350.0, 310.0);
    assert!((0.7..0.88).contains(&all.containment), "{}", all.containment);
}

#[test]
fn coverage_encloses_the_imaged_area() {
    let (_folder, store) = holed();
    let covered = coverage(&store, None).unwrap();
    let Geometry::MultiPolygon(polygons) = &covered.features[0].geometry else { panic!("one rectangle") };
    let found_m2: f64 = polygons.iter().map(|rings| area_m2(&rings[0])).sum();
    let imaged_m2 = 900.0 * 700.0 * 8.0 / 9.0;
    assert!((found_m2 / imaged_m2 - 1.0).abs() < 0.05, "{found_m2} of {imaged_m2}");
    let counted_m2 = store.imaged_area_m2(store.layer("ortho").unwrap()).unwrap();
    assert!((counted_m2 / imaged_m2 - 1.0).abs() < 0.01, "{counted_m2} of {imaged_m2}");
}
