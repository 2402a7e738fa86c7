//! No tile that meets the region is ever missing: candidates against brute force over random stores, layers,
//! latitudes to 85 degrees, and across the antimeridian.

use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_core::region::{ImageOnGround, Uncertainty};
use overfly_core::tile::{TileId, zoom_for_gsd};
use overfly_flight::locate::candidates::{CandidateQuery, Residents, candidates};
use overfly_store::{BuiltTile, Declaration, Reader, Terms, TileContent, Writer};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::OnceLock;

/// One tile's content, encoded once: what it shows is of no account here.
fn content() -> TileContent {
    static CONTENT: OnceLock<TileContent> = OnceLock::new();
    let tile = TileId::new(0, 0, 0).unwrap();
    CONTENT.get_or_init(|| super::store::built(tile, &super::store::source(1), 1, false).content.unwrap()).clone()
}

fn write(path: &Path, layer: &str, tiles: &BTreeSet<TileId>) {
    let zoom = tiles.first().unwrap().zoom();
    let declaration = Declaration {
        layer: layer.into(),
        sources: vec![super::store::source(1)],
        zoom_override: None,
        base_zoom: zoom,
        min_zoom: zoom,
        terms: Terms::default(),
        terrain: None,
    };
    let mut writer = Writer::begin(path, CONTRACT, declaration).unwrap();
    for &tile in tiles {
        writer.put(&BuiltTile { tile, inputs_hash: [1; 32], content: Some(content()) }).unwrap();
    }
    writer.finish(&|_| true).unwrap();
}

/// Most of the tiles about a position, some left out; columns wrap at the antimeridian.
fn about(centre: Geodetic, zoom: u8, rng: &mut impl Rng) -> BTreeSet<TileId> {
    let home = TileId::containing(centre, zoom).unwrap();
    let size = 1i64 << zoom;
    let mut tiles = BTreeSet::from([home]);
    for dy in -4i64..=4 {
        for dx in -4i64..=4 {
            let (x, y) = ((i64::from(home.column()) + dx).rem_euclid(size), i64::from(home.row()) + dy);
            if (0..size).contains(&y) && rng.random_bool(0.8) {
                tiles.insert(TileId::new(zoom, x as u32, y as u32).unwrap());
            }
        }
    }
    tiles
}

/// How much wider than the image the rectangle of the sequential and the parallel mode is.
fn growth_m(uncertainty: Uncertainty) -> Option<f64> {
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => Some(inaccuracy_m + 2.0 * drift_m),
        Uncertainty::Parallel { inaccuracy_m, unit_drift_m, execution_s, relative_s } => {
            Some(inaccuracy_m + 2.0 * unit_drift_m * execution_s / relative_s)
        }
        Uncertainty::Combined { .. } | Uncertainty::Covariance { .. } => None,
    }
}

/// Hard to one side, straight, or anything between: a share of the largest curvature.
fn steered(rng: &mut impl Rng) -> f64 {
    if rng.random_bool(0.8) { [-1.0, 0.0, 1.0][rng.random_range(0..3)] } else { rng.random_range(-1.0..=1.0) }
}

/// Right and ahead of the start, and the heading: a flight of stated length and least turn radius, steered at random in
/// up to eight stretches.
fn flown(length_m: f64, radius_m: f64, rng: &mut impl Rng) -> ([f64; 2], f64) {
    const STEPS: usize = 240;
    let stretches = rng.random_range(1..=8);
    let mut switches: Vec<usize> = (1..stretches).map(|_| rng.random_range(0..STEPS)).collect();
    switches.sort_unstable();
    let step_m = length_m / STEPS as f64;
    let (mut at, mut heading_rad, mut turn) = ([0.0, 0.0], 0.0f64, steered(rng));
    for step in 0..STEPS {
        if switches.contains(&step) {
            turn = steered(rng);
        }
        // One step along a circle: its chord lies half its turn aside.
        let half_rad = turn * step_m / radius_m / 2.0;
        let chord_m = if half_rad == 0.0 { step_m } else { step_m * half_rad.sin() / half_rad };
        let (sin, cos) = (heading_rad + half_rad).sin_cos();
        at = [at[0] + chord_m * sin, at[1] + chord_m * cos];
        heading_rad += 2.0 * half_rad;
    }
    (at, heading_rad)
}

/// Whether an offset from the centre lies in the region, from its definition and nothing else.
fn inside(image: ImageOnGround, uncertainty: Uncertainty, at: Enu) -> bool {
    let (sin, cos) = image.heading_rad.sin_cos();
    let (right, ahead) = (at.east_m * cos - at.north_m * sin, at.east_m * sin + at.north_m * cos);
    match uncertainty {
        Uncertainty::Sequential { .. } | Uncertainty::Parallel { .. } => {
            let grow = growth_m(uncertainty).unwrap();
            right.abs() <= (image.across_m + grow) / 2.0 && ahead.abs() <= (image.along_m + grow) / 2.0
        }
        // Of what can be reached only what straight flight shows: that is inside for certain.
        Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, .. } => {
            let ahead = ahead - speed_mps * execution_s;
            right.abs() <= (image.across_m + inaccuracy_m) / 2.0 && ahead.abs() <= (image.along_m + inaccuracy_m) / 2.0
        }
        // Of the ellipse only the part without the footprint: that is inside for certain.
        Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
            let (x, y) = (at.east_m / sigma_east_m, at.north_m / sigma_north_m);
            let squared = (x * x - 2.0 * correlation * x * y + y * y) / (1.0 - correlation * correlation);
            squared <= -2.0 * 0.003f64.ln()
        }
    }
}

/// Tiles of `stored` that provably meet the region: one of their points lies in it, or one of its points in them.
fn brute_force(stored: &BTreeSet<TileId>, query: &CandidateQuery, rng: &mut impl Rng) -> BTreeSet<TileId> {
    let zoom = stored.first().unwrap().zoom();
    let frame = LocalFrame::at(query.centre);
    let (image, uncertainty) = (query.image, query.uncertainty);
    let mut met = BTreeSet::new();
    for &tile in stored {
        let b = tile.bounds();
        let grid = |low: f64, high: f64, i: u32| low + (high - low) * (f64::from(i) + 1e-6) / (10.0 + 2e-6);
        let points = (0..=10).flat_map(|i| (0..=10).map(move |j| (i, j)));
        let points = points.map(|(i, j)| {
            Geodetic::from_degrees(grid(b.south_deg, b.north_deg, i), grid(b.west_deg, b.east_deg, j)).unwrap()
        });
        if points.into_iter().any(|p| inside(image, uncertainty, frame.enu_from_geodetic(p))) {
            met.insert(tile);
        }
    }
    let (sin, cos) = image.heading_rad.sin_cos();
    for i in 0..400 {
        let mut unit = || if i % 4 == 0 { [-1.0, 1.0][rng.random_range(0..2)] } else { rng.random_range(-1.0..=1.0) };
        let (r, a) = (unit(), unit());
        let (mut width_m, mut length_m) = (image.across_m, image.along_m);
        let (mut sin, mut cos) = (sin, cos);
        let shift = match uncertainty {
            Uncertainty::Sequential { .. } | Uncertainty::Parallel { .. } => {
                let grow = growth_m(uncertainty).unwrap();
                (width_m, length_m) = (width_m + grow, length_m + grow);
                [0.0, 0.0]
            }
            Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, min_turn_radius_m } => {
                let error = [unit() * inaccuracy_m / 2.0, unit() * inaccuracy_m / 2.0];
                let (at, turned_rad) = flown(speed_mps * execution_s, min_turn_radius_m, rng);
                let (right, ahead) = (at[0] + error[0], at[1] + error[1]);
                let shift = [right * cos + ahead * sin, ahead * cos - right * sin];
                (sin, cos) = (image.heading_rad + turned_rad).sin_cos();
                shift
            }
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
                let angle = rng.random_range(0.0..TAU);
                let radius = (-2.0 * 0.003f64.ln()).sqrt();
                let (x, y) = (radius * angle.cos(), radius * angle.sin());
                let rest = (1.0 - correlation * correlation).sqrt();
                [sigma_east_m * x, sigma_north_m * (correlation * x + rest * y)]
            }
        };
        let (right, ahead) = (r * width_m / 2.0, a * length_m / 2.0);
        let at = Enu { east_m: right * cos + ahead * sin + shift[0], north_m: ahead * cos - right * sin + shift[1] };
        let below = TileId::containing(frame.geodetic_from_enu(at).unwrap(), zoom);
        met.extend(below.ok().filter(|tile| stored.contains(tile)));
    }
    met
}

/// Where the tiles should lie that a question is about: in the combined mode ahead of the last fix.
fn middle(centre: Geodetic, heading_rad: f64, uncertainty: Uncertainty) -> Geodetic {
    let Uncertainty::Combined { speed_mps, execution_s, .. } = uncertainty else { return centre };
    let (sin, cos) = heading_rad.sin_cos();
    let length_m = speed_mps * execution_s;
    let ahead = Enu { east_m: length_m * sin, north_m: length_m * cos };
    let ahead = LocalFrame::at(centre).geodetic_from_enu(ahead).unwrap();
    if TileId::containing(ahead, 0).is_ok() { ahead } else { centre }
}

fn uncertainties() -> impl Strategy<Value = Uncertainty> {
    prop_oneof![
        (0.0..300.0f64, 0.0..1500.0f64)
            .prop_map(|(inaccuracy_m, drift_m)| Uncertainty::Sequential { inaccuracy_m, drift_m }),
        (0.0..300.0f64, 0.0..20.0f64, 0.1..10.0f64, 0.1..2.0f64).prop_map(
            |(inaccuracy_m, unit_drift_m, execution_s, relative_s)| Uncertainty::Parallel {
                inaccuracy_m,
                unit_drift_m,
                execution_s,
                relative_s
            }
        ),
        (0.0..200.0f64, 5.0..120.0f64, 0.1..20.0f64, 10.0..2000.0f64).prop_map(
            |(inaccuracy_m, speed_mps, execution_s, min_turn_radius_m)| Uncertainty::Combined {
                inaccuracy_m,
                speed_mps,
                execution_s,
                min_turn_radius_m
            }
        ),
        (1.0..800.0f64, 1.0..800.0f64, -0.98..0.98f64).prop_map(|(sigma_east_m, sigma_north_m, correlation)| {
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation }
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, ..ProptestConfig::default() })]
    #[test]
    fn no_tile_that_meets_the_region_is_missing(
        latitude_deg in prop_oneof![-85.0..85.0f64, 84.9..85.0f64, -85.0..-84.9f64],
        longitude_deg in prop_oneof![-180.0..180.0f64, 179.99..180.0f64, -180.0..-179.99f64],
        across_m in 20.0..1500.0f64, along_m in 20.0..1500.0f64, heading_rad in 0.0..TAU,
        uncertainty in uncertainties(), finer in -1i8..3, seed: u64,
    ) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let centre = Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap();
        let image = ImageOnGround { across_m, along_m, heading_rad };
        // A level whose tiles are about as large as the image, or up to eight times smaller, or twice as large.
        let zoom = (i16::from(zoom_for_gsd(centre, across_m / 512.0)) + i16::from(finer)).clamp(0, 20) as u8;
        let middle = middle(centre, heading_rad, uncertainty);
        let layers = [("ortho", about(middle, zoom, &mut rng)), ("older", about(middle, zoom.saturating_sub(1), &mut rng))];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.gpkg");
        for (name, tiles) in &layers {
            write(&path, name, tiles);
        }
        let store = Reader::open(&path).unwrap();
        for (name, stored) in &layers {
            let query = CandidateQuery {
                centre, image, uncertainty, layer: Some((*name).to_owned()), max_tiles: None, gsd_m_per_px: None,
            };
            let answer = candidates(&store, &query).unwrap();
            let found: BTreeSet<TileId> = answer.tiles.iter().map(|t| TileId::new(t.z, t.x, t.y).unwrap()).collect();
            prop_assert_eq!(found.len(), answer.tiles.len(), "a tile twice");
            prop_assert!(found.is_subset(stored) && answer.tiles.iter().all(|t| t.layer == *name));
            let met = brute_force(stored, &query, &mut rng);
            let missing: Vec<_> = met.difference(&found).collect();
            prop_assert!(missing.is_empty(), "missing {missing:?} of {} in {name}", met.len());
            prop_assert!((0.0..=1.0).contains(&answer.containment));
            // The witness: the resident index gives the same answer.
            let in_memory = Residents::new(1 << 20).candidates(&store, &query).unwrap();
            let too_large = Residents::new(0).candidates(&store, &query).unwrap();
            prop_assert_eq!(&answer, &in_memory);
            prop_assert_eq!(answer, too_large);
        }
    }
}

#[test]
fn a_coarse_ground_sample_distance_chooses_a_coarse_level() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.gpkg");
    let centre = Geodetic::from_degrees(47.0, 8.0).unwrap();
    let base = TileId::containing(centre, 16).unwrap();
    let declaration = Declaration {
        layer: "ortho".into(),
        sources: vec![super::store::source(1)],
        zoom_override: None,
        base_zoom: 16,
        min_zoom: 14,
        terms: Terms::default(),
        terrain: None,
    };
    let mut writer = Writer::begin(&path, CONTRACT, declaration).unwrap();
    let mut tile = Some(base);
    for _ in 14..=16 {
        writer.put(&BuiltTile { tile: tile.unwrap(), inputs_hash: [1; 32], content: Some(content()) }).unwrap();
        tile = tile.unwrap().parent();
    }
    writer.finish(&|_| true).unwrap();
    let store = Reader::open(&path).unwrap();
    let level = |gsd_m_per_px| {
        let query = CandidateQuery {
            centre,
            image: ImageOnGround { across_m: 300.0, along_m: 200.0, heading_rad: 0.0 },
            uncertainty: Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 10.0 },
            layer: None,
            max_tiles: None,
            gsd_m_per_px,
        };
        candidates(&store, &query).unwrap().tiles[0].z
    };
    // At 47 degrees a pixel of zoom 16 is 0.81 m, of zoom 15 1.63 m.
    assert_eq!([level(None), level(Some(0.01)), level(Some(1.7)), level(Some(900.0))], [16, 16, 15, 14]);
}
