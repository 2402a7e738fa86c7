//! Sequential scans: all coefficients of a block at once (T.81, F.2).

use super::bits::{BitReader, extended};
use super::entropy::CodedData;
use super::error::{JpegDamage, JpegError};
use super::frame_header::Frame;
use super::huffman::HuffmanTable;
use super::plane::{Block, Level, Plane};
use super::quantization::{Steps, is_ac_possible, is_dc_possible};
use super::scan_header::Scan;

/// The tables of one component of a scan.
pub(super) struct Tables<'a> {
    pub dc: &'a HuffmanTable,
    pub ac: &'a HuffmanTable,
    pub steps: &'a Steps,
}

/// Decodes a scan into the planes of its components; those without a plane are decoded and dropped. Returns where the next
/// segment begins.
///
/// # Errors
/// If the data do not decode exactly.
pub(super) fn decode_scan<L: Level>(
    data: &CodedData,
    frame: &Frame,
    scan: &Scan,
    tables: &[Tables],
    planes: &mut [Option<Plane<L>>],
) -> Result<usize, JpegError> {
    let is_single = scan.components.len() == 1;
    let mut block = Block::new();
    data.each_run(|bits, first, count| {
        let mut before = [BlockBefore::default(); 4];
        for unit in first..first + count {
            let (unit_column, unit_row) = (unit % data.row_units, unit / data.row_units);
            for ((part, tables), before) in scan.components.iter().zip(tables).zip(&mut before) {
                let component = &frame.components[part.index];
                let [across, down] = if is_single { [1, 1] } else { [component.across, component.down] };
                for i in 0..across * down {
                    match &mut planes[part.index] {
                        Some(plane) => {
                            read_block::<true>(bits, tables, before, &mut block)?;
                            plane.put(unit_column * across + i % across, unit_row * down + i / across, &block);
                        }
                        None => read_block::<false>(bits, tables, before, &mut block)?,
                    }
                }
            }
        }
        Ok(())
    })
}

/// What a block is compared with: the block of its component before it.
#[derive(Debug, Clone, Copy, Default)]
struct BlockBefore {
    /// Its first coefficient, over the step.
    first: i32,
    /// A hash of the others.
    hash: u32,
}

/// No camera gives two blocks one after the other with this many coefficients and all of them equal: the coded data are a run of equal
/// bytes.
const MOST_REPEATED: u32 = 40;

/// Reads the first coefficient of a block, and returns it times its step.
#[inline(always)]
fn read_first(bits: &mut BitReader, tables: &Tables, before: &mut BlockBefore) -> Result<i32, JpegDamage> {
    let word = bits.word();
    let (size, length) = tables.dc.symbol(word).ok_or(JpegDamage::Code)?;
    if size > 11 {
        return Err(JpegDamage::Range);
    }
    before.first += extended(word << length, size);
    bits.skip(length + size);
    let step = i32::from(tables.steps[0]);
    let value = before.first * step;
    if is_dc_possible(value, step) { Ok(value) } else { Err(JpegDamage::Range) }
}

/// Reads a block; its coefficients are stored where they are to be kept.
#[inline(always)]
fn read_block<const KEPT: bool>(
    bits: &mut BitReader,
    tables: &Tables,
    before: &mut BlockBefore,
    block: &mut Block,
) -> Result<(), JpegDamage> {
    let first = read_first(bits, tables, before)?;
    if KEPT {
        block.begin(first);
    }
    let (mut hash, mut count) = (0u32, 0);
    let mut k = 1;
    while k < 64 {
        let word = bits.word();
        let (symbol, length) = tables.ac.symbol(word).ok_or(JpegDamage::Code)?;
        let (run, size) = ((symbol >> 4) as usize, symbol & 15);
        if size == 0 {
            bits.skip(length);
            match run {
                0 => break,
                15 => k += 16,
                _ => return Err(JpegDamage::Code),
            }
            // A run of 16 zeros is followed by a coefficient.
            if k > 63 {
                return Err(JpegDamage::Index);
            }
            continue;
        }
        k += run;
        if k > 63 {
            return Err(JpegDamage::Index);
        }
        let step = i32::from(tables.steps[k]);
        let value = extended(word << length, size) * step;
        bits.skip(length + size);
        if size > 10 || !is_ac_possible(value, step) {
            return Err(JpegDamage::Range);
        }
        if KEPT {
            block.put(k, value);
        }
        hash = (hash ^ (value as u32) << 8 ^ k as u32).wrapping_mul(0x0100_0193);
        count += 1;
        k += 1;
    }
    if count >= MOST_REPEATED && hash == before.hash {
        return Err(JpegDamage::Repeated);
    }
    before.hash = hash;
    if bits.is_over() { Err(JpegDamage::DataMissing) } else { Ok(()) }
}
