//! Quantization tables, and the order in which coefficients are coded.

use super::error::JpegDamage;

/// The place in a block, column * 8 + row, of the k-th coefficient in coded order (T.81, figure A.6, transposed).
#[rustfmt::skip]
pub(super) const ZIGZAG: [u8; 64] = [
     0,  8,  1,  2,  9, 16, 24, 17, 10,  3,  4, 11, 18, 25, 32, 40,
    33, 26, 19, 12,  5,  6, 13, 20, 27, 34, 41, 48, 56, 49, 42, 35,
    28, 21, 14,  7, 15, 22, 29, 36, 43, 50, 57, 58, 51, 44, 37, 30,
    23, 31, 38, 45, 52, 59, 60, 53, 46, 39, 47, 54, 61, 62, 55, 63,
];

/// The steps of a quantization table, in coded order.
pub(super) type Steps = [u16; 64];

/// Reads the tables of a DQT segment: (number, steps) each.
///
/// # Errors
/// If lengths do not fit or a step is 0.
pub(super) fn read_tables(mut content: &[u8]) -> Result<Vec<(usize, Steps)>, JpegDamage> {
    let refused = JpegDamage::Segment("quantization table");
    let mut tables = Vec::new();
    while let [head, rest @ ..] = content {
        let (wide, number) = (head >> 4, usize::from(head & 15));
        let bytes = if wide == 0 { 64 } else { 128 };
        if wide > 1 || number > 3 || rest.len() < bytes {
            return Err(refused);
        }
        let mut steps = [0; 64];
        for (k, step) in steps.iter_mut().enumerate() {
            *step = if wide == 0 { rest[k].into() } else { u16::from_be_bytes([rest[2 * k], rest[2 * k + 1]]) };
        }
        if steps.contains(&0) {
            return Err(refused);
        }
        tables.push((number, steps));
        content = &rest[bytes..];
    }
    if tables.is_empty() { Err(refused) } else { Ok(tables) }
}

/// Whether a DC coefficient, multiplied by its step, can be that of 8-bit pixels: 8 times a mean in [-128, 127], rounded to a
/// step, and a little for encoders that round along the way.
#[inline(always)]
pub(super) fn is_dc_possible(value: i32, step: i32) -> bool {
    value.unsigned_abs() <= (1024 + 16 + step) as u32
}

/// Whether another coefficient can be that of 8-bit pixels. Its bound is 929; twice as much is let pass, because encoders may
/// let pixels overshoot at edges to white.
#[inline(always)]
pub(super) fn is_ac_possible(value: i32, step: i32) -> bool {
    value.unsigned_abs() <= (2048 + step) as u32
}
