//! Regions against independent sampling.

use super::*;
use crate::region::reachable::tests::{fly, goes_round, on_ground, random_pieces};
use crate::tile::TileId;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use std::collections::{HashMap, HashSet};

fn point(latitude_deg: f64, longitude_deg: f64) -> Geodetic {
    Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap()
}

/// How much wider than the image the modes' rectangle is; none for other regions.
fn growth_m(uncertainty: Uncertainty) -> Option<f64> {
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => Some(inaccuracy_m + 2.0 * drift_m),
        Uncertainty::Parallel { inaccuracy_m, unit_drift_m, execution_s, relative_s } => {
            Some(inaccuracy_m + 2.0 * unit_drift_m * (execution_s / relative_s))
        }
        _ => None,
    }
}

fn flight(image: ImageOnGround, speed_mps: f64, execution_s: f64, radius_m: f64) -> TurningFlight {
    let ImageOnGround { across_m, along_m, .. } = image;
    TurningFlight { length_m: speed_mps * execution_s, radius_m, across_m, along_m }
}

/// Points of the rectangle, of the dilated ellipse or of images at the ends of flights, edges and corners included, from their definitions.
fn samples(image: ImageOnGround, uncertainty: Uncertainty, count: usize, rng: &mut impl Rng) -> Vec<Enu> {
    let (sin, cos) = image.heading_rad.sin_cos();
    let turned = |right: f64, ahead: f64| [right * cos + ahead * sin, ahead * cos - right * sin];
    (0..count)
        .map(|i| {
            let mut unit =
                || if i % 3 == 0 { [-1.0, 1.0][rng.random_range(0..2)] } else { rng.random_range(-1.0..=1.0) };
            let (r, a) = (unit(), unit());
            match uncertainty {
                Uncertainty::Sequential { .. } | Uncertainty::Parallel { .. } => {
                    let grow = growth_m(uncertainty).unwrap();
                    let v = turned(r * (image.across_m + grow) / 2.0, a * (image.along_m + grow) / 2.0);
                    Enu { east_m: v[0], north_m: v[1] }
                }
                Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, min_turn_radius_m } => {
                    let flight = flight(image, speed_mps, execution_s, min_turn_radius_m);
                    let error = [unit() * inaccuracy_m / 2.0, unit() * inaccuracy_m / 2.0];
                    let pose = fly(&random_pieces(i, rng), flight);
                    let at = on_ground(pose, r * image.across_m / 2.0, a * image.along_m / 2.0);
                    let v = turned(at[0] + error[0], at[1] + error[1]);
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
        (0.0..300.0f64, 0.0..30.0f64, 0.1..20.0f64, 0.1..2.0f64).prop_map(
            |(inaccuracy_m, unit_drift_m, execution_s, relative_s)| Uncertainty::Parallel {
                inaccuracy_m,
                unit_drift_m,
                execution_s,
                relative_s
            }
        ),
        (0.0..300.0f64, 5.0..250.0f64, 0.1..40.0f64, 20.0..3e3f64).prop_map(
            |(inaccuracy_m, speed_mps, execution_s, min_turn_radius_m)| Uncertainty::Combined {
                inaccuracy_m,
                speed_mps,
                execution_s,
                min_turn_radius_m
            }
        ),
        (1.0..1500.0f64, 1.0..1500.0f64, -0.99..0.99f64).prop_map(|(sigma_east_m, sigma_north_m, correlation)| {
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation }
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_flight_of_any_size_has_a_region_or_a_reason(
        exponents in prop::array::uniform6(-307.0..308.0f64), tame in prop::array::uniform6(any::<bool>()), lat in -85.0..85.0f64,
    ) {
        // Some parameters as numbers go, the others as flights go.
        let value = |i: usize, usual: f64| if tame[i] { usual } else { 10f64.powf(exponents[i]) };
        let image = ImageOnGround { across_m: value(0, 600.0), along_m: value(1, 400.0), heading_rad: 1.0 };
        let uncertainty = Uncertainty::Combined {
            inaccuracy_m: value(2, 20.0), speed_mps: value(3, 50.0), execution_s: value(4, 9.0), min_turn_radius_m: value(5, 300.0),
        };
        if let Ok(region) = Region::new(point(lat, 8.0), image, uncertainty) {
            let b = region.mercator_bounds();
            prop_assert!(b.min_x_m.is_finite() && b.max_x_m >= b.min_x_m && b.max_y_m >= b.min_y_m);
            prop_assert!(region.ring.iter().flatten().all(|x| x.is_finite()) && region.nominal_count() >= 0.0);
        }
    }
}

#[test]
fn a_flight_shorter_than_numbers_go_is_one_image() {
    let image = ImageOnGround { across_m: 600.0, along_m: 400.0, heading_rad: 1.0 };
    let flight = |speed_mps, execution_s| Uncertainty::Combined {
        inaccuracy_m: 20.0,
        speed_mps,
        execution_s,
        min_turn_radius_m: 300.0,
    };
    for uncertainty in [flight(1e-211, 1e-181), flight(1e-300, 1e-7)] {
        let b = Region::new(point(0.0, 8.0), image, uncertainty).unwrap().mercator_bounds();
        let width_m = b.max_x_m - b.min_x_m;
        assert!((600.0..1000.0).contains(&width_m), "{width_m}");
    }
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
        const SAMPLES: usize = 10_000;
        let centre = point(lat, lon);
        let region = Region::new(centre, image, uncertainty).unwrap();
        let frame = LocalFrame::at(centre);
        let size_m = region.mercator_bounds();
        let size_m = (size_m.max_x_m - size_m.min_x_m).max(size_m.max_y_m - size_m.min_y_m);
        let zoom = (WORLD_M / size_m * 5.0).log2().floor().clamp(1.0, 22.0) as u8;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut seen: HashMap<TileId, f64> = HashMap::new();
        let (sin, cos) = image.heading_rad.sin_cos();
        // What the combined mode's uniform distribution is uniform over.
        let outline = match uncertainty {
            Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, min_turn_radius_m } => {
                reachable_outline(flight(image, speed_mps, execution_s, min_turn_radius_m), inaccuracy_m)
            }
            _ => Vec::new(),
        };
        for _ in 0..SAMPLES {
            let enu = match uncertainty {
                Uncertainty::Combined { .. } => {
                    let Rectangle { min, max } = Rectangle::around(&outline).unwrap();
                    let v = loop {
                        let v = [rng.random_range(min[0]..max[0]), rng.random_range(min[1]..max[1])];
                        if goes_round(&outline, v) { break v; }
                    };
                    Enu { east_m: v[0] * cos + v[1] * sin, north_m: v[1] * cos - v[0] * sin }
                }
                Uncertainty::Sequential { .. } | Uncertainty::Parallel { .. } => {
                    let grow = growth_m(uncertainty).unwrap();
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
            // Six standard deviations of a share of 10,000 samples.
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
fn a_crescent_across_the_antimeridian_is_cut_into_its_parts() {
    // Flying west at the equator across it: the front comes down beyond, both tips lag behind.
    let image = ImageOnGround { across_m: 50.0, along_m: 50.0, heading_rad: -PI / 2.0 };
    let uncertainty =
        Uncertainty::Combined { inaccuracy_m: 0.0, speed_mps: 50.0, execution_s: 44.0, min_turn_radius_m: 1000.0 };
    let cut = Region::new(point(0.0, -180.0 + 1400.0 / 111_319.5), image, uncertainty).unwrap();
    let rings = cut.rings_deg();
    assert_eq!(rings.len(), 3);
    assert_eq!(rings.iter().filter(|ring| ring.iter().all(|p| p[0] >= 179.0)).count(), 1);
    let area = |rings: &[Vec<[f64; 2]>]| rings.iter().map(|ring| weighted_area(&ring[1..], |_| 1.0)).sum::<f64>();
    let whole = Region::new(point(0.0, 20.0), image, uncertainty).unwrap().rings_deg();
    assert!((area(&rings) / area(&whole) - 1.0).abs() < 1e-6);
    // What lies in the hollow, over the last fix itself, is not searched.
    let home = TileId::containing(point(0.0, -180.0 + 1400.0 / 111_319.5), 19).unwrap();
    assert!(!cut.meets(&home.mercator_bounds()));
}

#[test]
fn the_parallel_mode_drifts_by_the_registrations_that_ran() {
    let parallel = Uncertainty::Parallel { inaccuracy_m: 100.0, unit_drift_m: 3.0, execution_s: 10.0, relative_s: 0.2 };
    let sequential = Uncertainty::Sequential { inaccuracy_m: 100.0, drift_m: 150.0 };
    let [parallel, sequential] = [parallel, sequential].map(|u| Region::new(point(47.0, 8.0), IMAGE, u).unwrap());
    assert!((parallel.nominal_count() - 10.0 / 3.0).abs() < 1e-12);
    let widest = |r: &Region| r.mercator_bounds().max_x_m - r.mercator_bounds().min_x_m;
    assert!((widest(&parallel) - widest(&sequential)).abs() < 1e-6);
}

#[test]
fn the_count_of_a_combined_region_is_equation_28_as_long_as_it_holds() {
    let count = |execution_s| {
        let uncertainty =
            Uncertainty::Combined { inaccuracy_m: 0.0, speed_mps: 50.0, execution_s, min_turn_radius_m: 500.0 };
        let region = Region::new(point(0.5, 8.0), IMAGE, uncertainty).unwrap();
        let area_m2 = weighted_area(&region.ring, |y| ground_area_scale(region.centre.y_m + y));
        (region.nominal_count(), area_m2 / 240_000.0)
    };
    assert!((count(10.0).0 - (2.0 * 500f64.powi(3) / 1500.0 + 600.0 * 500.0) / 240_000.0).abs() < 1e-9);
    let (beyond, ratio) = count(10.1);
    assert!((beyond / ratio - 1.0).abs() < 1e-3, "{beyond} {ratio}");
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
    let combined = |speed_mps, execution_s, min_turn_radius_m| {
        at(home, IMAGE, Uncertainty::Combined { inaccuracy_m: 1.0, speed_mps, execution_s, min_turn_radius_m })
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for code in [combined(bad, 10.0, 300.0), combined(50.0, bad, 300.0), combined(50.0, 10.0, bad)] {
            assert_eq!(code, "parameter_out_of_range");
        }
    }
    assert_eq!(combined(f64::MAX, f64::MAX, 300.0), "region_too_large");
    assert_eq!(combined(300.0, 1000.0, 300.0), "region_too_large");
    let parallel = |unit_drift_m, execution_s, relative_s| {
        at(home, IMAGE, Uncertainty::Parallel { inaccuracy_m: 1.0, unit_drift_m, execution_s, relative_s })
    };
    assert_eq!(parallel(-1.0, 1.0, 1.0), "parameter_out_of_range");
    assert_eq!(parallel(1.0, 0.0, 1.0), "parameter_out_of_range");
    assert_eq!(parallel(1.0, 1.0, 0.0), "parameter_out_of_range");
    assert_eq!(parallel(1.0, f64::MAX, f64::MIN_POSITIVE), "region_too_large");
    assert_eq!(parallel(0.0, f64::MAX, f64::MIN_POSITIVE), "region_too_large");
    let covariance = Uncertainty::Covariance { sigma_east_m: 1.0, sigma_north_m: 1.0, correlation: 1.0 };
    assert_eq!(at(home, IMAGE, covariance), "parameter_out_of_range");
}

#[test]
fn an_image_known_exactly_still_meets_four_tiles() {
    let corner = TileId::new(16, 33_000, 22_000).unwrap().bounds();
    let uncertainty = Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 0.0 };
    let region =
        Region::new(point(corner.north_deg, corner.west_deg), ImageOnGround { heading_rad: 0.0, ..IMAGE }, uncertainty)
            .unwrap();
    let met = (32_999..=33_000)
        .flat_map(|x| (21_999..=22_000).map(move |y| TileId::new(16, x, y).unwrap()))
        .filter(|t| region.meets(&t.mercator_bounds()))
        .count();
    assert_eq!((region.nominal_count(), met), (1.0, 4));
}
