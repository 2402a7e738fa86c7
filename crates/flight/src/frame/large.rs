//! Frames too large for memory: read row by row, or at a fraction of their size.

use super::bounds::FrameBounds;
use super::decode::{decode_frame_within, read_file, size_of};
use super::error::{Fault, FrameError};
use super::format::Format;
use super::{jpeg, png};
use overfly_core::jpeg::Reduction;
use overfly_core::pixels::Gray;
use std::path::Path;

const REDUCTIONS: [Reduction; 3] = [Reduction::Half, Reduction::Quarter, Reduction::Eighth];

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
    let read = |fault: Fault| fault.named(&name, bounds);
    let (format, [width, height]) = size_of(&bytes).map_err(read)?;
    let pixels = u64::from(width) * u64::from(height);
    let reduction = REDUCTIONS.into_iter().find(|r| pixels / (r.divisor() as u64).pow(2) <= bounds.pixels / 4);
    let Some(reduction) = reduction.filter(|_| pixels > bounds.pixels && width.max(height) <= bounds.edge_px) else {
        return Ok(ReducedFrame { gray: decode_frame_within(&bytes, &name, bounds)?, reduction: 1 });
    };
    let reduced = match format {
        Format::Png => png::reduced(&bytes, reduction.divisor()).map_err(read)?,
        Format::Jpeg if !jpeg::read_header(&bytes).map_err(read)?.is_progressive => {
            Some(jpeg::gray(&bytes, reduction).map_err(read)?)
        }
        _ => None,
    };
    match reduced {
        Some(gray) => Ok(ReducedFrame { gray, reduction: reduction.divisor() as u32 }),
        None => Err(read(Fault::TooLarge(format!("{width} x {height} pixels")))),
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
    fn a_truncated_one_is_damaged_and_a_longer_edge_too_large() {
        for name in ["a.png", "a.jpg"] {
            let (_folder, path) = written(name);
            let edge_px = 400;
            let refused = read_large_frame_within(&path, FrameBounds { edge_px, ..BOUNDS }).unwrap_err();
            assert_eq!(refused.code(), "image_too_large");
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(&path, &bytes[..bytes.len() / 3]).unwrap();
            let refused = read_large_frame_within(&path, BOUNDS).unwrap_err();
            assert_eq!(refused.code(), "image_damaged", "{name}");
        }
    }
}
