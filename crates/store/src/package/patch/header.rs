//! The header of a patch, as JSON.

use super::record::MalformedPatch;
use crate::layer::check_stored_name;
use crate::package::{SEAL_LEN, Seal};
use crate::{LayerHead, PATCH_MAGIC, Source, hex};
use overfly_core::tile::TileId;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// Largest header, bytes: the sources of about ten thousand orthophotos.
const MOST_BYTES: u64 = 256 << 20;

/// The store that a patch is for, and the store that it makes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchHeader {
    /// Format version of both stores.
    pub store_format: u32,
    /// Descriptor contract of both stores.
    pub descriptor_contract: String,
    /// Digest of the store that the patch is for, hexadecimal.
    pub base: String,
    /// Digest of the store that the patch makes, hexadecimal.
    pub result: String,
    /// Manifest and seal, if the result is an exported store.
    pub sealed: Option<SealedResult>,
    /// The finished layers of the result, by name.
    pub layers: Vec<PatchLayer>,
}

/// Manifest and seal of an exported store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedResult {
    /// The manifest as stored.
    pub manifest: String,
    /// The seal, hexadecimal.
    pub seal: String,
}

/// A layer of the result, without its tiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchLayer {
    /// Name and levels.
    pub head: LayerHead,
    /// Sources by content hash.
    pub sources: Vec<Source>,
}

impl SealedResult {
    /// Makes the header fields from a manifest and its seal.
    pub fn new(manifest: &str, seal: &Seal) -> Self {
        Self { manifest: manifest.into(), seal: hex(&seal.to_bytes()) }
    }

    /// Parses the seal: `None` if it is not valid.
    pub fn seal(&self) -> Option<Seal> {
        let bytes: [u8; SEAL_LEN] = bytes_from_hex(&self.seal)?.try_into().ok()?;
        Seal::from_bytes(&bytes)
    }
}

/// Checks name and levels of a layer.
fn check(head: &LayerHead) -> Result<(), MalformedPatch> {
    let wrong = |reason: String| MalformedPatch::Content(format!("its header: {reason}"));
    check_stored_name(&head.name).map_err(|e| wrong(e.to_string()))?;
    TileId::new(head.base_zoom, 0, 0).map_err(|e| wrong(e.to_string()))?;
    if head.min_zoom > head.base_zoom {
        return Err(wrong(format!("layer {} has no level", head.name)));
    }
    Ok(())
}

/// Parses hexadecimal text: `None` if it is not valid.
fn bytes_from_hex(text: &str) -> Option<Vec<u8>> {
    let pairs = text.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()).collect()
}

impl PatchHeader {
    /// Writes magic, length and header.
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn write(&self, to: &mut impl Write) -> std::io::Result<()> {
        let text = serde_json::to_vec(self).expect("a header serialises");
        to.write_all(PATCH_MAGIC)?;
        to.write_all(&(text.len() as u64).to_le_bytes())?;
        to.write_all(&text)
    }

    /// Reads magic, length and header.
    ///
    /// # Errors
    /// Where these are not the first bytes of a patch, or the reader fails.
    pub fn read(from: &mut impl Read) -> Result<Self, MalformedPatch> {
        let (mut magic, mut length) = ([0; 16], [0; 8]);
        from.read_exact(&mut magic)?;
        if magic != *PATCH_MAGIC {
            return Err(MalformedPatch::Content("it does not begin like a patch of this program".into()));
        }
        from.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > MOST_BYTES {
            return Err(MalformedPatch::Content(format!("a header of {length} bytes")));
        }
        let mut text = Vec::new();
        from.take(length).read_to_end(&mut text)?;
        let header: Self = serde_json::from_slice(&text).map_err(|e| {
            // The parser repeats unknown text, however long.
            let reason: String = e.to_string().chars().take(200).collect();
            MalformedPatch::Content(format!("its header: {reason}"))
        })?;
        header.layers.iter().map(|l| &l.head).try_for_each(check)?;
        if !header.layers.is_sorted_by(|a, b| a.head.name < b.head.name) {
            return Err(MalformedPatch::Content("its header: layers are out of order".into()));
        }
        Ok(header)
    }
}
