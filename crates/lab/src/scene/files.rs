//! Writes images, world files, and heights as a GeoTIFF.

use super::terrain::Terrain;
use super::utm::PRJ;
use super::world::CORNER;
use std::io;
use std::path::Path;

/// Writes interleaved RGB as a JPEG; folders are made.
pub fn write_jpeg(path: &Path, pixels: &[u8], [width, height]: [usize; 2], quality: u8) -> io::Result<()> {
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    let side = |n: usize| u16::try_from(n).map_err(|_| io::Error::other("a JPEG has at most 65535 pixels on a side"));
    let encoder = jpeg_encoder::Encoder::new_file(path, quality).map_err(io::Error::other)?;
    encoder.encode(pixels, side(width)?, side(height)?, jpeg_encoder::ColorType::Rgb).map_err(io::Error::other)
}

/// Writes a map: JPEG, world file and `.prj` (EPSG:32633).
pub fn write_map(path: &Path, pixels: &[u8], size_px: [usize; 2], gsd_m_per_px: f64, quality: u8) -> io::Result<()> {
    write_jpeg(path, pixels, size_px, quality)?;
    let half_m = gsd_m_per_px / 2.0;
    let world = format!("{gsd_m_per_px}\n0.0\n0.0\n-{gsd_m_per_px}\n{}\n{}\n", CORNER[0] + half_m, CORNER[1] - half_m);
    std::fs::write(path.with_extension("jgw"), world)?;
    std::fs::write(path.with_extension("prj"), PRJ)
}

/// Writes the knots of a terrain as a GeoTIFF of 32-bit floats (EPSG:32633, a pixel's area around each knot, heights of the scene in
/// metres above EGM2008), and a `.prj` beside it.
///
/// # References
/// TIFF 6.0; OGC GeoTIFF 1.1: ModelPixelScale 33550, ModelTiepoint 33922, GeoKeyDirectory 34735.
pub fn write_heights(path: &Path, terrain: &Terrain) -> io::Result<()> {
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const DOUBLE: u16 = 12;
    let doubles = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let scale = doubles(&[terrain.spacing_m, terrain.spacing_m, 0.0]);
    let half_m = terrain.spacing_m / 2.0;
    let tie = doubles(&[0.0, 0.0, 0.0, CORNER[0] - half_m, CORNER[1] + half_m, 0.0]);
    // Projected, pixel is area, EPSG:32633, heights above EGM2008 (EPSG:3855).
    let keys: Vec<u8> = [1u16, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32633, 4096, 0, 1, 3855]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let pixels: Vec<u8> = terrain.heights_m.iter().flat_map(|v| v.to_le_bytes()).collect();
    const ENTRIES: u32 = 13;
    let extra = 8 + 2 + ENTRIES * 12 + 4;
    let (tie_at, keys_at) = (extra + scale.len() as u32, extra + (scale.len() + tie.len()) as u32);
    let pixels_at = keys_at + keys.len() as u32;
    let entries: [(u16, u16, u32, u32); ENTRIES as usize] = [
        (256, LONG, 1, terrain.columns as u32),
        (257, LONG, 1, terrain.rows as u32),
        (258, SHORT, 1, 32),
        (259, SHORT, 1, 1),
        (262, SHORT, 1, 1),
        (273, LONG, 1, pixels_at),
        (277, SHORT, 1, 1),
        (278, LONG, 1, terrain.rows as u32),
        (279, LONG, 1, pixels.len() as u32),
        (339, SHORT, 1, 3),
        (33550, DOUBLE, 3, extra),
        (33922, DOUBLE, 6, tie_at),
        (34735, SHORT, 20, keys_at),
    ];
    let mut file = b"II\x2a\0\x08\0\0\0".to_vec();
    file.extend((ENTRIES as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(count.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend(0u32.to_le_bytes());
    for part in [scale, tie, keys, pixels] {
        file.extend(part);
    }
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    std::fs::write(path, file)?;
    std::fs::write(path.with_extension("prj"), PRJ)
}
