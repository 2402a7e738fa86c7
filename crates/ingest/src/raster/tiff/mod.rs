//! GeoTIFF and COG, read by blocks through `tiff-reader`.

mod bands;
mod georeference;
mod keys;
mod layout;

pub(super) use georeference::placement;

use self::bands::Bands;
use self::layout::{Directory, check_layout, file_directories};
use super::block::{Block, BlockSource, Level};
use super::error::{RasterError, guarded};
use super::{OpenOptions, date};
use std::path::{Path, PathBuf};
use tiff_reader::{Ifd, TiffFile};

/// Blocks are at least about this large, so that small tiles and strips are read several at a time.
const MIN_BLOCK_PX: u64 = 256;
/// Strips are gathered up to this many decoded bytes.
const STRIP_BLOCK_BYTES: u64 = 4 << 20;

/// A TIFF file whose layout has been checked; nothing of its imagery is decoded yet.
pub(super) struct TiffSource {
    path: PathBuf,
    file: TiffFile,
    /// The file that holds the masks: this one, or a `.msk` beside it.
    mask_file: Option<TiffFile>,
    directories: Vec<Directory>,
    levels: Vec<Level>,
    bands: Bands,
}

impl TiffSource {
    /// Opens and checks every directory that will be read.
    ///
    /// # Errors
    /// What [`RasterError`] says of damaged, unsupported and too large files, and of missing stretches.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        guarded(path, || {
            let file = open_file(path)?;
            let (directories, masks_are_beside) = file_directories(path, &file)?;
            let bands = Bands::of(path, &directories[0].image, options)?;
            let mask_file = match masks_are_beside {
                Some(beside) => Some(open_file(&beside)?),
                None => None,
            };
            let levels = directories.iter().map(|d| level_of(&d.image)).collect();
            Ok(Self { path: path.into(), file, mask_file, directories, levels, bands })
        })
    }

    /// Where the image lies, by its tags.
    pub fn base(&self) -> &Ifd {
        &self.directories[0].image
    }

    /// The date that its metadata state.
    pub fn acquired(&self) -> Option<String> {
        date::of_tiff(&self.file, self.base())
    }

    fn read_unguarded(&self, level: usize, column: u64, row: u64) -> Result<Block, RasterError> {
        let Directory { image, mask } = &self.directories[level];
        let Level { width_px, height_px, block_width_px, block_height_px } = self.levels[level];
        let (x, y) = (column * block_width_px, row * block_height_px);
        let (width, height) = (block_width_px.min(width_px - x) as usize, block_height_px.min(height_px - y) as usize);
        if layout::is_sparse(image, x, y, width as u64, height as u64) {
            return Ok(Block::missing(width, height));
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
    fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// JPEG tiles are decoded with the help of rayon's pool.
    fn decodes_alone(&self) -> bool {
        self.base().compression() != 7
    }

    fn is_missing(&self, level: usize, column: u64, row: u64) -> bool {
        let Level { width_px, height_px, block_width_px, block_height_px } = self.levels[level];
        let (x, y) = (column * block_width_px, row * block_height_px);
        let (width, height) = (block_width_px.min(width_px - x), block_height_px.min(height_px - y));
        layout::is_sparse(&self.directories[level].image, x, y, width, height)
    }

    fn read(&self, level: usize, column: u64, row: u64) -> Result<Block, RasterError> {
        guarded(&self.path, || self.read_unguarded(level, column, row))
    }
}

fn open_file(path: &Path) -> Result<TiffFile, RasterError> {
    let budgets = tiff_reader::ParseBudgets {
        max_ifds: 256,
        max_ifd_entries: 4096,
        // Offsets of eight million blocks.
        max_tag_value_bytes: 64 << 20,
        max_metadata_value_bytes: 192 << 20,
    };
    let options = tiff_reader::OpenOptions {
        // Decoded blocks are kept by `BlockCache`; this one only bridges strips and planes of one read.
        block_cache_bytes: 8 << 20,
        block_cache_slots: 4096,
        parse_budgets: budgets,
        decode_output_bytes: layout::MAX_BLOCK_BYTES as usize,
    };
    TiffFile::open_with_options(path, options).map_err(|e| match e {
        tiff_reader::TiffError::Io(source, _) => RasterError::io(path, source),
        other => RasterError::damaged(path, other.to_string()),
    })
}

/// The blocks that a directory is read by: whole tiles, several where they are small; whole strips, several together.
fn level_of(image: &Ifd) -> Level {
    let (width_px, height_px) = (u64::from(image.width()), u64::from(image.height()));
    // Tiles that were never written are missing one by one.
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
    Level {
        width_px,
        height_px,
        block_width_px: block_width_px.min(width_px),
        block_height_px: block_height_px.min(height_px),
    }
}

/// Checks a directory as [`check_layout`] does; for side files.
fn checked_mask(path: &Path, file: &TiffFile, mask: &Ifd) -> Result<(), RasterError> {
    check_layout(path, file, mask)
}
