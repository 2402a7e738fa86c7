//! The scan header: which components a scan codes, with which tables, and which coefficients.

use super::error::{JpegDamage, JpegError};
use super::frame_header::Frame;
use super::segments::Segment;

/// A component of a scan: its place in the frame and the numbers of its Huffman tables.
#[derive(Clone, Copy)]
pub(super) struct ScanComponent {
    pub index: usize,
    pub dc_table: usize,
    pub ac_table: usize,
}

/// A scan.
pub(super) struct Scan {
    pub components: Vec<ScanComponent>,
    /// The first and last coefficient coded, in coded order.
    pub first: usize,
    pub last: usize,
    /// The bit of the coefficients that was coded before (0: none), and the lowest that is coded now.
    pub high_bit: u8,
    pub low_bit: u8,
}

/// Reads a scan header (T.81, B.2.3).
///
/// # Errors
/// If it does not fit the frame.
pub(super) fn read_scan(segment: &Segment, frame: &Frame) -> Result<Scan, JpegError> {
    let refused = || segment.is_not_valid("scan header");
    let [count, rest @ ..] = segment.content else { return Err(refused()) };
    let count = usize::from(*count);
    if !(1..=frame.components.len()).contains(&count) || rest.len() != 2 * count + 3 {
        return Err(refused());
    }
    let (parts, rest) = rest.split_at(2 * count);
    let mut components: Vec<ScanComponent> = Vec::with_capacity(count);
    for part in parts.chunks_exact(2) {
        let index = frame.components.iter().position(|c| c.id == part[0]).ok_or_else(refused)?;
        let (dc_table, ac_table) = (usize::from(part[1] >> 4), usize::from(part[1] & 15));
        // In the order of the frame (B.2.3).
        if components.last().is_some_and(|last| last.index >= index) || dc_table > 3 || ac_table > 3 {
            return Err(refused());
        }
        components.push(ScanComponent { index, dc_table, ac_table });
    }
    let blocks = |c: &ScanComponent| frame.components[c.index].across * frame.components[c.index].down;
    if count > 1 && components.iter().map(blocks).sum::<usize>() > 10 {
        return Err(refused());
    }
    let (first, last) = (usize::from(rest[0]), usize::from(rest[1]));
    let scan = Scan { components, first, last, high_bit: rest[2] >> 4, low_bit: rest[2] & 15 };
    if scan.fits(frame.is_progressive) { Ok(scan) } else { Err(refused()) }
}

impl Scan {
    fn fits(&self, is_progressive: bool) -> bool {
        if !is_progressive {
            // Some files have zeros here.
            return matches!((self.first, self.last), (0, 63) | (0, 0)) && (self.high_bit, self.low_bit) == (0, 0);
        }
        let is_band = if self.first == 0 { self.last == 0 } else { self.components.len() == 1 };
        let are_bits = self.low_bit <= 13 && (self.high_bit == 0 || self.high_bit == self.low_bit + 1);
        is_band && are_bits && self.first <= self.last && self.last < 64
    }

    /// Units of the scan, along each axis: MCUs, or the blocks of its only component.
    pub fn units(&self, frame: &Frame) -> [usize; 2] {
        match self.components[..] {
            [one] => frame.components[one.index].blocks(),
            _ => frame.mcus,
        }
    }
}

/// The error of a scan that names a table that is not there.
pub(super) fn missing(what: &'static str, at_byte: usize) -> JpegError {
    JpegDamage::MissingTable(what).at(at_byte)
}
