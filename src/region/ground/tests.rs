//! Regions against independent sampling.

use super::*;
use crate::tile::TileId;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use std::collections::{HashMap, HashSet};

fn point(latitude_deg: f64, longitude_deg: f64) -> Geodetic {
    Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap()
}

/// Points of the rectangle or of the dilated ellipse, edges and corners included, from their definitions.
fn samples(image: ImageOnGround, uncertainty: Uncertainty, count: usize, rng: &mut impl Rng) -> Vec<Enu> {
    let (sin, cos) = image.heading_rad.sin_cos();
    let turned = |right: f64, ahead: f64| [right * cos + ahead * sin, ahead * cos - right * sin];
    (0..count)
        .map(|i| {
            let mut unit =
                || if i % 3 == 0 { [-1.0, 1.0][rng.random_range(0..2)] } else { rng.random_range(-1.0..=1.0) };
            let (r, a) = (unit(), unit());
            match uncertainty {
                Uncertainty::Sequential { inaccuracy_m, drift_m } => {
                    let grow = inaccuracy_m + 2.0 * drift_m;
                    let v = turned(r * (image.across_m + grow) / 2.0, a * (image.along_m + grow) / 2.0);
                    Enu { east_m: v[0], north_m: v[1] }
                }
                Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
                    let v = turned(r * image.across_m / 2.0, a * image.along_m / 2.0);
                    let angle = rng.random_range(0.0..TAU);
                    let radius = SIGMAS * if i % 2 == 0 { 1.0 } else { rng.random_range(0.0f64..=1.0).sqrt() };
                    let (x, y) = (radius * angle.cos(), radius * angle.sin());
                    let rest = (1.0 - correlation * correlation).sqrt();
                    Enu {
                        east_m: v[0] + sigma_east_m * x,
                        north_m: v[1] + sigma_north_m * (correlation * x + rest * y),
                    }
                }
            }
        })
        .collect()
}

fn uncertainties() -> impl Strategy<Value = Uncertainty> {
    prop_oneof![
        (0.0..800.0f64, 0.0..3e3f64)
            .prop_map(|(inaccuracy_m, drift_m)| Uncertainty::Sequential { inaccuracy_m, drift_m }),
        (1.0..1500.0f64, 1.0..1500.0f64, -0.99..0.99f64).prop_map(|(sigma_east_m, sigma_north_m, correlation)| {
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation }
        }),
    ]
}

fn images() -> impl Strategy<Value = ImageOnGround> {
    (5.0..2e3f64, 5.0..2e3f64, 0.0..TAU).prop_map(|(across_m, along_m, heading_rad)| ImageOnGround {
        across_m,
        along_m,
        heading_rad,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_tile_under_a_point_of_the_region_meets_it(
        lat in -85.0..85.0f64, lon in prop_oneof![-180.0..180.0f64, 179.9..180.0f64, -180.0..-179.9f64],
        image in images(), uncertainty in uncertainties(), zoom in 0u8..=17, seed: u64,
    ) {
        let centre = point(lat, lon);
        let region = Region::new(centre, image, uncertainty).unwrap();
        let frame = LocalFrame::at(centre);
        let bounds = region.mercator_bounds();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for enu in samples(image, uncertainty, 300, &mut rng) {
            let Ok(tile) = TileId::containing(frame.geodetic_from_enu(enu).unwrap(), zoom) else { continue };
            let b = tile.mercator_bounds();
            prop_assert!(region.meets(&b), "{tile} dropped for {enu:?}");
            let near = [-WORLD_M, 0.0, WORLD_M].iter().any(|shift| {
                bounds.intersects(&MercatorBounds { min_x_m: b.min_x_m + shift, max_x_m: b.max_x_m + shift, ..b })
            });
            prop_assert!(near, "{tile} outside {bounds:?}");
        }
    }

    #[test]
    fn probability_is_the_share_of_samples(
        lat in -84.9..84.9f64, lon in prop_oneof![-180.0..180.0f64, 179.95..180.0f64],
        image in images(), uncertainty in uncertainties(), seed: u64,
    ) {
        const SAMPLES: usize = 20_000;
        let centre = point(lat, lon);
        let region = Region::new(centre, image, uncertainty).unwrap();
        let frame = LocalFrame::at(centre);
        let size_m = region.mercator_bounds();
        let size_m = (size_m.max_x_m - size_m.min_x_m).max(size_m.max_y_m - size_m.min_y_m);
        let zoom = (WORLD_M / size_m * 5.0).log2().floor().clamp(1.0, 22.0) as u8;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut seen: HashMap<TileId, f64> = HashMap::new();
        let (sin, cos) = image.heading_rad.sin_cos();
        for _ in 0..SAMPLES {
            let enu = match uncertainty {
                Uncertainty::Sequential { inaccuracy_m, drift_m } => {
                    let grow = inaccuracy_m + 2.0 * drift_m;
                    let (r, a) = (rng.random_range(-0.5..0.5) * (image.across_m + grow), rng.random_range(-0.5..0.5) * (image.along_m + grow));
                    Enu { east_m: r * cos + a * sin, north_m: a * cos - r * sin }
                }
                Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
                    let (radius, angle) = ((-2.0 * rng.random_range(f64::MIN_POSITIVE..1.0f64).ln()).sqrt(), rng.random_range(0.0..TAU));
                    let (x, y) = (radius * angle.cos(), radius * angle.sin());
                    Enu { east_m: sigma_east_m * x, north_m: sigma_north_m * (correlation * x + (1.0 - correlation * correlation).sqrt() * y) }
                }
            };
            if let Ok(tile) = TileId::containing(frame.geodetic_from_enu(enu).unwrap(), zoom) {
                *seen.entry(tile).or_default() += 1.0 / SAMPLES as f64;
            }
        }
        for (tile, share) in seen {
            let p = region.probability(&tile.mercator_bounds());
            // Six standard deviations of a share of 20,000 samples.
            let tolerance = 6.0 * (p.max(1e-3) * (1.0 - p).max(1e-3) / SAMPLES as f64).sqrt();
            prop_assert!((p - share).abs() < tolerance, "{tile}: {p} but {share} of samples");
        }
    }

    #[test]
    fn tiles_share_out_one(lat in -84.0..84.0f64, image in images(), uncertainty in uncertainties()) {
        let region = Region::new(point(lat, 179.999), image, uncertainty).unwrap();
        let b = region.mercator_bounds();
        let zoom = (WORLD_M / (b.max_x_m - b.min_x_m).max(b.max_y_m - b.min_y_m) * 8.0).log2().floor().clamp(1.0, 22.0) as u8;
        let home = TileId::containing(point(lat, 179.999), zoom).unwrap();
        let size = 1i64 << zoom;
        let mut tiles = HashSet::new();
        for dy in -24i64..=24 {
            for dx in -24i64..=24 {
                let row = i64::from(home.row()) + dy;
                if (0..size).contains(&row) {
                    tiles.insert(TileId::new(zoom, (i64::from(home.column()) + dx).rem_euclid(size) as u32, row as u32).unwrap());
                }
            }
        }
        let sum: f64 = tiles.iter().map(|t| region.probability(&t.mercator_bounds())).sum();
        prop_assert!((sum - 1.0).abs() < 1e-4, "sum {sum} at zoom {zoom}");
    }

    #[test]
    fn a_tile_far_from_the_region_does_not_meet_it(lat in -80.0..80.0f64, lon in -180.0..180.0f64, image in images(),
                                                   bearing in 0.0..TAU) {
        let uncertainty = Uncertainty::Sequential { inaccuracy_m: 50.0, drift_m: 200.0 };
        let region = Region::new(point(lat, lon), image, uncertainty).unwrap();
        let reach_m = (image.across_m + 450.0).hypot(image.along_m + 450.0) / 2.0;
        let frame = LocalFrame::at(point(lat, lon));
        let far = frame.geodetic_from_enu(Enu { east_m: (reach_m * 1.01 + 100.0) * bearing.sin(), north_m: (reach_m * 1.01 + 100.0) * bearing.cos() }).unwrap();
        let tile = TileId::containing(far, 22).unwrap();
        prop_assert!(!region.meets(&tile.mercator_bounds()));
        prop_assert_eq!(region.probability(&tile.mercator_bounds()), 0.0);
    }
}

const IMAGE: ImageOnGround = ImageOnGround { across_m: 600.0, along_m: 400.0, heading_rad: 0.5 };

#[test]
fn the_count_is_equation_3() {
    let uncertainty = Uncertainty::Sequential { inaccuracy_m: 100.0, drift_m: 150.0 };
    let region = Region::new(point(47.0, 8.0), IMAGE, uncertainty).unwrap();
    assert!((region.nominal_count() - 10.0 / 3.0).abs() < 1e-12);
}

#[test]
fn the_count_of_a_covariance_is_its_area_over_the_images() {
    let uncertainty = Uncertainty::Covariance { sigma_east_m: 100.0, sigma_north_m: 300.0, correlation: 0.6 };
    let region = Region::new(point(0.5, 8.0), IMAGE, uncertainty).unwrap();
    let area_m2 = weighted_area(&region.ring, |y| ground_area_scale(region.centre.y_m + y));
    assert!((region.nominal_count() / (area_m2 / (600.0 * 400.0)) - 1.0).abs() < 1e-3);
}

#[test]
fn the_ellipse_holds_what_its_name_says() {
    assert!((1.0 - (-SIGMAS * SIGMAS / 2.0f64).exp() - 0.997).abs() < 1e-12);
}

#[test]
fn a_region_across_the_antimeridian_is_cut_there() {
    let uncertainty = Uncertainty::Sequential { inaccuracy_m: 100.0, drift_m: 5_000.0 };
    let rings = Region::new(point(60.0, 179.99), IMAGE, uncertainty).unwrap().rings_deg();
    assert_eq!(rings.len(), 2);
    assert!(rings.iter().all(|ring| ring.first() == ring.last()));
    let longitudes =
        |ring: &Vec<[f64; 2]>| ring.iter().map(|p| p[0]).fold((180.0f64, -180.0f64), |(a, b), x| (a.min(x), b.max(x)));
    let mut spans: Vec<_> = rings.iter().map(longitudes).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(spans[0].0 == -180.0 && spans[0].1 < -179.8 && spans[1].0 > 179.8 && spans[1].1 == 180.0, "{spans:?}");
}

#[test]
fn a_region_over_the_last_latitude_is_cut_there() {
    let uncertainty = Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 20_000.0 };
    let region = Region::new(point(85.0, 20.0), IMAGE, uncertainty).unwrap();
    let north = region.rings_deg()[0].iter().map(|p| p[1]).fold(0.0, f64::max);
    assert!((north - crate::geodesy::MAX_LATITUDE_DEG).abs() < 1e-9);
    assert_eq!(region.mercator_bounds().max_y_m, WORLD_M / 2.0);
    let world = TileId::new(0, 0, 0).unwrap().mercator_bounds();
    let p = region.probability(&world);
    // 5.7 of about 40 km lie beyond on the northern side: (20.3 + 5.7) / 40.6.
    assert!((p - 0.64).abs() < 0.03, "{p}");
}

#[test]
fn refuses_what_cannot_be_searched() {
    let sequential = |inaccuracy_m, drift_m| Uncertainty::Sequential { inaccuracy_m, drift_m };
    let at = |centre, image, uncertainty| Region::new(centre, image, uncertainty).unwrap_err().code();
    let home = point(47.0, 8.0);
    assert_eq!(at(point(85.1, 0.0), IMAGE, sequential(0.0, 1.0)), "position_out_of_range");
    assert_eq!(at(home, IMAGE, sequential(-1.0, 1.0)), "parameter_out_of_range");
    assert_eq!(at(home, IMAGE, sequential(f64::NAN, 1.0)), "parameter_out_of_range");
    assert_eq!(at(home, IMAGE, sequential(f64::INFINITY, 1.0)), "parameter_out_of_range");
    assert_eq!(at(home, IMAGE, sequential(f64::MAX, f64::MAX)), "region_too_large");
    assert_eq!(at(home, ImageOnGround { across_m: 0.0, ..IMAGE }, sequential(0.0, 1.0)), "parameter_out_of_range");
    let covariance = Uncertainty::Covariance { sigma_east_m: 1.0, sigma_north_m: 1.0, correlation: 1.0 };
    assert_eq!(at(home, IMAGE, covariance), "parameter_out_of_range");
}

#[test]
fn an_image_known_exactly_still_meets_four_tiles() {
    let corner = TileId::new(16, 33_000, 22_000).unwrap().bounds();
    let uncertainty = Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 0.0 };
    let region =
        Region::new(point(corner.north, corner.west), ImageOnGround { heading_rad: 0.0, ..IMAGE }, uncertainty)
            .unwrap();
    let met = (32_999..=33_000)
        .flat_map(|x| (21_999..=22_000).map(move |y| TileId::new(16, x, y).unwrap()))
        .filter(|t| region.meets(&t.mercator_bounds()))
        .count();
    assert_eq!((region.nominal_count(), met), (1.0, 4));
}
