//! Frames too large for memory: read row by row, or at a fraction of their size.

use super::bounds::FrameBounds;
use super::decode::{decode_frame_within, header_of, read_file};
use super::error::{FrameError, not_an_image};
use image::ImageFormat;
use overfly_core::pixels::Gray;
use std::io::Cursor;
use std::path::Path;

/// A frame at a reduced size.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedFrame {
    /// The pixels, each the mean of `reduction` x `reduction` pixels of the file.
    pub gray: Gray,
    /// Pixels of the file along each axis of one pixel: 1, 2, 4 or 8.
    pub reduction: u32,
}

/// Reads a frame as [`super::read_frame`]; a PNG or JPEG that exceeds the default bounds is reduced to the means of 2 x 2, 4 x 4 or
/// 8 x 8 pixels, and only the reduced size is held in memory.
///
/// # Errors
/// As [`super::read_frame`]. Interlaced PNG, progressive JPEG and WebP cannot be read in pieces and are refused as too large.
pub fn read_large_frame(path: &Path) -> Result<ReducedFrame, FrameError> {
    read_large_frame_within(path, FrameBounds::default())
}

/// Reads a frame as [`read_large_frame`], within given bounds: a frame of more pixels is reduced to at most a quarter of the bound.
///
/// # Errors
/// As [`read_large_frame`].
pub fn read_large_frame_within(path: &Path, bounds: FrameBounds) -> Result<ReducedFrame, FrameError> {
    let bytes = read_file(path)?;
    let name = path.display().to_string();
    let (format, [width, height]) = header_of(&bytes, &name, bounds)?;
    let pixels = u64::from(width) * u64::from(height);
    let reduction = [2, 4, 8].into_iter().find(|r| pixels / u64::from(r * r) <= bounds.pixels / 4);
    if pixels > bounds.pixels && width.max(height) <= bounds.edge_px {
        let reduced = match (format, reduction) {
            (Some(ImageFormat::Png), Some(r)) => png(&bytes, r as usize).map_err(|e| not_an_image(&name, e))?,
            (Some(ImageFormat::Jpeg), Some(r)) => jpeg(&bytes, r as u16).map_err(|e| not_an_image(&name, e))?,
            _ => None,
        };
        if let (Some(gray), Some(reduction)) = (reduced, reduction) {
            return Ok(ReducedFrame { gray, reduction });
        }
    }
    Ok(ReducedFrame { gray: decode_frame_within(&bytes, &name, bounds)?, reduction: 1 })
}

/// Reduces a PNG row by row; `None` where it is interlaced. Rows and columns that fill no pixel are dropped.
fn png(bytes: &[u8], reduction: usize) -> Result<Option<Gray>, png::DecodingError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info()?;
    let (width, height, interlaced) =
        (reader.info().width as usize, reader.info().height as usize, reader.info().interlaced);
    if interlaced {
        return Ok(None);
    }
    let samples = reader.output_color_type().0.samples();
    let (columns, rows) = (width / reduction, height / reduction);
    let mut out = Gray::filled(columns, rows, 0.0);
    let share = 1.0 / (reduction * reduction) as f32;
    for y in 0..rows * reduction {
        let Some(row) = reader.next_row()? else { break };
        let target = &mut out.values_mut()[y / reduction * columns..][..columns];
        for (sum, pixels) in target.iter_mut().zip(row.data().chunks_exact(samples * reduction)) {
            *sum += share * pixels.chunks_exact(samples).map(luma).sum::<f32>();
        }
    }
    Ok(Some(out))
}

/// Reduces a JPEG by the lower frequencies of every block; `None` where it is progressive, for then all blocks are held until its end.
fn jpeg(bytes: &[u8], reduction: u16) -> Result<Option<Gray>, jpeg_decoder::Error> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.read_info()?;
    let info = decoder.info().expect("the header was read");
    if info.coding_process != jpeg_decoder::CodingProcess::DctSequential {
        return Ok(None);
    }
    let samples = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => 1,
        jpeg_decoder::PixelFormat::RGB24 => 3,
        _ => return Ok(None),
    };
    let (width, height) = decoder.scale(info.width.div_ceil(reduction), info.height.div_ceil(reduction))?;
    let values = decoder.decode()?.chunks_exact(samples).map(luma).collect();
    Ok(Gray::from_values(width.into(), height.into(), values))
}

/// Luma (ITU-R BT.601) of a gray or colour pixel, with or without alpha.
fn luma(pixel: &[u8]) -> f32 {
    match *pixel {
        [r, g, b, ..] => 0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b),
        [gray, ..] => f32::from(gray),
        [] => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::read_frame;

    const BOUNDS: FrameBounds = FrameBounds { edge_px: 1000, pixels: 20_000 };

    /// A smooth scene, so that JPEG keeps it.
    fn scene(width: u32, height: u32) -> image::RgbImage {
        let wave =
            |x: u32, y: u32, k: f32| (120.0 + 80.0 * ((x as f32 / 31.0).sin() * (y as f32 / (17.0 * k)).cos())) as u8;
        image::RgbImage::from_fn(width, height, |x, y| image::Rgb([wave(x, y, 1.0), wave(x, y, 1.3), wave(y, x, 0.9)]))
    }

    fn written(name: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        scene(410, 302).save(&path).unwrap();
        (folder, path)
    }

    #[test]
    fn what_is_too_large_to_hold_is_the_mean_of_its_pixels() {
        for (name, tolerance) in [("a.png", 1e-3), ("a.jpg", 2.0)] {
            let (_folder, path) = written(name);
            let reduced = read_large_frame_within(&path, BOUNDS).unwrap();
            assert_eq!(reduced.reduction, 8, "{name}");
            let whole = read_frame(&path).unwrap().binned(8);
            for (x, y) in [(0, 0), (7, 3), (50, 36)] {
                let (found, expected) = (reduced.gray.at(x, y), whole.at(x, y));
                assert!((found - expected).abs() < tolerance, "{name} {x} {y}: {found} {expected}");
            }
        }
    }

    #[test]
    fn what_can_be_held_is_read_whole() {
        let (_folder, path) = written("a.png");
        let read = read_large_frame(&path).unwrap();
        assert_eq!((read.reduction, read.gray), (1, read_frame(&path).unwrap()));
    }

    #[test]
    fn a_truncated_one_is_no_image_and_a_longer_edge_too_large() {
        for name in ["a.png", "a.jpg"] {
            let (_folder, path) = written(name);
            let edge_px = 400;
            let refused = read_large_frame_within(&path, FrameBounds { edge_px, ..BOUNDS }).unwrap_err();
            assert_eq!(refused.code(), "image_too_large");
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(&path, &bytes[..bytes.len() / 3]).unwrap();
            let refused = read_large_frame_within(&path, BOUNDS).unwrap_err();
            assert_eq!(refused.code(), "not_an_image", "{name}");
        }
    }
}
