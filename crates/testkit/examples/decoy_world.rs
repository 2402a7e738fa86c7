//! Writes a world of decoys: real pictures mirrored, turned and rescaled, patch beside patch, georeferenced.
//!
//! `cargo run --release -p overfly-testkit --example decoy_world -- --out FOLDER --square-km 50000 PICTURE...` writes
//! JPEG sheets with world files and `.prj` that `overfly build` can read. No patch is a true copy of the ground it
//! shows: every one is mirrored. The same seed and pictures give the same files.

use anyhow::{Context, ensure};
use clap::Parser;
use overfly_core::geodesy::{Geodetic, MercatorPoint};
use overfly_core::pixels::{Gray, Mask};
use overfly_core::tile::{TILE_SIZE_PX, TileId, zoom_for_gsd};
use overfly_flight::frame::read_frame;
use overfly_ingest::raster::{OpenOptions, Orthophoto};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Writes a world of decoys.
#[derive(Parser)]
struct Args {
    /// Orthophotos, and photographs taken as if they were.
    #[arg(required = true)]
    pictures: Vec<PathBuf>,
    /// Folder to write to.
    #[arg(long)]
    out: PathBuf,
    /// Least ground to cover.
    #[arg(long, default_value_t = 1000.0)]
    square_km: f64,
    /// Ground sample distance to assume for every picture.
    #[arg(long, default_value_t = 5.0)]
    gsd_m_per_px: f64,
    /// North-western corner.
    #[arg(long, default_value_t = 47.4)]
    latitude_deg: f64,
    /// North-western corner.
    #[arg(long, default_value_t = -98.9)]
    longitude_deg: f64,
    /// Another seed is another world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Edge of a patch, which holds two frames of the trials.
const PATCH_PX: usize = 480;
/// Patches along a sheet's edge.
const PATCHES: usize = 8;
/// Sheets in a row of the world.
const SHEETS_IN_A_ROW: usize = 12;
const SCALES: std::ops::Range<f64> = 0.75..1.4;
/// Web Mercator, as GIS tools write it.
const PRJ: &str = r#"PROJCS["WGS 84 / Pseudo-Mercator",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Mercator_1SP"],PARAMETER["central_meridian",0],PARAMETER["scale_factor",1],PARAMETER["false_easting",0],PARAMETER["false_northing",0],UNIT["metre",1],AUTHORITY["EPSG","3857"]]"#;

/// A picture without its place.
struct Picture {
    gray: Gray,
    mask: Mask,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let pictures = args.pictures.iter().map(|path| read(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let corner = Geodetic::from_degrees(args.latitude_deg, args.longitude_deg)?;
    let corner = MercatorPoint::from_geodetic(corner)?;
    let stretch = 1.0 / args.latitude_deg.to_radians().cos();
    let sheet_px = PATCH_PX * PATCHES;
    let sheet_km = sheet_px as f64 * args.gsd_m_per_px / 1000.0;
    let sheets = (args.square_km / sheet_km.powi(2)).ceil() as usize;
    std::fs::create_dir_all(&args.out)?;
    (0..sheets).into_par_iter().try_for_each(|index| {
        let pixel_m = args.gsd_m_per_px * stretch;
        let offset_m = |n: usize| (n * sheet_px) as f64 * pixel_m;
        let x_m = corner.x_m + offset_m(index % SHEETS_IN_A_ROW) + pixel_m / 2.0;
        let y_m = corner.y_m - offset_m(index / SHEETS_IN_A_ROW) - pixel_m / 2.0;
        let path = args.out.join(format!("sheet_{index:04}.jpg"));
        write(&path, &sheet(&pictures, args.seed, index), [x_m, y_m], pixel_m)
    })?;
    println!("{sheets} sheets of {sheet_km:.1} km in {}", args.out.display());
    Ok(())
}

/// Reads the pixels of an orthophoto through the tiles it meets, or a photograph as it is.
fn read(path: &Path) -> anyhow::Result<Picture> {
    let Ok(photo) = Orthophoto::open(path, &OpenOptions::default()) else {
        let gray = read_frame(path).with_context(|| format!("{} is no picture", path.display()))?;
        let mask = Mask::filled(gray.width_px(), gray.height_px(), true);
        return Ok(Picture { gray, mask });
    };
    let about = photo.description();
    let zoom = zoom_for_gsd(about.outline[0], about.gsd_m_per_px * 1.4);
    let tiles = about.outline.iter().map(|&p| TileId::containing(p, zoom)).collect::<Result<Vec<_>, _>>()?;
    let columns = tiles.iter().map(|t| t.column());
    let rows = tiles.iter().map(|t| t.row());
    let (left, right) = (columns.clone().min().unwrap_or(0), columns.max().unwrap_or(0));
    let (top, bottom) = (rows.clone().min().unwrap_or(0), rows.max().unwrap_or(0));
    let size = TILE_SIZE_PX as usize;
    let (width, height) = ((right - left + 1) as usize * size, (bottom - top + 1) as usize * size);
    let mut gray = Gray::filled(width, height, 0.0);
    let mut mask = Mask::filled(width, height, false);
    for (row, column) in (top..=bottom).flat_map(|r| (left..=right).map(move |c| (r, c))) {
        let Some(tile) = photo.warp(TileId::new(zoom, column, row)?)? else { continue };
        let from = tile.colour.to_gray();
        for y in 0..size {
            let to = ((row - top) as usize * size + y) * width + (column - left) as usize * size;
            gray.values_mut()[to..to + size].copy_from_slice(from.row(y));
            let valid = &tile.mask.values()[y * size..(y + 1) * size];
            mask.values_mut()[to..to + size].copy_from_slice(valid);
        }
    }
    Ok(Picture { gray, mask })
}

/// Draws a sheet of patches; each sheet has a random stream of its own.
fn sheet(pictures: &[Picture], seed: u64, index: usize) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index as u64);
    let width = PATCH_PX * PATCHES;
    let mut values = vec![0u8; width * width];
    for (row, column) in (0..PATCHES).flat_map(|r| (0..PATCHES).map(move |c| (r, c))) {
        let place = patch(pictures, &mut rng);
        for y in 0..PATCH_PX {
            let line = &mut values[(row * PATCH_PX + y) * width + column * PATCH_PX..][..PATCH_PX];
            for (x, value) in line.iter_mut().enumerate() {
                let [u, v] = place.at(x as f64, y as f64);
                *value = place.picture.gray.sample(u, v).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
    values
}

/// The place of a patch in a picture: mirrored, turned, rescaled.
struct PatchCut<'a> {
    picture: &'a Picture,
    centre: [f64; 2],
    turn: [f64; 2],
}

impl PatchCut<'_> {
    /// The picture's point of a patch's pixel.
    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        // Mirrored: left is right.
        let (x, y) = (PATCH_PX as f64 / 2.0 - x - 0.5, y + 0.5 - PATCH_PX as f64 / 2.0);
        let [cos, sin] = self.turn;
        [self.centre[0] + cos * x - sin * y, self.centre[1] + sin * x + cos * y]
    }

    fn is_whole(&self) -> bool {
        let (width, height) = (self.picture.gray.width_px() as f64, self.picture.gray.height_px() as f64);
        let steps = (0..=8).map(|i| i as f64 / 8.0 * (PATCH_PX - 1) as f64);
        steps.clone().flat_map(|y| steps.clone().map(move |x| (x, y))).all(|(x, y)| {
            let [u, v] = self.at(x, y);
            u >= 2.0 && v >= 2.0 && u < width - 2.0 && v < height - 2.0 && self.picture.mask.at(u as usize, v as usize)
        })
    }
}

/// Draws a picture and a cut that lies inside it.
fn patch<'a>(pictures: &'a [Picture], rng: &mut ChaCha8Rng) -> PatchCut<'a> {
    loop {
        let picture = &pictures[rng.random_range(0..pictures.len())];
        for _ in 0..200 {
            let scale = rng.random_range(SCALES);
            let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let at = |n: usize, share: f64| n as f64 * share;
            let centre = [
                at(picture.gray.width_px(), rng.random_range(0.0..1.0)),
                at(picture.gray.height_px(), rng.random_range(0.0..1.0)),
            ];
            let cut = PatchCut { picture, centre, turn: [cos / scale, sin / scale] };
            if cut.is_whole() {
                return cut;
            }
        }
    }
}

fn write(path: &Path, values: &[u8], corner_m: [f64; 2], pixel_m: f64) -> anyhow::Result<()> {
    let side = u16::try_from(PATCH_PX * PATCHES)?;
    ensure!(values.len() == usize::from(side).pow(2), "a sheet is square");
    let encoder = jpeg_encoder::Encoder::new_file(path, 92)?;
    encoder.encode(values, side, side, jpeg_encoder::ColorType::Luma)?;
    let [x, y] = corner_m;
    std::fs::write(path.with_extension("jgw"), format!("{pixel_m}\n0\n0\n-{pixel_m}\n{x}\n{y}\n"))?;
    std::fs::write(path.with_extension("prj"), PRJ)?;
    Ok(())
}
