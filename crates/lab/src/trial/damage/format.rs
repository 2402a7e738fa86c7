//! `FrameFormat`: the formats in which frames are written before they are damaged.

use super::change::FileChange;
use crate::trial::error::TrialError;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use overfly_core::pixels::Colour;
use serde::Serialize;
use std::io::Cursor;

/// A format of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameFormat {
    /// The flight's own files.
    Own,
    /// Baseline JPEG, chroma at half the resolution.
    Jpeg,
    /// The same, with a restart marker after every eight MCUs.
    JpegRestarts,
    /// Progressive JPEG.
    JpegProgressive,
    /// Baseline JPEG without colours.
    JpegGray,
    /// PNG.
    Png,
    /// Lossless WebP.
    WebpLossless,
}

impl FrameFormat {
    /// All formats.
    pub const ALL: [Self; 7] = [
        Self::Own,
        Self::Jpeg,
        Self::JpegRestarts,
        Self::JpegProgressive,
        Self::JpegGray,
        Self::Png,
        Self::WebpLossless,
    ];

    /// Its word in files and JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Jpeg => "jpeg",
            Self::JpegRestarts => "jpeg_restarts",
            Self::JpegProgressive => "jpeg_progressive",
            Self::JpegGray => "jpeg_gray",
            Self::Png => "png",
            Self::WebpLossless => "webp_lossless",
        }
    }

    /// Whether a change can be made to files of this format.
    pub fn takes(self, change: FileChange) -> bool {
        match change {
            FileChange::RestartJunk => self == Self::JpegRestarts,
            FileChange::Segments => {
                matches!(self, Self::Jpeg | Self::JpegRestarts | Self::JpegProgressive | Self::JpegGray)
            }
            _ => true,
        }
    }

    /// Writes a frame; `own` are the bytes of the flight's file.
    ///
    /// # Errors
    /// [`TrialError::Encode`] where the encoder refuses the frame.
    pub fn encoded(self, frame: &Colour, own: &[u8]) -> Result<Vec<u8>, TrialError> {
        match self {
            Self::Own => Ok(own.to_vec()),
            Self::Jpeg => jpeg(frame, |_| {}),
            Self::JpegRestarts => jpeg(frame, |encoder| {
                encoder.set_restart_interval(8);
            }),
            Self::JpegProgressive => jpeg(frame, |encoder| {
                encoder.set_progressive(true);
                encoder.set_optimized_huffman_tables(true);
            }),
            Self::JpegGray => {
                let luma: Vec<u8> = frame.to_gray().values().iter().map(|v| v.round() as u8).collect();
                jpeg_of(frame, &luma, ColorType::Luma, |_| {})
            }
            Self::Png => whole(frame, image::ImageFormat::Png),
            Self::WebpLossless => whole(frame, image::ImageFormat::WebP),
        }
    }
}

fn jpeg(frame: &Colour, set: impl Fn(&mut Encoder<&mut Vec<u8>>)) -> Result<Vec<u8>, TrialError> {
    jpeg_of(frame, frame.values(), ColorType::Rgb, set)
}

fn jpeg_of(
    frame: &Colour,
    values: &[u8],
    colours: ColorType,
    set: impl Fn(&mut Encoder<&mut Vec<u8>>),
) -> Result<Vec<u8>, TrialError> {
    let refused = |reason: String| TrialError::Encode { reason };
    let size = |pixels: usize| u16::try_from(pixels).map_err(|e| refused(e.to_string()));
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 90);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    set(&mut encoder);
    let (width, height) = (size(frame.width_px())?, size(frame.height_px())?);
    encoder.encode(values, width, height, colours).map_err(|e| refused(e.to_string()))?;
    Ok(bytes)
}

fn whole(frame: &Colour, format: image::ImageFormat) -> Result<Vec<u8>, TrialError> {
    let (width, height) = (frame.width_px() as u32, frame.height_px() as u32);
    let picture = image::RgbImage::from_raw(width, height, frame.values().to_vec()).expect("three values a pixel");
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).map_err(|e| TrialError::Encode { reason: e.to_string() })?;
    Ok(bytes.into_inner())
}

impl std::str::FromStr for FrameFormat {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let words = || Self::ALL.map(Self::word).join(", ");
        Self::ALL.into_iter().find(|f| f.word() == word).ok_or_else(|| format!("one of {}", words()))
    }
}
