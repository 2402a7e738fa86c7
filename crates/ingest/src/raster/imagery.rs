//! `Imagery`: rectangles of pixels of a photo or an orthophoto, without their position on the earth.

use super::block::{BlockCache, BlockSource};
use super::error::RasterError;
use super::options::OpenOptions;
use super::tiff::TiffSource;
use super::window::{CachedBlocks, Window};
use crate::remedy::Remedy;
use overfly_core::pixels::{Gray, Mask};
use overfly_flight::frame::{FrameError, read_frame};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// An opened image of which only the pixels count. A GeoTIFF is read by blocks on demand; PNG, JPEG and WebP are decoded
/// whole.
pub struct Imagery {
    pixels: Pixels,
}

enum Pixels {
    Whole(Gray),
    Blocks { source: Box<dyn BlockSource>, cache: Arc<BlockCache>, source_key: u64 },
}

/// Why an image gives no pixels.
#[derive(Debug, thiserror::Error)]
pub enum ImageryError {
    /// A GeoTIFF that cannot be read.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// Any other image that cannot be read.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl ImageryError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Raster(e) => e.code(),
            Self::Frame(e) => e.code(),
        }
    }

    /// What the user can do, where that is known.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Raster(e) => e.remedy(),
            Self::Frame(_) => None,
        }
    }
}

impl std::fmt::Debug for Imagery {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Imagery").field("size_px", &self.size_px()).finish_non_exhaustive()
    }
}

impl Imagery {
    /// Opens a GeoTIFF or COG, or decodes a PNG, JPEG or WebP image. The image needs no georeference; `options.crs` is
    /// ignored.
    ///
    /// # Errors
    /// [`ImageryError`] where the file cannot be read or decoded.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, ImageryError> {
        if !is_tiff(path) {
            return Ok(Self { pixels: Pixels::Whole(read_frame(path)?) });
        }
        let source = Box::new(TiffSource::open(path, options)?);
        let cache = options.cache.clone().unwrap_or_default();
        let source_key = cache.new_source();
        Ok(Self { pixels: Pixels::Blocks { source, cache, source_key } })
    }

    /// Columns and rows.
    pub fn size_px(&self) -> [usize; 2] {
        match &self.pixels {
            Pixels::Whole(gray) => [gray.width_px(), gray.height_px()],
            Pixels::Blocks { source, .. } => {
                let size = source.levels()[0];
                [size.width_px as usize, size.height_px as usize]
            }
        }
    }

    /// Returns a rectangle of pixels as luma (ITU-R BT.601), and the mask of the valid ones; invalid pixels are 0. `corner` is
    /// the column and row of the upper-left pixel. `None` where the rectangle is empty or exceeds the image.
    ///
    /// # Errors
    /// [`ImageryError`] where a block cannot be read or decoded.
    pub fn gray(&self, corner: [usize; 2], size_px: [usize; 2]) -> Result<Option<(Gray, Mask)>, ImageryError> {
        let ends = [0, 1].map(|k| corner[k].saturating_add(size_px[k]));
        if (0..2).any(|k| size_px[k] == 0 || ends[k] > self.size_px()[k]) {
            return Ok(None);
        }
        let mut mask = Mask::filled(size_px[0], size_px[1], true);
        let values = match &self.pixels {
            Pixels::Whole(gray) => {
                (corner[1]..ends[1]).flat_map(|y| &gray.row(y)[corner[0]..ends[0]]).copied().collect()
            }
            Pixels::Blocks { source, cache, source_key } => {
                let mut window = Window::default();
                let blocks = CachedBlocks { source: source.as_ref(), cache, source_key: *source_key };
                window.load(&blocks, 0, [corner[0], corner[1], ends[0], ends[1]].map(|v| v as i64))?;
                for (i, _) in window.values().iter().enumerate().filter(|(_, pixel)| pixel[3] == 0.0) {
                    mask.set(i % size_px[0], i / size_px[0], false);
                }
                window.values().iter().map(|[r, g, b, _]| 0.299 * r + 0.587 * g + 0.114 * b).collect()
            }
        };
        Ok(Gray::from_values(size_px[0], size_px[1], values).map(|gray| (gray, mask)))
    }
}

/// Whether the first bytes are a TIFF's; `false` for a file that cannot be read.
fn is_tiff(path: &Path) -> bool {
    let mut start = Vec::new();
    path.is_file()
        && std::fs::File::open(path).and_then(|file| file.take(4).read_to_end(&mut start)).is_ok()
        && matches!(start.as_slice(), [b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/fixtures").join(name)
    }

    fn opened(name: &str) -> Imagery {
        Imagery::open(&fixture(name), &OpenOptions::default()).unwrap()
    }

    #[test]
    fn blocks_and_a_whole_image_give_the_same_rectangle() {
        // The same scene once tiled without loss and once as PNG (tests/fixtures/make.py).
        let (tiled, whole) = (opened("tiled_deflate.tif"), opened("photo_png.png"));
        assert_eq!(tiled.size_px(), whole.size_px());
        let [width, height] = whole.size_px();
        for (corner, size) in [([0, 0], [width, height]), ([3, 7], [20, 9]), ([width - 1, height - 1], [1, 1])] {
            let (a, b) = (tiled.gray(corner, size).unwrap().unwrap(), whole.gray(corner, size).unwrap().unwrap());
            let ((a, of_a), (b, of_b)) = (a, b);
            assert!(of_a == of_b && of_a == Mask::filled(size[0], size[1], true));
            let far = a.values().iter().zip(b.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(far < 1e-3, "{corner:?} {size:?}: {far}");
        }
        for (corner, size) in [([1, 0], [width, 1]), ([0, 0], [0, 3]), ([usize::MAX, 0], [2, 2])] {
            assert!(tiled.gray(corner, size).unwrap().is_none() && whole.gray(corner, size).unwrap().is_none());
        }
    }

    #[test]
    fn needs_valid_pixels_but_no_georeference() {
        for name in ["no_place.tif", "no_crs.tif"] {
            assert!(opened(name).gray([0, 0], [4, 4]).unwrap().is_some(), "{name}");
        }
        let holed = opened("nodata.tif");
        let (gray, mask) = holed.gray([0, 0], holed.size_px()).unwrap().unwrap();
        let [width, height] = holed.size_px();
        let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let missing = places().filter(|&(x, y)| !mask.at(x, y)).count();
        assert!(missing > 0 && missing < width * height, "{missing}");
        assert!(places().all(|(x, y)| mask.at(x, y) || gray.at(x, y) == 0.0));
        let open = |name: &str| Imagery::open(&fixture(name), &OpenOptions::default()).unwrap_err().code();
        assert_eq!((open("uint16.tif"), open("none.tif")), ("source_needs_stretch", "image_unreadable"));
    }
}
