//! `RepeatingWorld`: a map with patterns drawn into it, as a store of its own in a temporary folder.

use super::look::PatternLook;
use super::real_map::RealMap;
use super::scene::{GroundPatch, RepeatingScene, SceneEpoch};
use crate::trial::error::TrialError;
use crate::trial::mapped_ground::MappedGround;
use overfly_core::geodesy::{LocalFrame, MercatorPoint};
use overfly_core::tile::gsd_at;
use overfly_ingest::build;
use overfly_store::Reader;
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
    image.save(&path).map_err(|e| unwritable(&path, std::io::Error::other(e)))?;
    let centre = |x: f64, y: f64| {
        let point = map.geodetic_from_map([x, y]).expect("a map lies in the world");
        MercatorPoint::from_geodetic(point).expect("a map lies in the world")
    };
    let (first, next) = (centre(0.5, 0.5), centre(1.5, 1.5));
    let (across_m, down_m) = (next.x_m - first.x_m, next.y_m - first.y_m);
    let text = format!("{across_m}\n0\n0\n{down_m}\n{}\n{}\n", first.x_m, first.y_m);
    let path = folder.join("world.pgw");
    std::fs::write(&path, text).map_err(|cause| unwritable(&path, cause))
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
