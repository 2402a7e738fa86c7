//! Segments: markers and their content.

use super::error::{JpegDamage, JpegError};

/// Second bytes of the markers (T.81, table B.1).
pub(super) mod marker {
    pub const DHT: u8 = 0xc4;
    pub const RST0: u8 = 0xd0;
    pub const RST7: u8 = 0xd7;
    pub const SOI: u8 = 0xd8;
    pub const EOI: u8 = 0xd9;
    pub const SOS: u8 = 0xda;
    pub const DQT: u8 = 0xdb;
    pub const DNL: u8 = 0xdc;
    pub const DRI: u8 = 0xdd;
    pub const APP0: u8 = 0xe0;
    pub const APP14: u8 = 0xee;
    pub const APP15: u8 = 0xef;
    pub const COM: u8 = 0xfe;
}

/// A marker and the content of its segment, if it has one.
pub(super) struct Segment<'a> {
    /// Where the segment begins.
    pub at_byte: usize,
    /// The second byte of its marker.
    pub marker: u8,
    /// What follows the length; empty for markers without a segment.
    pub content: &'a [u8],
    /// Where the next one begins.
    pub end: usize,
}

impl Segment<'_> {
    /// The error of content that does not fit its kind.
    pub fn is_not_valid(&self, what: &'static str) -> JpegError {
        JpegDamage::Segment(what).at(self.at_byte)
    }
}

/// Reads the segment at a byte. Any number of FF may stand before its marker (T.81, B.1.1.2).
///
/// # Errors
/// If the file ends, or no marker stands there.
pub(super) fn segment_at(bytes: &[u8], at_byte: usize) -> Result<Segment<'_>, JpegError> {
    let rest = bytes.get(at_byte..).unwrap_or_default();
    let fill = rest.iter().take_while(|&&b| b == 0xff).count();
    match (fill, rest.get(fill)) {
        (_, None) => return Err(JpegDamage::EndsEarly.at(at_byte)),
        (0, _) | (_, Some(0)) => return Err(JpegDamage::StrayBytes.at(at_byte)),
        _ => {}
    }
    let (marker, rest) = (rest[fill], &rest[fill + 1..]);
    let start = at_byte + fill + 1;
    if matches!(marker, 0x01 | marker::RST0..=marker::EOI) {
        return Ok(Segment { at_byte, marker, content: &[], end: start });
    }
    let [high, low, ..] = *rest else { return Err(JpegDamage::EndsEarly.at(at_byte)) };
    let length = usize::from(u16::from_be_bytes([high, low]));
    if length < 2 {
        return Err(JpegDamage::Segment("length of a segment").at(at_byte));
    }
    let content = rest.get(2..length).ok_or(JpegDamage::EndsEarly.at(at_byte))?;
    Ok(Segment { at_byte, marker, content, end: start + length })
}
