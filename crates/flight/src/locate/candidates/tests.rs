//! Ranking over footprints in memory.

use super::index::ResidentIndex;
use super::ranking::rank;
use super::search_cost::SearchCost;
use overfly_core::geodesy::Geodetic;
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::tile::TileId;
use overfly_store::{Footprint, Layer};
use std::f64::consts::TAU;

fn footprint(tile: TileId) -> Footprint {
    Footprint {
        tile,
        content_hash: [0; 32],
        acquired: Some("2018-07-16".into()),
        valid_fraction: 1.0,
        horizontal_error_m: Some(1.0),
        keypoints: 7,
        distinctiveness: 0.5,
        sources: String::new(),
        valid_outline: None,
    }
}

fn block(zoom: u8, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> Vec<Footprint> {
    rows.flat_map(|y| columns.clone().map(move |x| footprint(TileId::new(zoom, x, y).unwrap()))).collect()
}

fn cost() -> SearchCost {
    let layer = Layer {
        name: "ortho".into(),
        base_zoom: 15,
        min_zoom: 11,
        base_tiles: 1,
        tiles: 1,
        bounds_deg: [0.0, 0.0, 1.0, 1.0].into(),
        acquired: None,
        complete: true,
        digest: None,
        terms: Default::default(),
        terrain: None,
    };
    let image = ImageOnGround { across_m: 600.0, along_m: 400.0, heading_rad: 0.0 };
    SearchCost::new(&layer, 15, Geodetic::from_degrees(48.0, 0.5).unwrap(), image)
}

fn region(centre: Geodetic, drift_m: f64) -> Region {
    let image = ImageOnGround { across_m: 600.0, along_m: 400.0, heading_rad: TAU / 8.0 };
    Region::new(centre, image, Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m }).unwrap()
}

#[test]
fn the_tile_of_the_centre_comes_first_and_the_figures_add_up() {
    let footprints = block(15, 100..140, 11_000..11_040);
    let centre = footprints[40 * 20 + 20].tile.centre();
    let all = rank("ortho", footprints.iter(), &region(centre, 500.0), None, &cost());
    assert_eq!((all.tiles[0].z, all.tiles[0].x, all.tiles[0].y), (15, 120, 11_020));
    assert_eq!(all.tiles[0].id, "ortho/15/120/11020");
    assert!((all.containment - 1.0).abs() < 1e-9);
    assert!(all.tiles.windows(2).all(|w| w[0].probability >= w[1].probability));
    assert_eq!(all.estimated_s, cost().estimated_s(all.tiles.len()));
    assert!(cost().estimated_s(200) < 2.0 * cost().estimated_s(100) && cost().estimated_s(0) == 0.0);
    let three = rank("ortho", footprints.iter(), &region(centre, 500.0), Some(3), &cost());
    assert_eq!(three.tiles[..], all.tiles[..3]);
    assert!(three.containment < all.containment);
}

#[test]
fn a_region_without_map_has_no_candidates() {
    let footprints = block(15, 100..110, 100..110);
    let far =
        rank("ortho", footprints.iter(), &region(Geodetic::from_degrees(0.0, 0.0).unwrap(), 500.0), None, &cost());
    assert!(far.tiles.is_empty() && far.estimated_s == 0.0);
    assert!(far.containment == 0.0 && far.containment.is_sign_positive());
    assert!(far.nominal_count > 1.0);
}

#[test]
fn the_resident_index_finds_what_lies_across_the_antimeridian() {
    let index = ResidentIndex::new([block(10, 0..3, 500..503), block(10, 1021..1024, 500..503)].concat());
    let centre = TileId::new(10, 1023, 501).unwrap().centre();
    let bounds = region(centre, 30_000.0).mercator_bounds();
    let columns: std::collections::BTreeSet<u32> =
        index.footprints_in(&bounds).iter().map(|f| f.tile.column()).collect();
    assert!(columns.contains(&1023) && columns.contains(&0), "{columns:?}");
}

#[test]
fn the_whole_world_is_found_once() {
    let index = ResidentIndex::new(vec![footprint(TileId::new(0, 0, 0).unwrap())]);
    let bounds = region(Geodetic::from_degrees(10.0, 179.99).unwrap(), 30_000.0).mercator_bounds();
    assert_eq!(index.footprints_in(&bounds).len(), 1);
}
