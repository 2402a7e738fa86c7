//! `HuffmanTable`: a table of Huffman codes, read from its segment.

use super::bits::leading;
use super::error::JpegDamage;

/// Codes of up to this length are found in one look.
const FAST_BITS: u32 = 10;

/// The codes of a table (T.81, annex C).
#[derive(Clone)]
pub(super) struct HuffmanTable {
    /// By the next [`FAST_BITS`] bits: symbol * 256 + length; 0 where the code is longer, or there is none.
    fast: Box<[u16; 1 << FAST_BITS]>,
    /// By length: the first 16-bit number that is above all codes of this length and shorter ones, left-aligned.
    limit: [u32; 17],
    /// By length: what the code's number is less than its place among the symbols.
    offset: [i32; 17],
    symbols: Vec<u8>,
}

impl HuffmanTable {
    /// Makes a table of the number of codes of each length 1 to 16, and the symbols in order.
    ///
    /// # Errors
    /// If there are more codes than their lengths allow, a symbol stands twice, or counts and symbols do not agree.
    pub fn new(counts: [u8; 16], symbols: &[u8]) -> Result<Self, JpegDamage> {
        let refused = Err(JpegDamage::Segment("Huffman table"));
        let total: usize = counts.iter().map(|&n| usize::from(n)).sum();
        let mut seen = [false; 256];
        let is_twice = |&s: &u8| std::mem::replace(&mut seen[usize::from(s)], true);
        if total != symbols.len() || total == 0 || symbols.iter().any(is_twice) {
            return refused;
        }
        let mut table =
            Self { fast: Box::new([0; 1 << FAST_BITS]), limit: [0; 17], offset: [0; 17], symbols: symbols.to_vec() };
        let (mut code, mut place) = (0u32, 0usize);
        for (length, &count) in (1u32..).zip(&counts) {
            table.offset[length as usize] = place as i32 - code as i32;
            for &symbol in &symbols[place..place + usize::from(count)] {
                if length <= FAST_BITS && code >> length == 0 {
                    let first = (code << (FAST_BITS - length)) as usize;
                    let entry = u16::from(symbol) << 8 | length as u16;
                    table.fast[first..first + (1 << (FAST_BITS - length))].fill(entry);
                }
                code += 1;
            }
            if code > 1 << length {
                return refused;
            }
            place += usize::from(count);
            table.limit[length as usize] = code << (16 - length);
            code <<= 1;
        }
        Ok(table)
    }

    /// Symbol and length of the code that leads a word; `None` where there is no such code.
    #[inline(always)]
    pub fn symbol(&self, word: u64) -> Option<(u32, u32)> {
        let entry = self.fast[leading(word, FAST_BITS) as usize];
        if entry != 0 { Some((u32::from(entry >> 8), u32::from(entry & 255))) } else { self.long_symbol(word) }
    }

    #[cold]
    fn long_symbol(&self, word: u64) -> Option<(u32, u32)> {
        let bits = leading(word, 16);
        let length = (FAST_BITS + 1..=16).find(|&n| bits < self.limit[n as usize])?;
        let place = (bits >> (16 - length)) as i32 + self.offset[length as usize];
        let symbol = self.symbols.get(usize::try_from(place).ok()?)?;
        Some((u32::from(*symbol), length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(of: &[(usize, u8)]) -> [u8; 16] {
        let mut counts = [0; 16];
        of.iter().for_each(|&(length, n)| counts[length - 1] = n);
        counts
    }

    #[test]
    fn finds_short_and_long_codes_and_says_where_there_is_none() {
        // 0, 10, 110, then 1110 0000 0000 0 and 1110 0000 0000 1 (13 bits).
        let table = HuffmanTable::new(counts(&[(1, 1), (2, 1), (3, 1), (13, 2)]), &[7, 1, 2, 9, 4]).unwrap();
        let at = |text: &str| table.symbol(u64::from_str_radix(text, 2).unwrap() << (64 - text.len()));
        assert_eq!([at("0"), at("10"), at("110")], [Some((7, 1)), Some((1, 2)), Some((2, 3))]);
        assert_eq!([at("1110000000000"), at("1110000000001")], [Some((9, 13)), Some((4, 13))]);
        assert_eq!([at("1110000000010"), at("1111111111111111")], [None, None]);
    }

    #[test]
    fn refuses_tables_that_no_encoder_writes() {
        assert!(HuffmanTable::new(counts(&[(1, 3)]), &[1, 2, 3]).is_err(), "three codes of one bit");
        assert!(HuffmanTable::new(counts(&[(2, 2)]), &[5, 5]).is_err(), "a symbol twice");
        assert!(HuffmanTable::new(counts(&[(2, 2)]), &[5]).is_err(), "a symbol too few");
        assert!(HuffmanTable::new(counts(&[]), &[]).is_err(), "no code");
    }
}
