//! No tile that meets the region is ever missing: candidates against brute force over random stores, layers,
//! latitudes to 85 degrees, and across the antimeridian.

use overfly::feature::keypoint::CONTRACT;
use overfly::geodesy::{Enu, Geodetic, LocalFrame};
use overfly::locate::candidates::{CandidateQuery, Residents, candidates};
use overfly::region::{ImageOnGround, Uncertainty};
use overfly::store::{BuiltTile, Declaration, Reader, TileContent, Writer};
use overfly::tile::{TileId, zoom_for_gsd};
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

/// Whether an offset from the centre lies in the region, from its definition and nothing else.
fn inside(image: ImageOnGround, uncertainty: Uncertainty, at: Enu) -> bool {
    let (sin, cos) = image.heading_rad.sin_cos();
    let (right, ahead) = (at.east_m * cos - at.north_m * sin, at.east_m * sin + at.north_m * cos);
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => {
            let grow = inaccuracy_m + 2.0 * drift_m;
            right.abs() <= (image.across_m + grow) / 2.0 && ahead.abs() <= (image.along_m + grow) / 2.0
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
        let points =
            points.map(|(i, j)| Geodetic::from_degrees(grid(b.south, b.north, i), grid(b.west, b.east, j)).unwrap());
        if points.into_iter().any(|p| inside(image, uncertainty, frame.enu_from_geodetic(p))) {
            met.insert(tile);
        }
    }
    let (sin, cos) = image.heading_rad.sin_cos();
    for i in 0..400 {
        let mut unit = || if i % 4 == 0 { [-1.0, 1.0][rng.random_range(0..2)] } else { rng.random_range(-1.0..=1.0) };
        let (r, a) = (unit(), unit());
        let (width_m, length_m, shift) = match uncertainty {
            Uncertainty::Sequential { inaccuracy_m, drift_m } => {
                let grow = inaccuracy_m + 2.0 * drift_m;
                (image.across_m + grow, image.along_m + grow, [0.0, 0.0])
            }
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
                let angle = rng.random_range(0.0..TAU);
                let radius = (-2.0 * 0.003f64.ln()).sqrt();
                let (x, y) = (radius * angle.cos(), radius * angle.sin());
                let rest = (1.0 - correlation * correlation).sqrt();
                (image.across_m, image.along_m, [sigma_east_m * x, sigma_north_m * (correlation * x + rest * y)])
            }
        };
        let (right, ahead) = (r * width_m / 2.0, a * length_m / 2.0);
        let at = Enu { east_m: right * cos + ahead * sin + shift[0], north_m: ahead * cos - right * sin + shift[1] };
        let below = TileId::containing(frame.geodetic_from_enu(at).unwrap(), zoom);
        met.extend(below.ok().filter(|tile| stored.contains(tile)));
    }
    met
}

fn uncertainties() -> impl Strategy<Value = Uncertainty> {
    prop_oneof![
        (0.0..300.0f64, 0.0..1500.0f64)
            .prop_map(|(inaccuracy_m, drift_m)| Uncertainty::Sequential { inaccuracy_m, drift_m }),
        (1.0..800.0f64, 1.0..800.0f64, -0.98..0.98f64).prop_map(|(sigma_east_m, sigma_north_m, correlation)| {
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation }
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]
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
        let layers = [("ortho", about(centre, zoom, &mut rng)), ("older", about(centre, zoom.saturating_sub(1), &mut rng))];
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
