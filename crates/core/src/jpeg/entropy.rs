//! Runs of coded data: from one marker to the next, with what may remain at their ends.

use super::bits::{BitReader, SLACK_BYTES};
use super::error::{JpegDamage, JpegError};
use super::segments::marker;

/// Bytes that may stand between the data and a marker. Webcams write a few.
const MOST_JUNK_BYTES: usize = 16;
/// Such bytes are let pass where a run covers at most this share of the image: data that a damage has shifted by some blocks
/// end in such bytes too, and shift no more than their own run.
const SHORT_RUNS: usize = 8;

/// The coded data of one scan.
pub(super) struct CodedData<'a> {
    pub bytes: &'a [u8],
    /// Where they begin.
    pub at_byte: usize,
    /// MCUs (or blocks, of a scan of one component) between restart markers; 0 without them.
    pub restart_interval: usize,
    /// MCUs (or blocks) of the scan, and those of a row.
    pub units: usize,
    pub row_units: usize,
}

impl CodedData<'_> {
    /// Calls `decode` with the bits of every run, and the first and the number of its units; returns where the next segment
    /// begins.
    ///
    /// # Errors
    /// What `decode` says; and if a run ends before its last unit, or goes on after it, or restart markers are out of order.
    pub fn each_run(
        &self,
        mut decode: impl FnMut(&mut BitReader, usize, usize) -> Result<(), JpegDamage>,
    ) -> Result<usize, JpegError> {
        let interval = if self.restart_interval == 0 { self.units } else { self.restart_interval };
        let is_short = interval < self.units && (interval * SHORT_RUNS <= self.units || interval <= self.row_units);
        let mut at_byte = self.at_byte;
        let mut padded = Vec::new();
        for (run, first) in (0..self.units).step_by(interval).enumerate() {
            if run > 0 {
                at_byte = self.after_restart(at_byte, run - 1)?;
            }
            let start = at_byte;
            at_byte = unstuff(self.bytes, start, &mut padded);
            let mut bits = BitReader::new(&padded);
            decode(&mut bits, first, interval.min(self.units - first))
                .and_then(|()| check_end(&bits, is_short))
                .map_err(|damage| damage.at(start))?;
        }
        // Some encoders write a restart marker after the last run too.
        let runs = self.units.div_ceil(interval);
        let is_marker_left = matches!(
            self.bytes.get(at_byte..at_byte + 4),
            Some([0xff, marker::RST0..=marker::RST7, 0xff, marker::EOI])
        );
        Ok(if is_marker_left && self.restart_interval > 0 { self.after_restart(at_byte, runs - 1)? } else { at_byte })
    }

    /// Where the run after a restart marker begins.
    fn after_restart(&self, at_byte: usize, number: usize) -> Result<usize, JpegError> {
        let expected = marker::RST0 + (number % 8) as u8;
        let rest = &self.bytes[at_byte.min(self.bytes.len())..];
        let fill = rest.iter().take_while(|&&b| b == 0xff).count();
        match rest.get(fill) {
            None => Err(JpegDamage::EndsEarly.at(at_byte)),
            Some(&found) if found == expected && fill > 0 => Ok(at_byte + fill + 1),
            Some(&found) => Err(JpegDamage::Restart { expected, found }.at(at_byte)),
        }
    }
}

/// Copies data up to the next marker, without the zero that follows each FF, and appends [`SLACK_BYTES`] zeros. Returns where the
/// marker, or the end of the file, is.
fn unstuff(bytes: &[u8], start: usize, padded: &mut Vec<u8>) -> usize {
    padded.clear();
    let mut at = start.min(bytes.len());
    let end = loop {
        let Some(plain) = bytes[at..].iter().position(|&b| b == 0xff) else {
            padded.extend_from_slice(&bytes[at..]);
            break bytes.len();
        };
        padded.extend_from_slice(&bytes[at..at + plain]);
        if bytes.get(at + plain + 1) != Some(&0) {
            break at + plain;
        }
        padded.push(0xff);
        at += plain + 2;
    };
    padded.resize(padded.len() + SLACK_BYTES, 0);
    end
}

/// Checks what remains of a run after its last block: bits that fill a byte, all 1 (T.81, F.1.2.3) or all 0, and perhaps a
/// few bytes of junk.
fn check_end(bits: &BitReader, is_short: bool) -> Result<(), JpegDamage> {
    if bits.is_over() {
        return Err(JpegDamage::DataMissing);
    }
    let (junk, (fill, count)) = bits.rest();
    let is_fill = fill == 0 || fill == (1 << count) - 1;
    let is_harmless = junk.len() <= MOST_JUNK_BYTES && (is_short || junk.iter().all(|&b| b == 0));
    if is_fill && is_harmless { Ok(()) } else { Err(JpegDamage::DataLeft(bits.left_bits())) }
}
