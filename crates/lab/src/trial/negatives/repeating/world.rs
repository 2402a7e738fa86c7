//! `RepeatingWorld`: a map with patterns drawn into it, as a store of its own in a temporary folder.

use super::look::PatternLook;
use super::real_map::RealMap;
use super::scene::{GroundPatch, RepeatingScene, SceneEpoch};
use crate::trial::error::TrialError;
use crate::trial::mapped_ground::MappedGround;
use overfly_core::geodesy::{LocalFrame, MercatorPoint};
use overfly_core::tile::gsd_at;
use overfly_ingest::build;
use overfly_store::{Reader, require_output, write_output};
use std::ops::ControlFlow;
use std::path::Path;
use tempfile::TempDir;

/// The layer of a world.
pub const WORLD_LAYER: &str = "ortho";
/// EPSG code of the tile matrix.
const WEB_MERCATOR: u32 = 3857;
/// Distance of the pixels whose place on the ground is computed exactly; linear between them.
const KNOT_PX: usize = 32;

/// A drawn world.
pub struct RepeatingWorld {
    /// Its store.
    pub store: Reader,
    /// Where it has imagery.
    pub ground: MappedGround,
    /// Origin of the scene's metres.
    pub frame: LocalFrame,
    /// The patterns.
    pub scene: RepeatingScene,
    /// Holds the store's file; removed with the world.
    _folder: TempDir,
}

impl RepeatingWorld {
    /// Draws a scene into a map and builds the store. The ground sample distance of the map's source blurs the pattern.
    ///
    /// # Errors
    /// If the temporary folder cannot be written or the build fails.
    pub fn build(
        map: &RealMap,
        scene: RepeatingScene,
        look: &PatternLook,
        source_gsd_m: f64,
    ) -> Result<Self, TrialError> {
        let folder = tempfile::tempdir().map_err(|cause| unwritable(&std::env::temp_dir(), cause))?;
        let frame = map.frame().expect("a map lies in the world");
        write_source(map, &frame, &scene, look, source_gsd_m, folder.path())?;
        let request = build::Request {
            db: folder.path().join("world.gpkg"),
            layer: WORLD_LAYER.into(),
            sources: vec![folder.path().join("world.png")],
            zoom: Some(map.zoom),
            crs: Some(WEB_MERCATOR),
            horizontal_error_m: Some(0.0),
            threads: 1,
            ..build::Request::default()
        };
        build::run(&request, &mut |_| ControlFlow::Continue(())).map_err(|e| TrialError::World(Box::new(e)))?;
        let store = Reader::open(&request.db)?;
        let ground = MappedGround::read(&store, store.layer(WORLD_LAYER)?)?;
        Ok(Self { store, ground, frame, scene, _folder: folder })
    }
}

/// Draws the map and writes it as a PNG with a world file.
fn write_source(
    map: &RealMap,
    frame: &LocalFrame,
    scene: &RepeatingScene,
    look: &PatternLook,
    source_gsd_m: f64,
    folder: &Path,
) -> Result<(), TrialError> {
    let path = folder.join("world.png");
    let image = drawn_map(map, frame, scene, look, source_gsd_m);
    require_output(&path).map_err(|cause| unwritable(&path, cause))?;
    image.save(&path).map_err(|e| unwritable(&path, std::io::Error::other(e)))?;
    let centre = |x: f64, y: f64| {
        let point = map.geodetic_from_map([x, y]).expect("a map lies in the world");
        MercatorPoint::from_geodetic(point).expect("a map lies in the world")
    };
    let (first, next) = (centre(0.5, 0.5), centre(1.5, 1.5));
    let (across_m, down_m) = (next.x_m - first.x_m, next.y_m - first.y_m);
    let text = format!("{across_m}\n0\n0\n{down_m}\n{}\n{}\n", first.x_m, first.y_m);
    let path = folder.join("world.pgw");
    write_output(&path, text).map_err(|cause| unwritable(&path, cause))
}

/// The map with the scene, gray and opacity.
pub fn drawn_map(
    map: &RealMap,
    frame: &LocalFrame,
    scene: &RepeatingScene,
    look: &PatternLook,
    source_gsd_m: f64,
) -> image::GrayAlphaImage {
    let (width, height) = (map.gray.width_px(), map.gray.height_px());
    let gsd = gsd_at(frame.origin(), map.zoom);
    let span = |own_m: f64| own_m.max(source_gsd_m);
    let (across_m, down_m) = ([span(gsd.east_m_per_px), 0.0], [0.0, -span(gsd.north_m_per_px)]);
    let knot = |x: usize, y: usize| {
        let point = map.geodetic_from_map([x as f64 + 0.5, y as f64 + 0.5]).expect("a map lies in the world");
        let enu = frame.enu_from_geodetic(point);
        [enu.east_m, enu.north_m]
    };
    let mut image = image::GrayAlphaImage::new(width as u32, height as u32);
    for y in 0..height {
        for start in (0..width).step_by(KNOT_PX) {
            let (west, east) = (knot(start, y), knot(start + KNOT_PX, y));
            for x in start..(start + KNOT_PX).min(width) {
                let part = (x - start) as f64 / KNOT_PX as f64;
                let centre_m = std::array::from_fn(|k| west[k] + (east[k] - west[k]) * part);
                if map.mask.at(x, y) {
                    let patch = GroundPatch { centre_m, across_m, down_m };
                    let level = scene.shade(map.gray.at(x, y), &patch, look, SceneEpoch::Map, (x, y));
                    image.put_pixel(x as u32, y as u32, image::LumaA([level.round() as u8, 255]));
                }
            }
        }
    }
    image
}

fn unwritable(path: &Path, cause: std::io::Error) -> TrialError {
    TrialError::Unwritable { path: path.to_owned(), cause }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::pattern::RepeatingPattern;
    use super::super::pattern_kind::PatternKind;
    use super::super::scene::{BlockOutline, PatternBlock};
    use super::*;
    use crate::trial::negatives::cell_hash::cell_hash;
    use overfly_core::geodesy::Geodetic;
    use overfly_core::pixels::{Gray, Mask};
    use overfly_core::tile::WorldPixel;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// 400 x 300 pixels of noise at 48 N 15 E, the first ten columns missing.
    pub fn noisy_map() -> RealMap {
        let at = WorldPixel::from_geodetic(Geodetic::from_degrees(48.0, 15.0).unwrap(), 15).unwrap();
        let (width, height) = (400, 300);
        let level = |i: usize| 60.0 + (cell_hash((i % width / 5) as i32, (i / width / 5) as i32, 1) % 128) as f32;
        let mut mask = Mask::filled(width, height, true);
        (0..10 * height).for_each(|i| mask.set(i % 10, i / 10, false));
        RealMap {
            zoom: 15,
            corner_px: [at.x_px as u64, at.y_px as u64],
            gray: Gray::from_values(width, height, (0..width * height).map(level).collect()).unwrap(),
            mask,
        }
    }

    fn scene() -> RepeatingScene {
        let pattern = RepeatingPattern::random(PatternKind::Orchard, 30.0, &mut ChaCha8Rng::seed_from_u64(2));
        let outline = BlockOutline { centre_m: [20.0, 10.0], half_m: [75.0, 50.0], angle_rad: 0.4 };
        RepeatingScene { blocks: vec![PatternBlock { pattern, outline: Some(outline) }], hole: None, real_share: 0.0 }
    }

    #[test]
    fn a_world_is_a_store_of_the_drawn_map_pixel_by_pixel() {
        let (map, look) = (noisy_map(), PatternLook::plain(4));
        let world = RepeatingWorld::build(&map, scene(), &look, 0.0).unwrap();
        let layer = world.store.layer(WORLD_LAYER).unwrap();
        assert_eq!(layer.base_zoom, map.zoom);
        let drawn = drawn_map(&map, &map.frame().unwrap(), &scene(), &look, 0.0);
        let built = RealMap::read(&world.store, layer, world.frame.origin()).unwrap().unwrap();
        let (dx, dy) = (map.corner_px[0] - built.corner_px[0], map.corner_px[1] - built.corner_px[1]);
        let mut sum = 0.0;
        for (x, y, pixel) in drawn.enumerate_pixels() {
            let (u, v) = ((u64::from(x) + dx) as usize, (u64::from(y) + dy) as usize);
            assert_eq!(built.mask.at(u, v), pixel.0[1] == 255);
            sum += (built.gray.at(u, v) * f32::from(pixel.0[1].min(1)) - f32::from(pixel.0[0])).abs();
        }
        assert!(sum / 120_000.0 < 1.0, "{}", sum / 120_000.0);
    }

    #[test]
    fn the_ground_outside_a_block_stays() {
        let (map, look) = (noisy_map(), PatternLook::plain(4));
        let frame = map.frame().unwrap();
        let drawn = drawn_map(&map, &frame, &scene(), &look, 0.0);
        let changed = |x: usize, y: usize| drawn.get_pixel(x as u32, y as u32).0[0] != map.gray.at(x, y) as u8;
        let count = |columns: std::ops::Range<usize>| {
            columns.flat_map(|x| (0..300).map(move |y| (x, y))).filter(|&(x, y)| changed(x, y)).count()
        };
        assert!(count(10..400) > 4000);
        // More than 80 px of 1.6 m west of the middle lies nothing of the block.
        assert_eq!(count(10..120), 0);
    }
}
