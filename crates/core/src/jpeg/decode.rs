//! Decoding: segment after segment, scan after scan, to planes and images.

use super::colour::{ColourSpace, colour_space, compose};
use super::entropy::CodedData;
use super::error::{JpegDamage, JpegError};
use super::frame_header::{Frame, JpegHeader, is_frame_header, misplaced, read_frame};
use super::huffman::HuffmanTable;
use super::plane::{Level, Plane, Reduction};
use super::progressive::{Coefficients, decode_ac, decode_dc};
use super::quantization::{Steps, read_tables};
use super::scan_header::{Scan, missing, read_scan};
use super::segments::{Segment, marker, segment_at};
use super::sequential::{Tables, decode_scan};
use super::standard_tables::standard_tables;
use crate::pixels::{Colour, Gray};

/// Reads the header of a file, up to the size of its image. Nothing behind it is checked.
///
/// # Errors
/// [`JpegError`] where the header is damaged, of a kind that is not read, or missing.
pub fn header(bytes: &[u8]) -> Result<JpegHeader, JpegError> {
    let mut at_byte = start(bytes)?;
    loop {
        let segment = segment_at(bytes, at_byte)?;
        match segment.marker {
            marker if is_frame_header(marker) => return Ok(read_frame(&segment)?.header()),
            marker::SOS | marker::EOI | marker::SOI => return Err(misplaced(&segment)),
            _ => at_byte = segment.end,
        }
    }
}

/// Decodes all coded data of a file and makes no image.
///
/// # Errors
/// [`JpegError`] where the file does not decode exactly.
pub fn check(bytes: &[u8]) -> Result<JpegHeader, JpegError> {
    let decoded = Decoder::<u8>::run(bytes, |_, _| Vec::new())?;
    Ok(decoded.frame.header())
}

/// Decodes a file to gray levels in [0, 255]: its luma (ITU-R BT.601), unrounded. Of a colour file only the luma is transformed.
/// At a reduced size the higher frequencies of each block are left out; rows and columns of the file that fill no pixel are dropped.
///
/// The caller checks the size that [`header`] states: memory grows with it.
///
/// # Errors
/// [`JpegError`] where the file does not decode exactly.
pub fn decode_gray(bytes: &[u8], reduction: Reduction) -> Result<Gray, JpegError> {
    let mut decoded = Decoder::<f32>::run(bytes, |frame, space| {
        let is_luma = matches!(space, ColourSpace::Gray | ColourSpace::YCbCr) && frame.components[0].is_whole(frame);
        if is_luma { vec![Some(Plane::new(&frame.components[0], reduction))] } else { Vec::new() }
    })?;
    match decoded.planes.first_mut().and_then(Option::take) {
        Some(plane) => Ok(Gray::from_values(plane.width_px, plane.height_px, plane.values).expect("a value a pixel")),
        // The luma of other colours needs all components.
        None => decode_colour(bytes, reduction).map(|colour| colour.to_gray()),
    }
}

/// Decodes a file to colours, as [`decode_gray`]. Inks (CMYK) are taken as inverted, as Adobe's programs write them.
///
/// # Errors
/// As [`decode_gray`].
pub fn decode_colour(bytes: &[u8], reduction: Reduction) -> Result<Colour, JpegError> {
    let decoded = Decoder::<u8>::run(bytes, |frame, _| {
        frame.components.iter().map(|component| Some(Plane::new(component, reduction))).collect()
    })?;
    let planes: Vec<_> = decoded.planes.iter().flatten().collect();
    Ok(compose(&decoded.frame, decoded.space, &planes))
}

fn start(bytes: &[u8]) -> Result<usize, JpegError> {
    if bytes.starts_with(&[0xff, marker::SOI]) { Ok(2) } else { Err(JpegError::NotJpeg) }
}

/// The frame, and what its scans have filled.
struct Decoded<L> {
    frame: Frame,
    space: ColourSpace,
    /// By component; `None` for those without an image.
    planes: Vec<Option<Plane<L>>>,
    /// By component, of a progressive file.
    coefficients: Vec<Coefficients>,
    /// Which components of a sequential file are coded.
    is_coded: Vec<bool>,
}

/// What the segments so far have defined.
struct Decoder<'a, L> {
    bytes: &'a [u8],
    steps: [Option<Steps>; 4],
    /// By class (DC, AC) and number.
    huffman: [[Option<HuffmanTable>; 4]; 2],
    restart_interval: usize,
    adobe_transform: Option<u8>,
    decoded: Option<Decoded<L>>,
}

impl<'a, L: Level> Decoder<'a, L> {
    /// Decodes a file; `planes` says which components get an image (those after its last get none).
    fn run(
        bytes: &'a [u8],
        planes: impl Fn(&Frame, ColourSpace) -> Vec<Option<Plane<L>>>,
    ) -> Result<Decoded<L>, JpegError> {
        let mut decoder = Self {
            bytes,
            steps: [None; 4],
            huffman: Default::default(),
            restart_interval: 0,
            adobe_transform: None,
            decoded: None,
        };
        let mut at_byte = start(bytes)?;
        loop {
            let segment = segment_at(bytes, at_byte)?;
            at_byte = segment.end;
            match segment.marker {
                marker::EOI => return decoder.finished(&segment),
                marker::SOS => at_byte = decoder.scan(&segment)?,
                marker if is_frame_header(marker) && decoder.decoded.is_none() => {
                    let frame = read_frame(&segment)?;
                    let space = colour_space(&frame, decoder.adobe_transform);
                    let planes = planes(&frame, space);
                    decoder.decoded = Some(Decoded::new(frame, space, planes));
                }
                _ => decoder.define(&segment)?,
            }
        }
    }

    /// Takes a segment that defines something for the scans, or nothing.
    fn define(&mut self, segment: &Segment) -> Result<(), JpegError> {
        let content = segment.content;
        match segment.marker {
            marker::DQT => {
                for (number, steps) in read_tables(content).map_err(|damage| damage.at(segment.at_byte))? {
                    self.steps[number] = Some(steps);
                }
            }
            marker::DHT => self.define_huffman(segment)?,
            marker::DRI => match *content {
                [high, low] => self.restart_interval = u16::from_be_bytes([high, low]).into(),
                _ => return Err(segment.is_not_valid("restart interval")),
            },
            marker::DNL => {
                let height = self.decoded.as_ref().map(|d| d.frame.height_px);
                if !matches!(*content, [h, l] if Some(u16::from_be_bytes([h, l]).into()) == height) {
                    return Err(segment.is_not_valid("number of lines"));
                }
            }
            // "Adobe", version, two words of flags, transform.
            marker::APP14 if content.starts_with(b"Adobe") && content.len() >= 12 && self.decoded.is_none() => {
                self.adobe_transform = Some(content[11]);
            }
            marker::APP0..=marker::APP15 | marker::COM => {}
            _ => return Err(misplaced(segment)),
        }
        Ok(())
    }

    fn define_huffman(&mut self, segment: &Segment) -> Result<(), JpegError> {
        let refused = || segment.is_not_valid("Huffman table");
        let mut content = segment.content;
        while let [head, rest @ ..] = content {
            let (class, number) = (usize::from(head >> 4), usize::from(head & 15));
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or_else(refused)?;
            let total = counts.iter().map(|&n| usize::from(n)).sum();
            let symbols = rest.get(..total).filter(|_| class < 2 && number < 4).ok_or_else(refused)?;
            let table = HuffmanTable::new(*counts, symbols).map_err(|damage| damage.at(segment.at_byte))?;
            self.huffman[class][number] = Some(table);
            content = &rest[total..];
        }
        Ok(())
    }

    /// Decodes a scan; returns where the next segment begins.
    fn scan(&mut self, segment: &Segment) -> Result<usize, JpegError> {
        let decoded = self.decoded.as_mut().ok_or_else(|| misplaced(segment))?;
        if self.huffman.iter().flatten().all(Option::is_none) {
            for (class, tables) in self.huffman.iter_mut().zip(standard_tables()) {
                class.iter_mut().zip(tables).for_each(|(slot, table)| *slot = Some(table));
            }
        }
        let scan = read_scan(segment, &decoded.frame)?;
        let [row_units, rows] = scan.units(&decoded.frame);
        let data = CodedData {
            bytes: self.bytes,
            at_byte: segment.end,
            restart_interval: self.restart_interval,
            units: row_units * rows,
            row_units,
        };
        let tables = ScanTables { steps: &self.steps, huffman: &self.huffman, at_byte: segment.at_byte };
        if decoded.frame.is_progressive {
            decoded.progressive_scan(&data, &scan, &tables)
        } else {
            decoded.sequential_scan(&data, &scan, &tables)
        }
    }

    fn finished(self, end: &Segment) -> Result<Decoded<L>, JpegError> {
        let mut decoded = self.decoded.ok_or_else(|| misplaced(end))?;
        let is_whole = match decoded.frame.is_progressive {
            true => decoded.coefficients.iter().all(Coefficients::is_begun),
            false => decoded.is_coded.iter().all(|&coded| coded),
        };
        if !is_whole {
            return Err(JpegDamage::ComponentMissing.at(end.at_byte));
        }
        for (coefficients, plane) in decoded.coefficients.iter().zip(&mut decoded.planes) {
            coefficients.finish(plane.as_mut()).map_err(|damage| damage.at(end.at_byte))?;
        }
        decoded.coefficients.clear();
        Ok(decoded)
    }
}

/// The tables that a scan may use.
struct ScanTables<'a> {
    steps: &'a [Option<Steps>; 4],
    huffman: &'a [[Option<HuffmanTable>; 4]; 2],
    at_byte: usize,
}

impl<'a> ScanTables<'a> {
    fn steps(&self, number: usize) -> Result<&'a Steps, JpegError> {
        self.steps[number].as_ref().ok_or_else(|| missing("quantization table", self.at_byte))
    }

    fn dc(&self, number: usize) -> Result<&'a HuffmanTable, JpegError> {
        self.huffman[0][number].as_ref().ok_or_else(|| missing("Huffman table", self.at_byte))
    }

    fn ac(&self, number: usize) -> Result<&'a HuffmanTable, JpegError> {
        self.huffman[1][number].as_ref().ok_or_else(|| missing("Huffman table", self.at_byte))
    }
}

impl<L: Level> Decoded<L> {
    fn new(frame: Frame, space: ColourSpace, mut planes: Vec<Option<Plane<L>>>) -> Self {
        planes.resize_with(frame.components.len(), || None);
        let all = frame.is_progressive.then(|| frame.components.iter().map(|c| Coefficients::new(&frame, c)).collect());
        let is_coded = vec![false; frame.components.len()];
        Self { space, planes, coefficients: all.unwrap_or_default(), is_coded, frame }
    }

    fn sequential_scan(&mut self, data: &CodedData, scan: &Scan, tables: &ScanTables) -> Result<usize, JpegError> {
        let mut used = Vec::with_capacity(scan.components.len());
        for part in &scan.components {
            if std::mem::replace(&mut self.is_coded[part.index], true) {
                return Err(JpegDamage::Segment("scan header").at(tables.at_byte));
            }
            let steps = tables.steps(self.frame.components[part.index].steps)?;
            used.push(Tables { dc: tables.dc(part.dc_table)?, ac: tables.ac(part.ac_table)?, steps });
        }
        decode_scan(data, &self.frame, scan, &used, &mut self.planes)
    }

    fn progressive_scan(&mut self, data: &CodedData, scan: &Scan, tables: &ScanTables) -> Result<usize, JpegError> {
        for part in &scan.components {
            let steps = tables.steps(self.frame.components[part.index].steps)?;
            self.coefficients[part.index].begin(scan, steps).map_err(|damage| damage.at(tables.at_byte))?;
        }
        if scan.first > 0 {
            let part = scan.components[0];
            return decode_ac(data, scan, tables.ac(part.ac_table)?, &mut self.coefficients[part.index]);
        }
        let mut used = Vec::new();
        if scan.high_bit == 0 {
            used = scan.components.iter().map(|part| tables.dc(part.dc_table)).collect::<Result<_, _>>()?;
        }
        decode_dc(data, &self.frame, scan, &used, &mut self.coefficients)
    }
}
