//! `TiffSource`: a TIFF file as a source of blocks.

use super::bands::Bands;
use super::layout::{self, Directory, file_directories};
use super::open::open_file;
use crate::raster::block::{BlockSource, PixelBlock, RasterLevel};
use crate::raster::date::tiff_date;
use crate::raster::error::{RasterError, guarded};
use crate::raster::options::OpenOptions;
use std::path::{Path, PathBuf};
use tiff_reader::{Ifd, TiffFile};

/// Least edge of a block, about: several small tiles or strips are read at a time.
const MIN_BLOCK_PX: u64 = 256;
/// Strips are joined to a block up to this many decoded bytes.
const STRIP_BLOCK_BYTES: u64 = 4 << 20;

/// A TIFF file whose layout has been checked, and whose imagery is decoded on demand.
pub(in crate::raster) struct TiffSource {
    path: PathBuf,
    file: TiffFile,
    /// The file that holds the masks: this one, or a `.msk` beside it.
    mask_file: Option<TiffFile>,
    directories: Vec<Directory>,
    levels: Vec<RasterLevel>,
    bands: Bands,
}

impl TiffSource {
    /// Opens a file and checks every directory that will be read.
    ///
    /// # Errors
    /// [`RasterError`] for damaged, unsupported and too large files, and for a missing stretch.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        guarded(path, || {
            let file = open_file(path)?;
            let (directories, masks_are_beside) = file_directories(path, &file)?;
            let bands = Bands::from_image(path, &directories[0].image, options)?;
            let mask_file = match masks_are_beside {
                Some(beside) => Some(open_file(&beside)?),
                None => None,
            };
            let levels = directories.iter().map(|d| block_level(&d.image)).collect();
            Ok(Self { path: path.into(), file, mask_file, directories, levels, bands })
        })
    }

    /// The directory of the full-resolution image.
    pub fn base(&self) -> &Ifd {
        &self.directories[0].image
    }

    /// The acquisition date that the metadata state.
    pub fn acquired(&self) -> Option<String> {
        tiff_date(&self.file, self.base())
    }

    fn read_unguarded(&self, level: usize, column: u64, row: u64) -> Result<PixelBlock, RasterError> {
        let Directory { image, mask } = &self.directories[level];
        let RasterLevel { width_px, height_px, block_width_px, block_height_px } = self.levels[level];
        let (x, y) = (column * block_width_px, row * block_height_px);
        let (width, height) = (block_width_px.min(width_px - x) as usize, block_height_px.min(height_px - y) as usize);
        if layout::is_sparse(image, x, y, width as u64, height as u64) {
            return Ok(PixelBlock::missing(width, height));
        }
        let damaged = |e: tiff_reader::TiffError| {
            RasterError::damaged(&self.path, format!("block {column}, {row} of level {level}: {e}"))
        };
        let (x, y) = (x as usize, y as usize);
        let samples = if self.bands.decoded {
            self.file.read_decoded_window_bytes_from_ifd(image, y, x, height, width)
        } else {
            self.file.read_window_bytes_from_ifd(image, y, x, height, width)
        }
        .map_err(damaged)?;
        let mask = match mask {
            Some(mask) => {
                let file = self.mask_file.as_ref().unwrap_or(&self.file);
                Some(file.read_window_bytes_from_ifd(mask, y, x, height, width).map_err(damaged)?)
            }
            None => None,
        };
        self.bands.block(samples, mask.as_deref(), width, height).ok_or_else(|| {
            RasterError::damaged(
                &self.path,
                format!("block {column}, {row} of level {level} has another size than stated"),
            )
        })
    }
}

impl BlockSource for TiffSource {
    fn levels(&self) -> &[RasterLevel] {
        &self.levels
    }

    /// `false` for JPEG, whose tiles are decoded on rayon's pool.
    fn decodes_alone(&self) -> bool {
        self.base().compression() != 7
    }

    fn is_missing(&self, level: usize, column: u64, row: u64) -> bool {
        let RasterLevel { width_px, height_px, block_width_px, block_height_px } = self.levels[level];
        let (x, y) = (column * block_width_px, row * block_height_px);
        let (width, height) = (block_width_px.min(width_px - x), block_height_px.min(height_px - y));
        layout::is_sparse(&self.directories[level].image, x, y, width, height)
    }

    fn read(&self, level: usize, column: u64, row: u64) -> Result<PixelBlock, RasterError> {
        guarded(&self.path, || self.read_unguarded(level, column, row))
    }
}

/// Returns the blocks by which a directory is read: one tile or several small ones, or several strips.
fn block_level(image: &Ifd) -> RasterLevel {
    let (width_px, height_px) = (u64::from(image.width()), u64::from(image.height()));
    // In a sparse file each tile may be missing, so tiles are not joined.
    let together = if layout::has_sparse_blocks(image) { 1 } else { MIN_BLOCK_PX };
    let gathered = |edge: u64| edge * (together / edge).max(1);
    let (block_width_px, block_height_px) = match (image.tile_width(), image.tile_height()) {
        (Some(w), Some(h)) if image.is_tiled() => (gathered(u64::from(w)), gathered(u64::from(h))),
        _ => {
            let strip_rows = u64::from(image.rows_per_strip()).clamp(1, height_px);
            let row_bytes = width_px * layout::pixel_bytes(image);
            (width_px, strip_rows * (STRIP_BLOCK_BYTES / (row_bytes * strip_rows).max(1)).max(1))
        }
    };
    RasterLevel {
        width_px,
        height_px,
        block_width_px: block_width_px.min(width_px),
        block_height_px: block_height_px.min(height_px),
    }
}
