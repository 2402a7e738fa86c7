//! The frame header: size, components and their sampling.

use super::error::{JpegDamage, JpegError};
use super::segments::{Segment, marker};

/// What the header of a JPEG file states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JpegHeader {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// 1 (gray), 3 (colour) or 4 (CMYK).
    pub components: usize,
    /// Whether the file is progressive: all coefficients are then held in memory, two bytes each.
    pub is_progressive: bool,
}

/// One component of the frame.
#[derive(Clone)]
pub(super) struct Component {
    pub id: u8,
    /// Blocks of an MCU along each axis.
    pub across: usize,
    pub down: usize,
    /// The number of its quantization table.
    pub steps: usize,
    /// Its own size in pixels.
    pub width_px: usize,
    pub height_px: usize,
}

impl Component {
    /// Blocks that hold its pixels, along each axis.
    pub fn blocks(&self) -> [usize; 2] {
        [self.width_px.div_ceil(8), self.height_px.div_ceil(8)]
    }

    /// Whether it has a sample for every pixel of the frame.
    pub fn is_whole(&self, frame: &Frame) -> bool {
        (self.width_px, self.height_px) == (frame.width_px, frame.height_px)
    }
}

/// The frame: its size, kind and components.
#[derive(Clone)]
pub(super) struct Frame {
    pub width_px: usize,
    pub height_px: usize,
    pub is_progressive: bool,
    pub components: Vec<Component>,
    /// MCUs of an interleaved scan along each axis.
    pub mcus: [usize; 2],
}

impl Frame {
    /// What callers are told of it.
    pub fn header(&self) -> JpegHeader {
        JpegHeader {
            width_px: self.width_px as u32,
            height_px: self.height_px as u32,
            components: self.components.len(),
            is_progressive: self.is_progressive,
        }
    }
}

/// Whether a marker begins a frame header of any kind.
pub(super) fn is_frame_header(marker: u8) -> bool {
    matches!(marker, 0xc0..=0xcf) && !matches!(marker, marker::DHT | 0xc8 | 0xcc)
}

/// Reads a frame header (T.81, B.2.2).
///
/// # Errors
/// If it is not valid, or of a kind that is not read.
pub(super) fn read_frame(segment: &Segment) -> Result<Frame, JpegError> {
    let refused = || segment.is_not_valid("frame header");
    let is_progressive = match segment.marker {
        0xc0 | 0xc1 => false,
        0xc2 => true,
        0xc3 => return Err(JpegError::Unsupported("lossless coding")),
        0xc9..=0xcb | 0xcd..=0xcf => return Err(JpegError::Unsupported("arithmetic coding")),
        _ => return Err(JpegError::Unsupported("hierarchical coding")),
    };
    let [precision, h1, h0, w1, w0, count, parts @ ..] = segment.content else { return Err(refused()) };
    let (height_px, width_px) = (u16::from_be_bytes([*h1, *h0]), u16::from_be_bytes([*w1, *w0]));
    if *precision == 12 && segment.marker != 0xc0 {
        return Err(JpegError::Unsupported("12 bits a sample"));
    }
    if *precision != 8 || width_px == 0 || parts.len() != usize::from(*count) * 3 {
        return Err(refused());
    }
    if height_px == 0 {
        return Err(JpegError::Unsupported("a height that follows the data"));
    }
    if !matches!(count, 1 | 3 | 4) {
        return Err(JpegError::Unsupported("a number of components other than 1, 3 and 4"));
    }
    let sampling: Vec<[usize; 2]> = parts.chunks_exact(3).map(|p| [p[1] >> 4, p[1] & 15].map(usize::from)).collect();
    let is_bad = |&[across, down]: &[usize; 2]| !(1..=4).contains(&across) || !(1..=4).contains(&down);
    let ids: Vec<u8> = parts.chunks_exact(3).map(|p| p[0]).collect();
    let is_twice = |i: usize| ids[..i].contains(&ids[i]);
    if sampling.iter().any(is_bad) || (1..ids.len()).any(is_twice) || parts.chunks_exact(3).any(|p| p[2] > 3) {
        return Err(refused());
    }
    let most = |axis: usize| sampling.iter().map(|s| s[axis]).max().unwrap_or(1);
    let (most_across, most_down) = (most(0), most(1));
    let (width_px, height_px) = (usize::from(width_px), usize::from(height_px));
    let components = parts
        .chunks_exact(3)
        .zip(&sampling)
        .map(|(part, &[across, down])| Component {
            id: part[0],
            across,
            down,
            steps: part[2].into(),
            width_px: (width_px * across).div_ceil(most_across),
            height_px: (height_px * down).div_ceil(most_down),
        })
        .collect();
    let mcus = [width_px.div_ceil(8 * most_across), height_px.div_ceil(8 * most_down)];
    Ok(Frame { width_px, height_px, is_progressive, components, mcus })
}

/// The error of a second frame header, or of a scan before the first.
pub(super) fn misplaced(segment: &Segment) -> JpegError {
    JpegDamage::Marker(segment.marker).at(segment.at_byte)
}
