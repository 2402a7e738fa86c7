//! Progressive scans: bands of coefficients, bit by bit (T.81, G.2).

use super::bits::{BitReader, extended};
use super::entropy::CodedData;
use super::error::{JpegDamage, JpegError};
use super::frame_header::{Component, Frame};
use super::huffman::HuffmanTable;
use super::plane::{Block, Level, Plane};
use super::quantization::{Steps, is_ac_possible, is_dc_possible};
use super::scan_header::Scan;

/// All coefficients of one component, and how far they are known.
pub(super) struct Coefficients {
    /// Block by block, row by row, each in coded order.
    values: Vec<i16>,
    /// Blocks of a row.
    columns: usize,
    /// By coefficient in coded order: the lowest bit known; `None` before its first scan.
    known: [Option<u8>; 64],
    /// The steps at the first scan of the component.
    steps: Option<Steps>,
}

impl Coefficients {
    /// Zeros for a component.
    pub fn new(frame: &Frame, component: &Component) -> Self {
        let (columns, rows) = (frame.mcus[0] * component.across, frame.mcus[1] * component.down);
        Self { values: vec![0; columns * rows * 64], columns, known: [None; 64], steps: None }
    }

    /// Notes that a scan begins.
    ///
    /// # Errors
    /// If its bits do not follow those of the scans before it, or AC coefficients come before DC.
    pub fn begin(&mut self, scan: &Scan, steps: &Steps) -> Result<(), JpegDamage> {
        let expected = (scan.high_bit > 0).then_some(scan.high_bit);
        let is_next = self.known[scan.first..=scan.last].iter().all(|&known| known == expected);
        if !is_next || scan.first > 0 && self.known[0].is_none() {
            return Err(JpegDamage::Segment("order of the scans"));
        }
        self.known[scan.first..=scan.last].fill(Some(scan.low_bit));
        self.steps.get_or_insert(*steps);
        Ok(())
    }

    /// Whether a scan has coded the component.
    pub fn is_begun(&self) -> bool {
        self.known[0].is_some()
    }

    fn block(&mut self, column: usize, row: usize) -> &mut [i16; 64] {
        let first = (row * self.columns + column) * 64;
        (&mut self.values[first..first + 64]).try_into().expect("64 values")
    }

    /// Transforms all blocks, if there is a plane for them.
    ///
    /// # Errors
    /// If a coefficient is out of range.
    pub fn finish<L: Level>(&self, plane: Option<&mut Plane<L>>) -> Result<(), JpegDamage> {
        let steps = self.steps.ok_or(JpegDamage::ComponentMissing)?;
        let mut plane = plane;
        let mut block = Block::new();
        for (i, values) in self.values.chunks_exact(64).enumerate() {
            block.begin(0);
            for (k, &value) in values.iter().enumerate().filter(|(_, v)| **v != 0) {
                let step = i32::from(steps[k]);
                let value = i32::from(value) * step;
                if !if k == 0 { is_dc_possible(value, step) } else { is_ac_possible(value, step) } {
                    return Err(JpegDamage::Range);
                }
                if k == 0 { block.begin(value) } else { block.put(k, value) }
            }
            if let Some(plane) = &mut plane {
                plane.put(i % self.columns, i / self.columns, &block);
            }
        }
        Ok(())
    }
}

/// Decodes a scan of DC coefficients, by tables in the order of the scan's components (none for a refining scan). Returns where
/// the next segment begins.
///
/// # Errors
/// If the data do not decode exactly.
pub(super) fn decode_dc(
    data: &CodedData,
    frame: &Frame,
    scan: &Scan,
    tables: &[&HuffmanTable],
    coefficients: &mut [Coefficients],
) -> Result<usize, JpegError> {
    let is_single = scan.components.len() == 1;
    data.each_run(|bits, first, count| {
        let mut predictions = [0i32; 4];
        for unit in first..first + count {
            let (unit_column, unit_row) = (unit % data.row_units, unit / data.row_units);
            for (j, part) in scan.components.iter().enumerate() {
                let component = &frame.components[part.index];
                let [across, down] = if is_single { [1, 1] } else { [component.across, component.down] };
                for i in 0..across * down {
                    let (column, row) = (unit_column * across + i % across, unit_row * down + i / across);
                    let value = &mut coefficients[part.index].block(column, row)[0];
                    match tables.get(j) {
                        Some(table) => *value = first_dc(bits, table, &mut predictions[j], scan.low_bit)?,
                        None => *value |= (bits.take(1) as i16) << scan.low_bit,
                    }
                }
            }
            if bits.is_over() {
                return Err(JpegDamage::DataMissing);
            }
        }
        Ok(())
    })
}

fn first_dc(bits: &mut BitReader, table: &HuffmanTable, prediction: &mut i32, low_bit: u8) -> Result<i16, JpegDamage> {
    let word = bits.word();
    let (size, length) = table.symbol(word).ok_or(JpegDamage::Code)?;
    if size > 11 {
        return Err(JpegDamage::Range);
    }
    *prediction += extended(word << length, size);
    bits.skip(length + size);
    i16::try_from(*prediction << low_bit).map_err(|_| JpegDamage::Range)
}

/// Decodes a scan of a band of AC coefficients of one component. Returns where the next segment begins.
///
/// # Errors
/// If the data do not decode exactly.
pub(super) fn decode_ac(
    data: &CodedData,
    scan: &Scan,
    table: &HuffmanTable,
    coefficients: &mut Coefficients,
) -> Result<usize, JpegError> {
    let band = Band { first: scan.first, last: scan.last, low_bit: scan.low_bit, table };
    data.each_run(|bits, first, count| {
        // Blocks, from this one on, that have no more coefficients in the band.
        let mut empty_run = 0u32;
        for unit in first..first + count {
            let block = coefficients.block(unit % data.row_units, unit / data.row_units);
            match scan.high_bit {
                0 => band.first_bits(bits, &mut empty_run, block)?,
                _ => band.refining_bits(bits, &mut empty_run, block)?,
            }
            if bits.is_over() {
                return Err(JpegDamage::DataMissing);
            }
        }
        if empty_run > 0 { Err(JpegDamage::EmptyRun) } else { Ok(()) }
    })
}

/// A band of coefficients of a scan.
struct Band<'a> {
    first: usize,
    last: usize,
    low_bit: u8,
    table: &'a HuffmanTable,
}

impl Band<'_> {
    /// Reads the first bits of a block's coefficients (G.1.2.2).
    fn first_bits(&self, bits: &mut BitReader, empty_run: &mut u32, block: &mut [i16; 64]) -> Result<(), JpegDamage> {
        if *empty_run > 0 {
            *empty_run -= 1;
            return Ok(());
        }
        let mut k = self.first;
        while k <= self.last {
            let word = bits.word();
            let (symbol, length) = self.table.symbol(word).ok_or(JpegDamage::Code)?;
            let (run, size) = ((symbol >> 4) as usize, symbol & 15);
            if size == 0 && run < 15 {
                bits.skip(length);
                *empty_run = (1 << run) - 1 + bits.take(run as u32);
                break;
            }
            k += if size == 0 { 16 } else { run };
            if k > self.last {
                return Err(JpegDamage::Index);
            }
            if size > 0 {
                block[k] =
                    i16::try_from(extended(word << length, size) << self.low_bit).map_err(|_| JpegDamage::Range)?;
                k += 1;
            }
            bits.skip(length + size);
        }
        Ok(())
    }

    /// Reads one more bit of a block's coefficients (G.1.2.3).
    fn refining_bits(
        &self,
        bits: &mut BitReader,
        empty_run: &mut u32,
        block: &mut [i16; 64],
    ) -> Result<(), JpegDamage> {
        let mut k = self.first;
        while *empty_run == 0 && k <= self.last {
            let (symbol, length) = self.table.symbol(bits.word()).ok_or(JpegDamage::Code)?;
            bits.skip(length);
            let (run, size) = ((symbol >> 4) as usize, symbol & 15);
            let new = match size {
                0 if run < 15 => {
                    *empty_run = (1 << run) + bits.take(run as u32);
                    break;
                }
                0 => None,
                1 => Some(if bits.take(1) == 1 { 1i16 << self.low_bit } else { -1i16 << self.low_bit }),
                _ => return Err(JpegDamage::Code),
            };
            k = self.refine(bits, k, run, block);
            if k > self.last {
                return Err(JpegDamage::Index);
            }
            if let Some(value) = new {
                block[k] = value;
            }
            k += 1;
        }
        if *empty_run > 0 {
            self.refine(bits, k, usize::MAX, block);
            *empty_run -= 1;
        }
        Ok(())
    }

    /// Reads the next bit of every coefficient that is not 0, up to the first 0 after `zeros` others; returns its number.
    fn refine(&self, bits: &mut BitReader, first: usize, mut zeros: usize, block: &mut [i16; 64]) -> usize {
        let bit = 1i16 << self.low_bit;
        for (k, coefficient) in block.iter_mut().enumerate().take(self.last + 1).skip(first) {
            if *coefficient == 0 {
                if zeros == 0 {
                    return k;
                }
                zeros -= 1;
            } else if bits.take(1) == 1 && *coefficient & bit == 0 {
                *coefficient += if *coefficient > 0 { bit } else { -bit };
            }
        }
        self.last + 1
    }
}
