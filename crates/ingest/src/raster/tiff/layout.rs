//! A TIFF's directories: the image, overviews and masks to read, and the checks of their layout.

use super::open::{MAX_BLOCK_BYTES, open_file};
use crate::raster::error::RasterError;
use crate::remedy::Remedy;
use std::path::{Path, PathBuf};
use tiff_reader::{Ifd, TiffFile};

/// The most overviews in sub-directories of the image that are read.
const MAX_SUB_DIRECTORIES: usize = 32;

const TAG_NEW_SUBFILE_TYPE: u16 = 254;
const TAG_SUBFILE_TYPE: u16 = 255;
const TAG_PIXEL_SCALE: u16 = 33550;
const TAG_TRANSFORMATION: u16 = 34264;
const TAG_GEO_KEYS: u16 = 34735;
const REDUCED: u64 = 1;
const MASK: u64 = 4;

/// One resolution: its imagery, and its mask where there is one.
pub(super) struct Directory {
    pub image: Ifd,
    pub mask: Option<Ifd>,
}

/// Returns the image (the first one with a georeference, else the first) and its overviews, finer first, with their masks;
/// and the path of the side file that holds the mask, where the file itself has none.
///
/// # Errors
/// [`RasterError`] where the image or its mask cannot be read.
pub(super) fn file_directories(path: &Path, file: &TiffFile) -> Result<(Vec<Directory>, Option<PathBuf>), RasterError> {
    let images = || file.ifds().iter().filter(|ifd| kind(ifd) & (REDUCED | MASK) == 0);
    let base = images()
        .find(|ifd| [TAG_GEO_KEYS, TAG_PIXEL_SCALE, TAG_TRANSFORMATION].iter().any(|t| ifd.tag(*t).is_some()))
        .or_else(|| images().next())
        .ok_or_else(|| RasterError::damaged(path, "it holds no full-resolution image"))?
        .clone();
    check_layout(path, file, &base)?;
    let nested = base.sub_ifd_offsets().unwrap_or_default();
    let nested = nested.into_iter().take(MAX_SUB_DIRECTORIES).filter_map(|offset| file.read_ifd_at_offset(offset).ok());
    let mut overviews: Vec<Ifd> = file
        .ifds()
        .iter()
        .cloned()
        .chain(nested)
        .filter(|ifd| kind(ifd) & (REDUCED | MASK) == REDUCED && is_overview_of(&base, ifd))
        .filter(|ifd| check_layout(path, file, ifd).is_ok())
        .collect();
    overviews.sort_by_key(|ifd| std::cmp::Reverse(ifd.width()));
    let masks: Vec<&Ifd> = file.ifds().iter().filter(|ifd| kind(ifd) & MASK != 0).collect();
    let find_mask = |image: &Ifd| {
        masks.iter().find(|m| (m.width(), m.height()) == (image.width(), image.height())).map(|m| (*m).clone())
    };
    let mut directories: Vec<Directory> =
        std::iter::once(base).chain(overviews).map(|image| Directory { mask: find_mask(&image), image }).collect();
    // Masks of overviews alone are ignored; an overview without a mask is not used where the image has one.
    if directories[0].mask.is_some() {
        directories.retain(|d| d.mask.is_some());
        for directory in &directories {
            check_layout(path, file, directory.mask.as_ref().expect("retained for having one"))?;
        }
        return Ok((directories, None));
    }
    let beside = side_mask_path(path);
    if !beside.is_file() {
        return Ok((directories, None));
    }
    let mask_file = open_file(&beside)?;
    let image = &directories[0].image;
    let found = mask_file.ifds().iter().find(|m| (m.width(), m.height()) == (image.width(), image.height()));
    let mask =
        found.cloned().ok_or_else(|| RasterError::damaged(&beside, "the mask has another size than its image"))?;
    check_layout(&beside, &mask_file, &mask)?;
    directories.truncate(1);
    directories[0].mask = Some(mask);
    Ok((directories, Some(beside)))
}

/// Returns `image.tif.msk`, the path of GDAL's mask beside an image.
fn side_mask_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".msk");
    name.into()
}

fn kind(ifd: &Ifd) -> u64 {
    let old = || match ifd.tag(TAG_SUBFILE_TYPE)?.value.as_u64()? {
        2 => Some(REDUCED),
        _ => None,
    };
    ifd.tag(TAG_NEW_SUBFILE_TYPE).and_then(|t| t.value.as_u64()).or_else(old).unwrap_or(0)
}

/// Whether a directory is an overview: the same samples, fewer pixels, and the same shape within a pixel's rounding.
fn is_overview_of(base: &Ifd, other: &Ifd) -> bool {
    let same_samples = base.samples_per_pixel() == other.samples_per_pixel()
        && base.bits_per_sample().ok() == other.bits_per_sample().ok()
        && base.sample_format().ok() == other.sample_format().ok()
        && base.photometric_interpretation() == other.photometric_interpretation();
    let [w, h, ow, oh] = [base.width(), base.height(), other.width(), other.height()].map(f64::from);
    let expected = h * ow / w;
    same_samples && ow >= 1.0 && oh >= 1.0 && ow < w && oh < h && (expected - oh).abs() <= 1.0 + h / w
}

/// Returns the bytes of a decoded pixel.
pub(super) fn pixel_bytes(ifd: &Ifd) -> u64 {
    let bits = ifd.bits_per_sample().ok().and_then(|b| b.first().copied()).unwrap_or(8);
    u64::from(ifd.samples_per_pixel()) * u64::from(bits.div_ceil(8))
}

/// The blocks of a directory: their size, their expected number, and the positions that the file lists.
struct BlockLayout {
    width: u64,
    height: u64,
    offsets: Vec<u64>,
    byte_counts: Vec<u64>,
    count: u64,
}

fn block_layout(ifd: &Ifd) -> Option<BlockLayout> {
    let (image_width, image_height) = (u64::from(ifd.width()), u64::from(ifd.height()));
    let (width, height, offsets, byte_counts) = if ifd.is_tiled() {
        (u64::from(ifd.tile_width()?), u64::from(ifd.tile_height()?), ifd.tile_offsets()?, ifd.tile_byte_counts()?)
    } else {
        let rows = u64::from(ifd.rows_per_strip()).min(image_height);
        (image_width, rows, ifd.strip_offsets()?, ifd.strip_byte_counts()?)
    };
    if width == 0 || height == 0 {
        return None;
    }
    let planes = if ifd.planar_configuration() == 2 { u64::from(ifd.samples_per_pixel()) } else { 1 };
    let across = image_width.div_ceil(width);
    let count = across.checked_mul(image_height.div_ceil(height))?.checked_mul(planes)?;
    Some(BlockLayout { width, height, offsets, byte_counts, count })
}

/// Checks that a directory can be read: a supported compression, sizes that fit in memory, and all blocks inside the file.
///
/// # Errors
/// [`RasterError`] with the first check that fails.
pub(super) fn check_layout(path: &Path, file: &TiffFile, ifd: &Ifd) -> Result<(), RasterError> {
    let damaged = |reason: String| Err(RasterError::damaged(path, reason));
    let (width, height) = (ifd.width(), ifd.height());
    if width == 0 || height == 0 {
        return damaged(format!("its header says {width} x {height} pixels"));
    }
    if !matches!(ifd.compression(), 1 | 5 | 7 | 8 | 32773 | 32946 | 34887 | 50000 | 50001) {
        let reason = format!("its compression (TIFF code {}) is not supported", ifd.compression());
        return Err(RasterError::Unsupported { path: path.into(), reason, remedy: Remedy::ConvertToCog });
    }
    if let Err(e) = ifd.raster_layout() {
        return damaged(e.to_string());
    }
    let Some(blocks) = block_layout(ifd) else {
        return damaged(format!("{width} x {height} pixels without a usable list of blocks"));
    };
    let block_bytes = blocks.width.checked_mul(blocks.height).and_then(|n| n.checked_mul(pixel_bytes(ifd)));
    if block_bytes.is_none_or(|bytes| bytes > MAX_BLOCK_BYTES) {
        let reason = format!(
            "it is stored in blocks of {} x {} pixels, and one must be decoded whole (limit {} MB)",
            blocks.width,
            blocks.height,
            MAX_BLOCK_BYTES >> 20
        );
        return Err(RasterError::TooLarge { path: path.into(), reason });
    }
    let (stated, counted) = (blocks.offsets.len() as u64, blocks.byte_counts.len() as u64);
    if stated != blocks.count || counted != blocks.count {
        return damaged(format!(
            "{width} x {height} pixels need {} blocks, the file lists {stated} positions and {counted} sizes",
            blocks.count
        ));
    }
    let file_bytes = file.source().len();
    for (i, (offset, bytes)) in blocks.offsets.iter().zip(&blocks.byte_counts).enumerate() {
        let end = offset.saturating_add(*bytes);
        if *offset != 0 && *bytes != 0 && end > file_bytes {
            return damaged(format!("truncated: its block {i} ends at byte {end}, the file at {file_bytes}"));
        }
    }
    Ok(())
}

/// Whether any block was never written.
pub(super) fn has_sparse_blocks(ifd: &Ifd) -> bool {
    block_layout(ifd).is_some_and(|b| b.offsets.contains(&0) || b.byte_counts.contains(&0))
}

/// Whether no block under a rectangle was ever written.
pub(super) fn is_sparse(ifd: &Ifd, x: u64, y: u64, width: u64, height: u64) -> bool {
    let at = |codes: [u16; 2], index: u64| {
        let tag = codes.iter().find_map(|code| ifd.tag(*code))?;
        match &tag.value {
            tiff_reader::TagValue::Short(v) => v.get(index as usize).map(|v| u64::from(*v)),
            tiff_reader::TagValue::Long(v) => v.get(index as usize).map(|v| u64::from(*v)),
            tiff_reader::TagValue::Long8(v) => v.get(index as usize).copied(),
            _ => None,
        }
    };
    let (block_width, block_height) = match (ifd.tile_width(), ifd.tile_height()) {
        (Some(w), Some(h)) if ifd.is_tiled() => (u64::from(w), u64::from(h)),
        _ => (u64::from(ifd.width()), u64::from(ifd.rows_per_strip()).min(u64::from(ifd.height()))),
    };
    let across = u64::from(ifd.width()).div_ceil(block_width.max(1));
    let rows = y / block_height.max(1)..=(y + height - 1) / block_height.max(1);
    let columns = x / block_width.max(1)..=(x + width - 1) / block_width.max(1);
    // Planes follow one another. Where the first one is missing, so are the others.
    rows.into_iter().all(|row| {
        columns.clone().all(|column| {
            let index = row * across + column;
            at([324, 273], index) == Some(0) || at([325, 279], index) == Some(0)
        })
    })
}
