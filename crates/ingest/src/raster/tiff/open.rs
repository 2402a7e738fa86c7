//! Opening a TIFF file within fixed limits of memory.

use crate::raster::error::RasterError;
use std::path::Path;
use tiff_reader::TiffFile;

/// The largest decoded size of one tile or strip, bytes.
pub(super) const MAX_BLOCK_BYTES: u64 = 256 << 20;

/// Opens a file and parses its directories.
///
/// # Errors
/// [`RasterError::Io`], and [`RasterError::Damaged`] for directories that are malformed or exceed the limits.
pub(super) fn open_file(path: &Path) -> Result<TiffFile, RasterError> {
    let budgets = tiff_reader::ParseBudgets {
        max_ifds: 256,
        max_ifd_entries: 4096,
        // Offsets of eight million blocks.
        max_tag_value_bytes: 64 << 20,
        max_metadata_value_bytes: 192 << 20,
    };
    let options = tiff_reader::OpenOptions {
        // `BlockCache` keeps decoded blocks; this cache only bridges strips and planes of one read.
        block_cache_bytes: 8 << 20,
        block_cache_slots: 4096,
        parse_budgets: budgets,
        decode_output_bytes: MAX_BLOCK_BYTES as usize,
    };
    TiffFile::open_with_options(path, options).map_err(|e| match e {
        tiff_reader::TiffError::Io(source, _) => RasterError::io(path, source),
        other => RasterError::damaged(path, other.to_string()),
    })
}
