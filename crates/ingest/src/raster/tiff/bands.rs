//! `Bands`: how a TIFF's samples become colours and validity.

use super::super::block::Block;
use super::super::gdal_metadata::{items, xml_of};
use super::super::{OpenOptions, RasterError};
use std::path::Path;
use tiff_reader::{ExtraSample, Ifd, PhotometricInterpretation, TagValue};

const TAG_GDAL_NODATA: u16 = 42113;

/// Which samples are shown.
#[derive(Debug, Clone, PartialEq)]
enum Shown {
    /// One sample as gray; `inverted` where 0 is white.
    Gray { inverted: bool },
    /// The first three samples.
    Rgb,
    /// One sample as an index of colours.
    Palette(Vec<[u8; 3]>),
}

/// How one stored sample is read.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    F64,
}

/// The rule by which samples become pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bands {
    shown: Shown,
    kind: Kind,
    samples: usize,
    /// Index of the alpha sample and its opaque value.
    alpha: Option<(usize, f64)>,
    no_data: Option<f64>,
    /// Values shown as 0 and 255.
    stretch: (f64, f64),
    /// Whether the library's colour decoding must come first.
    pub decoded: bool,
}

impl Bands {
    /// The rule for an image.
    ///
    /// # Errors
    /// Samples of more than 8 bits without a stretch; colour models that are not light.
    pub fn of(path: &Path, image: &Ifd, options: &OpenOptions) -> Result<Self, RasterError> {
        let damaged = |e: tiff_reader::TiffError| RasterError::damaged(path, e.to_string());
        let unsupported = |reason: String| RasterError::Unsupported {
            path: path.into(),
            reason,
            remedy: "gdal_translate -of COG -expand rgb (or -ot Byte -scale)",
        };
        let layout = image.raster_layout().map_err(damaged)?;
        let photometric = image.photometric_interpretation_enum();
        let samples = layout.samples_per_pixel;
        let shown = match photometric {
            Some(PhotometricInterpretation::Palette) => Shown::Palette(palette(path, image)?),
            Some(PhotometricInterpretation::Rgb | PhotometricInterpretation::YCbCr) if samples >= 3 => Shown::Rgb,
            Some(PhotometricInterpretation::MinIsWhite) => Shown::Gray { inverted: true },
            // Many writers leave multispectral imagery at 'black is zero'; its first three bands are red, green, blue.
            Some(PhotometricInterpretation::MinIsBlack) if samples >= 3 => Shown::Rgb,
            Some(PhotometricInterpretation::MinIsBlack) => Shown::Gray { inverted: false },
            other => return Err(unsupported(format!("its colour model ({other:?}, {samples} samples) is not read"))),
        };
        let bits = layout.bits_per_sample;
        let kind = match (layout.sample_format, bits) {
            (1, 1..=8) => Kind::U8,
            (1, 9..=16) => Kind::U16,
            (1, 32) => Kind::U32,
            (2, 8) => Kind::I8,
            (2, 16) => Kind::I16,
            (2, 32) => Kind::I32,
            (3, 32) => Kind::F32,
            (3, 64) => Kind::F64,
            (format, bits) => {
                return Err(unsupported(format!("its {bits}-bit samples (format {format}) are not read")));
            }
        };
        let stretch = match (options.stretch, kind, &shown) {
            (_, _, Shown::Palette(_)) => (0.0, 255.0),
            (Some((low, high)), _, _) if low.is_finite() && high.is_finite() && low < high => (low, high),
            (Some((low, high)), _, _) => return Err(RasterError::BadStretch { path: path.into(), low, high }),
            (None, Kind::U8, _) => (0.0, f64::from((1u32 << bits) - 1)),
            (None, _, _) => return Err(RasterError::NeedsStretch { path: path.into(), samples: kind.name(bits) }),
        };
        let decoded = photometric == Some(PhotometricInterpretation::YCbCr) && image.compression() != 7;
        let extra = image.extra_samples().map_err(damaged)?;
        let opaque = if layout.sample_format == 1 { ((1u64 << bits) - 1) as f64 } else { 1.0 };
        let alpha = alpha_sample(image, samples, &extra).map(|i| (i, opaque));
        Ok(Self { shown, kind, samples, alpha, no_data: no_data(image), stretch, decoded })
    }

    /// Pixels of a block of native-endian samples; `None` where their number does not fit.
    pub fn block(&self, samples: Vec<u8>, mask: Option<&[u8]>, width_px: usize, height_px: usize) -> Option<Block> {
        let count = width_px * height_px;
        if samples.len() != count * self.samples * self.kind.bytes() || mask.is_some_and(|m| m.len() != count) {
            return None;
        }
        let plain = self.kind == Kind::U8 && self.stretch == (0.0, 255.0);
        if plain && mask.is_none() && self.alpha.is_none() && self.no_data.is_none() {
            match (&self.shown, self.samples) {
                (Shown::Rgb, 3) => return Some(Block { width_px, height_px, channels: 3, data: samples }),
                (Shown::Gray { inverted: false }, 1) => {
                    return Some(Block { width_px, height_px, channels: 1, data: samples });
                }
                _ => {}
            }
        }
        let gray = matches!(self.shown, Shown::Gray { .. });
        let channels = if gray { 2 } else { 4 };
        let mut data = vec![0u8; count * channels];
        let mut all_valid = true;
        let stride = self.samples * self.kind.bytes();
        for (i, (pixel, stored)) in data.chunks_exact_mut(channels).zip(samples.chunks_exact(stride)).enumerate() {
            if mask.is_some_and(|m| m[i] == 0) || !self.is_valid(stored) {
                all_valid = false;
                continue;
            }
            self.show(stored, plain, pixel);
        }
        if all_valid {
            return Some(Block { width_px, height_px, channels: channels - 1, data: without_last(&data, channels) });
        }
        Some(Block { width_px, height_px, channels, data })
    }

    /// A pixel is missing where it is less than half opaque, where every sample but alpha is the no-data value, and
    /// where a shown sample is not a number.
    fn is_valid(&self, stored: &[u8]) -> bool {
        let at = |i: usize| self.kind.value(&stored[i * self.kind.bytes()..]);
        if self.alpha.is_some_and(|(i, opaque)| at(i) < opaque / 2.0) {
            return false;
        }
        let shown = if self.shown == Shown::Rgb { 3 } else { 1 };
        if matches!(self.kind, Kind::F32 | Kind::F64) && (0..shown).any(|i| at(i).is_nan()) {
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
            ((self.kind.value(&stored[i * self.kind.bytes()..]) - low) / (high - low) * 255.0 + 0.5) as u8
        };
        match &self.shown {
            Shown::Gray { inverted } => pixel[0] = if *inverted { 255 - shade(0) } else { shade(0) },
            Shown::Rgb => pixel[..3].copy_from_slice(&[shade(0), shade(1), shade(2)]),
            Shown::Palette(colours) => {
                let index = self.kind.value(stored) as usize;
                pixel[..3].copy_from_slice(&colours.get(index).copied().unwrap_or_default());
            }
        }
        pixel[pixel.len() - 1] = 255;
    }
}

impl Kind {
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

/// The sample that is alpha. The TIFF tag says so, unless GDAL's metadata say otherwise: files of four bands are often
/// written with a near-infrared band that the tag calls alpha and GDAL calls undefined.
fn alpha_sample(image: &Ifd, samples: usize, extra: &[ExtraSample]) -> Option<usize> {
    let first_extra = samples.checked_sub(extra.len())?;
    let by_gdal = |sample: usize| {
        let said = items(xml_of(image)).find(|item| item.name == "COLORINTERP" && item.sample == Some(sample))?;
        Some(said.text.eq_ignore_ascii_case("alpha"))
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

/// 16-bit colour maps hold 8-bit colours times 257 (or, from some writers, 8-bit colours as they are).
fn palette(path: &Path, image: &Ifd) -> Result<Vec<[u8; 3]>, RasterError> {
    let map = image.color_map().map_err(|e| RasterError::damaged(path, e.to_string()))?;
    let map = map.ok_or_else(|| RasterError::damaged(path, "a palette image without its colours"))?;
    let entries: Vec<[u16; 3]> =
        map.red().iter().zip(map.green()).zip(map.blue()).map(|((r, g), b)| [*r, *g, *b]).collect();
    let eight_bits = entries.iter().flatten().all(|v| *v < 256);
    Ok(entries.iter().map(|c| c.map(|v| if eight_bits { v as u8 } else { (v >> 8) as u8 })).collect())
}
