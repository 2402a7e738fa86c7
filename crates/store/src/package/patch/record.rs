//! The records of a patch, layer by layer: tiles by zoom, row and column, then the inputs hashes of tiles.
//!
//! All numbers are little-endian. A tile is zoom (u8), row and column (u32 each). A text or blob follows its length (u32).

use crate::versions::PLACES_SINCE;
use crate::{Footprint, MOST_ERROR_M};
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use std::io::{ErrorKind, Read, Write};

const END: u8 = 0;
const GONE: u8 = 1;
const PUT: u8 = 2;
const ABSENT: u8 = 0;
const AS_IN_BASE: u8 = 1;
const GIVEN: u8 = 2;
/// Largest text or blob, bytes. The imagery of a tile is far smaller.
const MOST_BYTES: u32 = 64 << 20;

/// Why bytes are not a patch.
#[derive(Debug)]
pub enum MalformedPatch {
    /// The content is not valid.
    Content(String),
    /// The reader failed.
    Io(std::io::Error),
}

impl From<std::io::Error> for MalformedPatch {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            ErrorKind::UnexpectedEof => Self::Content("it ends too early".into()),
            _ => Self::Io(error),
        }
    }
}

/// The change of a tile.
#[derive(Debug, Clone, PartialEq)]
pub enum TileRecord {
    /// The tile is removed.
    Gone(TileId),
    /// The tile is added or replaced.
    Put(Box<PutTile>),
}

/// An added or replaced tile.
#[derive(Debug, Clone, PartialEq)]
pub struct PutTile {
    /// Footprint.
    pub footprint: Footprint,
    /// Imagery.
    pub image: PatchBlob,
    /// Keypoints.
    pub descriptors: PatchBlob,
    /// Cells.
    pub cells: PatchBlob,
}

/// One blob of a tile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PatchBlob {
    /// The tile has no such blob.
    Absent,
    /// The blob of the old tile.
    AsInBase,
    /// This blob.
    Given(Vec<u8>),
}

impl PatchBlob {
    /// Describes how to get the new blob from the old one.
    pub fn new(base: Option<&[u8]>, result: Option<&[u8]>) -> Self {
        match result {
            None => Self::Absent,
            same if same == base => Self::AsInBase,
            Some(bytes) => Self::Given(bytes.to_vec()),
        }
    }
}

/// The change of a tile's inputs hash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InputsRecord {
    /// The hash is removed.
    Gone(TileId),
    /// The hash is this.
    Put(TileId, [u8; 32]),
}

impl TileRecord {
    /// Returns the tile.
    pub fn tile(&self) -> TileId {
        match self {
            Self::Gone(tile) => *tile,
            Self::Put(put) => put.footprint.tile,
        }
    }

    /// Writes the record of a store of a format version.
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn write(&self, to: &mut impl Write, store_format: u32) -> std::io::Result<()> {
        let put = match self {
            Self::Gone(tile) => return write_tile(to, GONE, *tile),
            Self::Put(put) => put,
        };
        let footprint = &put.footprint;
        write_tile(to, PUT, footprint.tile)?;
        to.write_all(&footprint.content_hash)?;
        write_optional(to, footprint.acquired.as_deref())?;
        let error_m = footprint.horizontal_error_m;
        // A format that knows no unknown error has 0 in its place.
        let error_m = if store_format < PLACES_SINCE { error_m.unwrap_or(0.0) } else { error_m.unwrap_or(f64::NAN) };
        for value in [footprint.valid_fraction, error_m, footprint.distinctiveness] {
            to.write_all(&value.to_le_bytes())?;
        }
        to.write_all(&footprint.keypoints.to_le_bytes())?;
        write_bytes(to, footprint.sources.as_bytes())?;
        if store_format >= PLACES_SINCE {
            let outline =
                footprint.valid_outline.as_ref().map_or(PatchBlob::Absent, |o| PatchBlob::Given(o.to_bytes()));
            write_part(to, &outline)?;
        }
        [&put.image, &put.descriptors, &put.cells].into_iter().try_for_each(|part| write_part(to, part))
    }
}

impl InputsRecord {
    /// Returns the tile.
    pub fn tile(&self) -> TileId {
        match self {
            Self::Gone(tile) | Self::Put(tile, _) => *tile,
        }
    }

    /// Writes the record.
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn write(&self, to: &mut impl Write) -> std::io::Result<()> {
        match self {
            Self::Gone(tile) => write_tile(to, GONE, *tile),
            Self::Put(tile, hash) => write_tile(to, PUT, *tile).and_then(|()| to.write_all(hash)),
        }
    }
}

/// Writes the end of a list of records.
///
/// # Errors
/// Where the writer fails.
pub fn write_end(to: &mut impl Write) -> std::io::Result<()> {
    to.write_all(&[END])
}

fn write_tile(to: &mut impl Write, kind: u8, tile: TileId) -> std::io::Result<()> {
    to.write_all(&[kind, tile.zoom()])?;
    to.write_all(&tile.row().to_le_bytes())?;
    to.write_all(&tile.column().to_le_bytes())
}

fn write_bytes(to: &mut impl Write, bytes: &[u8]) -> std::io::Result<()> {
    let length = u32::try_from(bytes.len()).map_err(|_| std::io::Error::other("a blob of over 4 GB"))?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(bytes)
}

fn write_optional(to: &mut impl Write, text: Option<&str>) -> std::io::Result<()> {
    match text {
        None => to.write_all(&[ABSENT]),
        Some(text) => to.write_all(&[GIVEN]).and_then(|()| write_bytes(to, text.as_bytes())),
    }
}

fn write_part(to: &mut impl Write, part: &PatchBlob) -> std::io::Result<()> {
    match part {
        PatchBlob::Absent => to.write_all(&[ABSENT]),
        PatchBlob::AsInBase => to.write_all(&[AS_IN_BASE]),
        PatchBlob::Given(bytes) => to.write_all(&[GIVEN]).and_then(|()| write_bytes(to, bytes)),
    }
}

/// A reader of records. Each list must be in strictly ascending order of tiles.
#[derive(Debug)]
pub struct Records<R> {
    from: R,
    store_format: u32,
    last: Option<TileId>,
}

impl<R: Read> Records<R> {
    /// Reads the records after a header that states this format version.
    pub fn new(from: R, store_format: u32) -> Self {
        Self { from, store_format, last: None }
    }

    /// Reads the next record of a tile: `None` at the end of the list.
    ///
    /// # Errors
    /// Where the bytes are not a record, or the reader fails.
    pub fn tile(&mut self) -> Result<Option<TileRecord>, MalformedPatch> {
        let Some((kind, tile)) = self.head()? else { return Ok(None) };
        if kind == GONE {
            return Ok(Some(TileRecord::Gone(tile)));
        }
        let footprint = Footprint {
            tile,
            content_hash: self.array()?,
            acquired: self.optional()?,
            valid_fraction: f64::from_le_bytes(self.array()?),
            horizontal_error_m: self.error()?,
            distinctiveness: f64::from_le_bytes(self.array()?),
            keypoints: u32::from_le_bytes(self.array()?),
            sources: self.text()?,
            valid_outline: self.outline()?,
        };
        let (image, descriptors, cells) = (self.part()?, self.part()?, self.part()?);
        Ok(Some(TileRecord::Put(Box::new(PutTile { footprint, image, descriptors, cells }))))
    }

    /// Reads the next record of an inputs hash: `None` at the end of the list.
    ///
    /// # Errors
    /// Where the bytes are not a record, or the reader fails.
    pub fn inputs(&mut self) -> Result<Option<InputsRecord>, MalformedPatch> {
        let Some((kind, tile)) = self.head()? else { return Ok(None) };
        Ok(Some(if kind == GONE { InputsRecord::Gone(tile) } else { InputsRecord::Put(tile, self.array()?) }))
    }

    /// Whether the end of the records is reached.
    ///
    /// # Errors
    /// Where the reader fails.
    pub fn is_at_end(&mut self) -> Result<bool, MalformedPatch> {
        Ok(self.from.read(&mut [0])? == 0)
    }

    fn head(&mut self) -> Result<Option<(u8, TileId)>, MalformedPatch> {
        let kind = self.byte()?;
        match kind {
            END => {
                self.last = None;
                return Ok(None);
            }
            GONE | PUT => {}
            other => return Err(MalformedPatch::Content(format!("a record of kind {other}"))),
        }
        let (zoom, row, column) = (self.byte()?, u32::from_le_bytes(self.array()?), u32::from_le_bytes(self.array()?));
        let tile = TileId::new(zoom, column, row).map_err(|e| MalformedPatch::Content(e.to_string()))?;
        if self.last.replace(tile).is_some_and(|last| last >= tile) {
            return Err(MalformedPatch::Content(format!("tile {tile} is out of order")));
        }
        Ok(Some((kind, tile)))
    }

    fn byte(&mut self) -> Result<u8, MalformedPatch> {
        self.array::<1>().map(|[byte]| byte)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], MalformedPatch> {
        let mut bytes = [0; N];
        self.from.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn bytes(&mut self) -> Result<Vec<u8>, MalformedPatch> {
        let length = u32::from_le_bytes(self.array()?);
        if length > MOST_BYTES {
            return Err(MalformedPatch::Content(format!("a blob of {length} bytes")));
        }
        // Allocates as bytes arrive, not as the length claims.
        let mut bytes = Vec::new();
        (&mut self.from).take(length.into()).read_to_end(&mut bytes)?;
        if bytes.len() == length as usize {
            Ok(bytes)
        } else {
            Err(MalformedPatch::Content("it ends too early".into()))
        }
    }

    fn text(&mut self) -> Result<String, MalformedPatch> {
        String::from_utf8(self.bytes()?).map_err(|_| MalformedPatch::Content("a text that is not UTF-8".into()))
    }

    fn optional(&mut self) -> Result<Option<String>, MalformedPatch> {
        match self.byte()? {
            ABSENT => Ok(None),
            GIVEN => self.text().map(Some),
            other => Err(MalformedPatch::Content(format!("a text of kind {other}"))),
        }
    }

    /// A horizontal error, metres: `None` where it is unknown.
    fn error(&mut self) -> Result<Option<f64>, MalformedPatch> {
        let error_m = f64::from_le_bytes(self.array()?);
        let is_unknown = if self.store_format < PLACES_SINCE { error_m == 0.0 } else { error_m.is_nan() };
        match error_m {
            _ if is_unknown => Ok(None),
            error_m if (0.0..=MOST_ERROR_M).contains(&error_m) => Ok(Some(error_m)),
            other => Err(MalformedPatch::Content(format!("a horizontal error of {other} m"))),
        }
    }

    fn outline(&mut self) -> Result<Option<MaskOutline>, MalformedPatch> {
        if self.store_format < PLACES_SINCE {
            return Ok(None);
        }
        let malformed = || MalformedPatch::Content("no valid outline".into());
        match self.part()? {
            PatchBlob::Absent => Ok(None),
            PatchBlob::AsInBase => Err(malformed()),
            PatchBlob::Given(bytes) => {
                MaskOutline::from_bytes(&bytes, TILE_SIZE_PX as u16).map(Some).ok_or_else(malformed)
            }
        }
    }

    fn part(&mut self) -> Result<PatchBlob, MalformedPatch> {
        match self.byte()? {
            ABSENT => Ok(PatchBlob::Absent),
            AS_IN_BASE => Ok(PatchBlob::AsInBase),
            GIVEN => self.bytes().map(PatchBlob::Given),
            other => Err(MalformedPatch::Content(format!("a blob of kind {other}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FORMAT_VERSION;
    use overfly_core::pixels::Mask;

    fn tile(column: u32) -> TileId {
        TileId::new(5, column, 3).unwrap()
    }

    fn put(column: u32) -> TileRecord {
        let footprint = Footprint {
            tile: tile(column),
            content_hash: [7; 32],
            acquired: Some("2018-05-01".into()),
            valid_fraction: 0.1 + 0.2,
            horizontal_error_m: (column != 9).then_some(1.5),
            keypoints: 12,
            distinctiveness: 0.25,
            sources: "ab cd".into(),
            valid_outline: (column == 2).then(|| MaskOutline::new(&Mask::filled(64, 64, true))),
        };
        let (image, descriptors, cells) = (PatchBlob::Given(vec![1, 2, 3]), PatchBlob::AsInBase, PatchBlob::Absent);
        TileRecord::Put(Box::new(PutTile { footprint, image, descriptors, cells }))
    }

    fn bytes_of(records: &[TileRecord]) -> Vec<u8> {
        let mut bytes = Vec::new();
        records.iter().for_each(|r| r.write(&mut bytes, FORMAT_VERSION).unwrap());
        write_end(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn records_round_trip() {
        let tiles = [TileRecord::Gone(tile(1)), put(2), put(9)];
        let mut bytes = bytes_of(&tiles);
        InputsRecord::Gone(tile(1)).write(&mut bytes).unwrap();
        InputsRecord::Put(tile(4), [9; 32]).write(&mut bytes).unwrap();
        write_end(&mut bytes).unwrap();
        let mut records = Records::new(&bytes[..], FORMAT_VERSION);
        for expected in tiles {
            assert_eq!(records.tile().unwrap(), Some(expected));
        }
        assert_eq!(records.tile().unwrap(), None);
        assert_eq!(records.inputs().unwrap(), Some(InputsRecord::Gone(tile(1))));
        assert_eq!(records.inputs().unwrap(), Some(InputsRecord::Put(tile(4), [9; 32])));
        assert_eq!(records.inputs().unwrap(), None);
        assert!(records.is_at_end().unwrap());
    }

    #[test]
    fn rejects_truncated_unordered_and_oversized_records() {
        let bytes = bytes_of(&[put(2)]);
        for cut in 0..bytes.len() - 1 {
            let mut records = Records::new(&bytes[..cut], FORMAT_VERSION);
            assert!(matches!(records.tile(), Err(MalformedPatch::Content(_))), "{cut}");
        }
        let twice = bytes_of(&[put(2), put(2)]);
        let mut records = Records::new(&twice[..], FORMAT_VERSION);
        assert!(records.tile().unwrap().is_some());
        assert!(records.tile().is_err());
        let mut long = bytes;
        let at = long.len() - 10;
        long[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(Records::new(&long[..], FORMAT_VERSION).tile().is_err());
    }
}
