//! `Bands`: how a TIFF's samples become colours and validity.

use super::vertical::HeightScale;
use crate::raster::block::PixelBlock;
use crate::raster::error::RasterError;
use crate::raster::gdal_metadata::{metadata_xml, parse_items};
use crate::raster::options::OpenOptions;
use crate::remedy::Remedy;
use overfly_store::step_of;
use std::path::Path;
use tiff_reader::{ExtraSample, Ifd, PhotometricInterpretation, TagValue};

const TAG_GDAL_NODATA: u16 = 42113;

/// How samples become colours.
#[derive(Debug, Clone, PartialEq)]
enum ColourModel {
    /// One sample is gray; `inverted` where 0 is white.
    Gray { inverted: bool },
    /// The first three samples are red, green and blue.
    Rgb,
    /// One sample is an index of colours.
    Palette(Vec<[u8; 3]>),
    /// One sample is a height.
    Height(HeightScale),
}

/// The type of one stored sample.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SampleType {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    F64,
}

/// How samples become pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bands {
    colours: ColourModel,
    sample_type: SampleType,
    samples: usize,
    /// The index of the alpha sample, and its opaque value.
    alpha: Option<(usize, f64)>,
    no_data: Option<f64>,
    /// Values shown as 0 and 255.
    stretch: (f64, f64),
    /// Whether `tiff-reader` must decode the colours first.
    pub decoded: bool,
}

impl Bands {
    /// Returns the bands of an image.
    ///
    /// # Errors
    /// [`RasterError`] for samples of more than 8 bits without a stretch, and for unsupported sample types and colour models.
    pub fn from_image(path: &Path, image: &Ifd, options: &OpenOptions) -> Result<Self, RasterError> {
        let damaged = |e: tiff_reader::TiffError| RasterError::damaged(path, e.to_string());
        let unsupported =
            |reason: String| RasterError::Unsupported { path: path.into(), reason, remedy: Remedy::ConvertToRgb };
        let layout = image.raster_layout().map_err(damaged)?;
        let photometric = image.photometric_interpretation_enum();
        let samples = layout.samples_per_pixel;
        let colours = match photometric {
            Some(PhotometricInterpretation::MinIsBlack) if options.heights && samples == 1 => {
                ColourModel::Height(HeightScale::from_image(path, image)?)
            }
            _ if options.heights => {
                return Err(unsupported(format!("it holds no heights: {samples} samples a pixel, not one")));
            }
            Some(PhotometricInterpretation::Palette) => ColourModel::Palette(palette(path, image)?),
            Some(PhotometricInterpretation::Rgb | PhotometricInterpretation::YCbCr) if samples >= 3 => ColourModel::Rgb,
            Some(PhotometricInterpretation::MinIsWhite) => ColourModel::Gray { inverted: true },
            // Many writers declare multispectral imagery as 'black is zero'; its first three bands are red, green, blue.
            Some(PhotometricInterpretation::MinIsBlack) if samples >= 3 => ColourModel::Rgb,
            Some(PhotometricInterpretation::MinIsBlack) => ColourModel::Gray { inverted: false },
            other => {
                return Err(unsupported(format!("its colour model ({other:?}, {samples} samples) is not supported")));
            }
        };
        let bits = layout.bits_per_sample;
        let sample_type = match (layout.sample_format, bits) {
            (1, 1..=8) => SampleType::U8,
            (1, 9..=16) => SampleType::U16,
            (1, 32) => SampleType::U32,
            (2, 8) => SampleType::I8,
            (2, 16) => SampleType::I16,
            (2, 32) => SampleType::I32,
            (3, 32) => SampleType::F32,
            (3, 64) => SampleType::F64,
            (format, bits) => {
                return Err(unsupported(format!("its {bits}-bit samples (format {format}) are not supported")));
            }
        };
        let stretch = match (options.stretch, sample_type, &colours) {
            (_, _, ColourModel::Palette(_) | ColourModel::Height(_)) => (0.0, 255.0),
            (Some((low, high)), _, _) if low.is_finite() && high.is_finite() && low < high => (low, high),
            (Some((low, high)), _, _) => return Err(RasterError::BadStretch { path: path.into(), low, high }),
            (None, SampleType::U8, _) => (0.0, f64::from((1u32 << bits) - 1)),
            (None, _, _) => {
                return Err(RasterError::NeedsStretch { path: path.into(), samples: sample_type.name(bits) });
            }
        };
        let decoded = photometric == Some(PhotometricInterpretation::YCbCr) && image.compression() != 7;
        let extra = image.extra_samples().map_err(damaged)?;
        let opaque = if layout.sample_format == 1 { ((1u64 << bits) - 1) as f64 } else { 1.0 };
        let alpha = alpha_sample(image, samples, &extra).map(|i| (i, opaque));
        Ok(Self { colours, sample_type, samples, alpha, no_data: no_data(image), stretch, decoded })
    }

    /// Returns the pixels of a block of native-endian samples; `None` where the number of samples is wrong.
    pub fn block(
        &self,
        samples: Vec<u8>,
        mask: Option<&[u8]>,
        width_px: usize,
        height_px: usize,
    ) -> Option<PixelBlock> {
        let count = width_px * height_px;
        if samples.len() != count * self.samples * self.sample_type.bytes() || mask.is_some_and(|m| m.len() != count) {
            return None;
        }
        let plain = self.sample_type == SampleType::U8 && self.stretch == (0.0, 255.0);
        if plain && mask.is_none() && self.alpha.is_none() && self.no_data.is_none() {
            match (&self.colours, self.samples) {
                (ColourModel::Rgb, 3) => return Some(PixelBlock { width_px, height_px, channels: 3, data: samples }),
                (ColourModel::Gray { inverted: false }, 1) => {
                    return Some(PixelBlock { width_px, height_px, channels: 1, data: samples });
                }
                _ => {}
            }
        }
        let gray = matches!(self.colours, ColourModel::Gray { .. });
        let channels = if gray { 2 } else { 4 };
        let mut data = vec![0u8; count * channels];
        let mut all_valid = true;
        let stride = self.samples * self.sample_type.bytes();
        for (i, (pixel, stored)) in data.chunks_exact_mut(channels).zip(samples.chunks_exact(stride)).enumerate() {
            if mask.is_some_and(|m| m[i] == 0) || !self.is_valid(stored) {
                all_valid = false;
                continue;
            }
            self.show(stored, plain, pixel);
        }
        if all_valid {
            return Some(PixelBlock {
                width_px,
                height_px,
                channels: channels - 1,
                data: without_last(&data, channels),
            });
        }
        Some(PixelBlock { width_px, height_px, channels, data })
    }

    /// Whether a pixel is valid. It is invalid where it is less than half opaque, where every sample but alpha is the no-data
    /// value, and where a colour's sample is not a number.
    fn is_valid(&self, stored: &[u8]) -> bool {
        let at = |i: usize| self.sample_type.value(&stored[i * self.sample_type.bytes()..]);
        if self.alpha.is_some_and(|(i, opaque)| at(i) < opaque / 2.0) {
            return false;
        }
        if let ColourModel::Height(scale) = &self.colours
            && step_of(scale.metres(at(0))).is_none()
        {
            return false;
        }
        let shown = if self.colours == ColourModel::Rgb { 3 } else { 1 };
        if matches!(self.sample_type, SampleType::F32 | SampleType::F64) && (0..shown).any(|i| at(i).is_nan()) {
            return false;
        }
        let alpha = self.alpha.map(|(i, _)| i);
        self.no_data.is_none_or(|value| (0..self.samples).filter(|i| Some(*i) != alpha).any(|i| at(i) != value))
    }

    fn show(&self, stored: &[u8], plain: bool, pixel: &mut [u8]) {
        let (low, high) = self.stretch;
        let shade = |i: usize| {
            if plain {
                return stored[i];
            }
            // `as` saturates below 0 and above 255.
            ((self.sample_type.value(&stored[i * self.sample_type.bytes()..]) - low) / (high - low) * 255.0 + 0.5) as u8
        };
        match &self.colours {
            ColourModel::Gray { inverted } => pixel[0] = if *inverted { 255 - shade(0) } else { shade(0) },
            ColourModel::Rgb => pixel[..3].copy_from_slice(&[shade(0), shade(1), shade(2)]),
            ColourModel::Palette(colours) => {
                let index = self.sample_type.value(stored) as usize;
                pixel[..3].copy_from_slice(&colours.get(index).copied().unwrap_or_default());
            }
            ColourModel::Height(scale) => {
                let step = step_of(scale.metres(self.sample_type.value(stored))).unwrap_or_default();
                pixel[..2].copy_from_slice(&step.to_be_bytes());
            }
        }
        pixel[pixel.len() - 1] = 255;
    }
}

impl SampleType {
    fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn value(self, bytes: &[u8]) -> f64 {
        let four = || <[u8; 4]>::try_from(&bytes[..4]).expect("four bytes");
        let two = || [bytes[0], bytes[1]];
        match self {
            Self::U8 => f64::from(bytes[0]),
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U16 => f64::from(u16::from_ne_bytes(two())),
            Self::I16 => f64::from(i16::from_ne_bytes(two())),
            Self::U32 => f64::from(u32::from_ne_bytes(four())),
            Self::I32 => f64::from(i32::from_ne_bytes(four())),
            Self::F32 => f64::from(f32::from_ne_bytes(four())),
            Self::F64 => f64::from_ne_bytes(bytes[..8].try_into().expect("eight bytes")),
        }
    }

    fn name(self, bits: u16) -> String {
        let sort = match self {
            Self::U8 | Self::U16 | Self::U32 => "unsigned",
            Self::I8 | Self::I16 | Self::I32 => "signed",
            Self::F32 | Self::F64 => "floating-point",
        };
        format!("{bits}-bit {sort}")
    }
}

/// Returns the index of the alpha sample. GDAL's metadata take precedence over the TIFF tag: many files of four bands have a
/// near-infrared band that the tag calls alpha and GDAL calls undefined.
fn alpha_sample(image: &Ifd, samples: usize, extra: &[ExtraSample]) -> Option<usize> {
    let first_extra = samples.checked_sub(extra.len())?;
    let items = parse_items(metadata_xml(image));
    let by_gdal = |sample: usize| {
        let stated = items.iter().find(|item| item.name == "COLORINTERP" && item.sample == Some(sample))?;
        Some(stated.text.eq_ignore_ascii_case("alpha"))
    };
    let by_tag = |sample: usize| {
        let kind = sample.checked_sub(first_extra).and_then(|i| extra.get(i));
        matches!(kind, Some(ExtraSample::AssociatedAlpha | ExtraSample::UnassociatedAlpha))
    };
    (1..samples).find(|sample| by_gdal(*sample).unwrap_or_else(|| by_tag(*sample)))
}

fn without_last(data: &[u8], channels: usize) -> Vec<u8> {
    data.chunks_exact(channels).flat_map(|p| &p[..channels - 1]).copied().collect()
}

fn no_data(image: &Ifd) -> Option<f64> {
    match &image.tag(TAG_GDAL_NODATA)?.value {
        TagValue::Ascii(text) => text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse().ok(),
        _ => None,
    }
}

/// Returns the colours of a palette image. The 16-bit colour map holds 8-bit colours times 257 or, from some writers, 8-bit
/// colours unchanged.
fn palette(path: &Path, image: &Ifd) -> Result<Vec<[u8; 3]>, RasterError> {
    let map = image.color_map().map_err(|e| RasterError::damaged(path, e.to_string()))?;
    let map = map.ok_or_else(|| RasterError::damaged(path, "it is a palette image without a colour map"))?;
    let entries: Vec<[u16; 3]> =
        map.red().iter().zip(map.green()).zip(map.blue()).map(|((r, g), b)| [*r, *g, *b]).collect();
    let eight_bits = entries.iter().flatten().all(|v| *v < 256);
    Ok(entries.iter().map(|c| c.map(|v| if eight_bits { v as u8 } else { (v >> 8) as u8 })).collect())
}
