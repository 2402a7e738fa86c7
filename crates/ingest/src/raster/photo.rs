//! PNG and JPEG. Neither can be read in parts, so a file is decoded whole, as one block, and its size is limited.

use super::block::{BlockSource, PixelBlock, RasterLevel};
use super::date::exif_date;
use super::error::{RasterError, guarded};
use super::options::OpenOptions;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The most pixels of a file. Decoding a progressive JPEG of this size takes about 600 MB.
const MAX_PIXELS: u64 = 64_000_000;

/// A PNG or JPEG whose header has been read.
pub(super) struct PhotoSource {
    path: PathBuf,
    format: ImageFormat,
    level: [RasterLevel; 1],
    /// For 16-bit samples: values shown as 0 and 255.
    stretch: Option<(f64, f64)>,
    acquired: Option<String>,
}

impl PhotoSource {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`RasterError`] for damaged and too large files, and for 16-bit samples without a stretch.
    pub fn open(path: &Path, format: ImageFormat, options: &OpenOptions) -> Result<Self, RasterError> {
        guarded(path, || {
            let mut decoder = decoder(path, format)?;
            let (width, height) = decoder.dimensions();
            if width == 0 || height == 0 {
                return Err(RasterError::damaged(path, format!("its header says {width} x {height} pixels")));
            }
            let pixels = u64::from(width) * u64::from(height);
            if pixels > MAX_PIXELS {
                let reason = format!(
                    "{width} x {height} pixels are {} million, and a file of this format must be decoded whole (limit {} million)",
                    pixels / 1_000_000,
                    MAX_PIXELS / 1_000_000
                );
                return Err(RasterError::TooLarge { path: path.into(), reason });
            }
            let stretch = stretch(path, decoder.color_type(), options)?;
            let acquired = decoder.exif_metadata().ok().flatten().and_then(exif_date);
            let (width_px, height_px) = (u64::from(width), u64::from(height));
            let level = RasterLevel { width_px, height_px, block_width_px: width_px, block_height_px: height_px };
            Ok(Self { path: path.into(), format, level: [level], stretch, acquired })
        })
    }

    /// "PNG" or "JPEG".
    pub fn format_name(&self) -> &'static str {
        if self.format == ImageFormat::Png { "PNG" } else { "JPEG" }
    }

    /// The acquisition date in the EXIF metadata.
    pub fn acquired(&self) -> Option<String> {
        self.acquired.clone()
    }
}

impl BlockSource for PhotoSource {
    fn levels(&self) -> &[RasterLevel] {
        &self.level
    }

    fn decodes_alone(&self) -> bool {
        true
    }

    fn read(&self, _level: usize, _column: u64, _row: u64) -> Result<PixelBlock, RasterError> {
        guarded(&self.path, || {
            let decoder = decoder(&self.path, self.format)?;
            let size = (u64::from(decoder.dimensions().0), u64::from(decoder.dimensions().1));
            if size != (self.level[0].width_px, self.level[0].height_px) {
                return Err(RasterError::damaged(&self.path, "it changed while it was read"));
            }
            let image =
                DynamicImage::from_decoder(decoder).map_err(|e| RasterError::damaged(&self.path, e.to_string()))?;
            Ok(block(image, self.stretch))
        })
    }
}

fn decoder(path: &Path, format: ImageFormat) -> Result<impl ImageDecoder, RasterError> {
    let file = File::open(path).map_err(|e| RasterError::io(path, e))?;
    let mut reader = ImageReader::with_format(BufReader::new(file), format);
    let mut limits = image::Limits::default();
    // Eight bytes a pixel (16-bit RGBA) and the decoder's own tables.
    limits.max_alloc = Some(MAX_PIXELS * 8 + (64 << 20));
    reader.limits(limits);
    reader.into_decoder().map_err(|e| match e {
        image::ImageError::IoError(e) => RasterError::damaged(path, e.to_string()),
        other => RasterError::damaged(path, other.to_string()),
    })
}

fn stretch(path: &Path, colour: ColorType, options: &OpenOptions) -> Result<Option<(f64, f64)>, RasterError> {
    let eight_bits = matches!(colour, ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8);
    match options.stretch {
        Some((low, high)) if low.is_finite() && high.is_finite() && low < high => Ok(Some((low, high))),
        Some((low, high)) => Err(RasterError::BadStretch { path: path.into(), low, high }),
        None if eight_bits => Ok(None),
        None => Err(RasterError::NeedsStretch { path: path.into(), samples: "16-bit unsigned".into() }),
    }
}

/// Makes a block of an image, from its own bytes where they have the right layout.
fn block(image: DynamicImage, stretch: Option<(f64, f64)>) -> PixelBlock {
    let (width_px, height_px) = (image.width() as usize, image.height() as usize);
    let (channels, mut data, opaque_from) = match (image, stretch) {
        (DynamicImage::ImageLuma8(i), None) => (1, i.into_raw(), 0),
        (DynamicImage::ImageLumaA8(i), None) => (2, i.into_raw(), 128),
        (DynamicImage::ImageRgb8(i), None) => (3, i.into_raw(), 0),
        (DynamicImage::ImageRgba8(i), None) => (4, i.into_raw(), 128),
        (image, None) => (4, image.into_rgba8().into_raw(), 128),
        (image, Some(range)) => {
            let eight_bits =
                image.as_bytes().len() == width_px * height_px * usize::from(image.color().channel_count());
            (4, stretched(image, range, if eight_bits { 257.0 } else { 1.0 }), 128)
        }
    };
    if channels % 2 == 0 {
        for pixel in data.chunks_exact_mut(channels) {
            if pixel[channels - 1] < opaque_from {
                pixel.fill(0);
            } else {
                pixel[channels - 1] = 255;
            }
        }
    }
    PixelBlock { width_px, height_px, channels, data }
}

/// Maps samples to 8 bits. `unit` is the number of 16-bit steps in one step of the stored samples.
fn stretched(image: DynamicImage, (low, high): (f64, f64), unit: f64) -> Vec<u8> {
    let shade = |v: u16| ((f64::from(v) / unit - low) / (high - low) * 255.0 + 0.5) as u8;
    let wide = image.into_rgba16().into_raw();
    wide.chunks_exact(4).flat_map(|p| [shade(p[0]), shade(p[1]), shade(p[2]), (p[3] >> 8) as u8]).collect()
}
