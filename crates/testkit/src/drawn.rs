//! Material of tests: a store of the project's drawn tiles, and small orthophotos (PNG with world file, EPSG:32633, 1
//! m pixels).

use overfly_ingest::build::{self, Request};
use overfly_store::Reader;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// EPSG code of every drawn source.
pub const CRS: u32 = 32633;

/// Writes an image of smooth noise that depends on `seed`. Its upper-left corner lies `offset` pixels (east, south)
/// from a fixed place. With `hole`, its middle third is transparent.
pub fn orthophoto(folder: &Path, name: &str, size: (u32, u32), offset: (u32, u32), seed: u32, hole: bool) -> PathBuf {
    let image = image::RgbaImage::from_fn(size.0, size.1, |x, y| {
        let (east, south) = (x + offset.0, y + offset.1);
        let level =
            |channel: u32| (noise(east, south, 40, seed + channel) * 0.7 + noise(east, south, 9, seed) * 0.3) as u8;
        let inside = |v: u32, n: u32| v > n / 3 && v < n * 2 / 3;
        let alpha = if hole && inside(x, size.0) && inside(y, size.1) { 0 } else { 255 };
        image::Rgba([level(0), level(1), level(2), alpha])
    });
    let path = folder.join(name);
    image.save_with_format(&path, image::ImageFormat::Png).expect("the rig reads and writes its own files");
    let (east, north) = (500_000.5 + f64::from(offset.0), 5_400_000.5 - f64::from(offset.1));
    std::fs::write(path.with_extension("pgw"), format!("1\n0\n0\n-1\n{east}\n{north}\n"))
        .expect("the rig reads and writes its own files");
    path
}

/// Value noise in [0, 255]: random at the points of a grid, bilinear between them.
fn noise(x: u32, y: u32, grid: u32, seed: u32) -> f32 {
    let at = |x: u32, y: u32| {
        let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
        ((h ^ (h >> 15)) & 0xff) as f32
    };
    let (gx, gy) = (x / grid, y / grid);
    let (fx, fy) = ((x % grid) as f32 / grid as f32, (y % grid) as f32 / grid as f32);
    let top = at(gx, gy) * (1.0 - fx) + at(gx + 1, gy) * fx;
    let bottom = at(gx, gy + 1) * (1.0 - fx) + at(gx + 1, gy + 1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// A path of the repository.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A store of one source, its layer `ortho`.
pub fn built(folder: &Path, source: &Path) -> Reader {
    let db = folder.join("store.gpkg");
    let request = Request {
        db: db.clone(),
        layer: "ortho".into(),
        sources: vec![source.into()],
        horizontal_error_m: Some(0.0),
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).expect("the drawn tiles build");
    Reader::open(&db).expect("the sound store opens")
}

/// The drawn first epoch, built once for all tests.
pub fn drawn_store() -> &'static Reader {
    static STORE: OnceLock<(tempfile::TempDir, Reader)> = OnceLock::new();
    &STORE
        .get_or_init(|| {
            let folder = tempfile::tempdir().expect("the rig reads and writes its own files");
            let reader = built(folder.path(), &project("tiles/epoch_1"));
            (folder, reader)
        })
        .1
}
