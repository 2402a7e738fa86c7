//! `BitReader`: bits of one run of coded data, its stuffed zero bytes removed.

/// Zero bytes that must follow the data: more than a block can consume (64 codes of 16 bits, each with 15 bits of value).
pub(super) const SLACK_BYTES: usize = 64 * 4 + 8;

/// Reads bits, most significant first. It may read past the end, up to [`SLACK_BYTES`]; the caller asks [`BitReader::is_over`].
pub(super) struct BitReader<'a> {
    /// The data, then [`SLACK_BYTES`] zeros.
    padded: &'a [u8],
    at_bit: usize,
}

impl<'a> BitReader<'a> {
    /// Reads from the start of data that [`SLACK_BYTES`] zeros follow.
    pub fn new(padded: &'a [u8]) -> Self {
        Self { padded, at_bit: 0 }
    }

    /// The next 57 bits or more, in the upper bits of the word.
    #[inline(always)]
    pub fn word(&self) -> u64 {
        let i = self.at_bit >> 3;
        let bytes: [u8; 8] = self.padded[i..i + 8].try_into().expect("eight bytes");
        u64::from_be_bytes(bytes) << (self.at_bit & 7)
    }

    /// Goes on by some bits.
    #[inline(always)]
    pub fn skip(&mut self, bits: u32) {
        self.at_bit += bits as usize;
    }

    /// Reads up to 16 bits as a number.
    #[inline(always)]
    pub fn take(&mut self, bits: u32) -> u32 {
        let value = leading(self.word(), bits);
        self.skip(bits);
        value
    }

    /// Whether more bits were read than there are.
    #[inline(always)]
    pub fn is_over(&self) -> bool {
        self.at_bit > self.end_bit()
    }

    /// The number of bits not yet read.
    pub fn left_bits(&self) -> usize {
        self.end_bit().saturating_sub(self.at_bit)
    }

    /// The bytes that no bit was read of, and the bits left in the byte before them: (value, count).
    pub fn rest(&self) -> (&'a [u8], (u32, u32)) {
        let left = self.left_bits();
        let count = (left % 8) as u32;
        let bytes = &self.padded[..self.end_bit() / 8];
        (&bytes[bytes.len() - left / 8..], (leading(self.word(), count), count))
    }

    fn end_bit(&self) -> usize {
        (self.padded.len() - SLACK_BYTES) * 8
    }
}

/// The upper bits of a word as a number; at most 32.
#[inline(always)]
pub(super) fn leading(word: u64, bits: u32) -> u32 {
    // Two shifts, because a shift by 64 is not defined.
    (word >> 1 >> (63 - bits)) as u32
}

/// The value of `size` magnitude bits that lead a word (T.81, F.2.2.1, EXTEND).
#[inline(always)]
pub(super) fn extended(word: u64, size: u32) -> i32 {
    let value = leading(word, size) as i32;
    // A leading 0 marks a negative value.
    let negative = !((word as i64) >> 63) as i32;
    value + (negative & (1 - (1 << size)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extends_magnitudes_as_t81_table_f1_lists_them() {
        let of = |bits: u64, size: u32| extended(bits << (64 - size), size);
        assert_eq!([of(0, 1), of(1, 1)], [-1, 1]);
        assert_eq!([of(0b00, 2), of(0b01, 2), of(0b10, 2), of(0b11, 2)], [-3, -2, 2, 3]);
        assert_eq!([of(0, 11), of(2047, 11)], [-2047, 2047]);
        assert_eq!(extended(0, 0), 0);
        assert_eq!(extended(u64::MAX, 0), 0);
    }

    #[test]
    fn reads_to_the_end_and_says_what_is_left() {
        let mut padded = vec![0b1010_0101, 0xff, 0x12];
        padded.resize(3 + SLACK_BYTES, 0);
        let mut bits = BitReader::new(&padded);
        assert_eq!([bits.take(3), bits.take(1), bits.take(2)], [0b101, 0, 0b01]);
        assert_eq!(bits.rest(), (&[0xff, 0x12][..], (0b01, 2)));
        assert_eq!((bits.take(16), bits.left_bits(), bits.is_over()), (0b0111_1111_1100_0100, 2, false));
        bits.skip(3);
        assert!(bits.is_over());
    }
}
