//! What a patch says of itself, at its beginning: JSON.

use super::Malformed;
use crate::package::{SEAL_LEN, Seal};
use crate::{LayerHead, PATCH_MAGIC, Source, check_name, hex};
use overfly_core::tile::TileId;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// Longest header: the sources of some ten thousand orthophotos.
const MOST_BYTES: u64 = 256 << 20;

/// What a patch is for and what it makes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchHeader {
    /// Version of the store's format.
    pub store_format: u32,
    /// What descriptors follow.
    pub descriptor_contract: String,
    /// Digest of the store that it may be applied to, hexadecimal.
    pub base: String,
    /// Digest of the store that it makes, hexadecimal.
    pub result: String,
    /// Of an exported store: what makes it one.
    pub sealed: Option<SealedResult>,
    /// The finished layers of the result, by name.
    pub layers: Vec<PatchLayer>,
}

/// Manifest and seal of an exported store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedResult {
    /// Its manifest's bytes.
    pub manifest: String,
    /// Its seal, hexadecimal.
    pub seal: String,
}

/// A layer of the result, but for its tiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchLayer {
    /// Name and levels.
    pub head: LayerHead,
    /// What it is made of.
    pub sources: Vec<Source>,
}

impl SealedResult {
    /// Of a manifest and its seal.
    pub fn of(manifest: &str, seal: &Seal) -> Self {
        Self { manifest: manifest.into(), seal: hex(&seal.to_bytes()) }
    }

    /// The seal; `None` where it is none.
    pub fn seal(&self) -> Option<Seal> {
        let bytes: [u8; SEAL_LEN] = bytes_of(&self.seal)?.try_into().ok()?;
        Seal::from_bytes(&bytes)
    }
}

fn check(head: &LayerHead) -> Result<(), Malformed> {
    let wrong = |reason: String| Malformed::Content(format!("its header: {reason}"));
    check_name(&head.name).map_err(|e| wrong(e.to_string()))?;
    TileId::new(head.base_zoom, 0, 0).map_err(|e| wrong(e.to_string()))?;
    if head.min_zoom > head.base_zoom {
        return Err(wrong(format!("layer {} has no level", head.name)));
    }
    Ok(())
}

/// The bytes that a hexadecimal text spells.
fn bytes_of(text: &str) -> Option<Vec<u8>> {
    let pairs = text.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()).collect()
}

impl PatchHeader {
    /// Writes it, its mark and length before it.
    ///
    /// # Errors
    /// As the writer.
    pub fn write(&self, to: &mut impl Write) -> std::io::Result<()> {
        let text = serde_json::to_vec(self).expect("a header serialises");
        to.write_all(PATCH_MAGIC)?;
        to.write_all(&(text.len() as u64).to_le_bytes())?;
        to.write_all(&text)
    }

    /// Reads it.
    ///
    /// # Errors
    /// Where these are not the first bytes of a patch, or as the reader.
    pub fn read(from: &mut impl Read) -> Result<Self, Malformed> {
        let (mut magic, mut length) = ([0; 16], [0; 8]);
        from.read_exact(&mut magic)?;
        if magic != *PATCH_MAGIC {
            return Err(Malformed::Content("it does not begin as a patch of this program does".into()));
        }
        from.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > MOST_BYTES {
            return Err(Malformed::Content(format!("a header of {length} bytes")));
        }
        let mut text = Vec::new();
        from.take(length).read_to_end(&mut text)?;
        let header: Self = serde_json::from_slice(&text).map_err(|e| {
            // What it does not know the parser repeats, however long.
            let reason: String = e.to_string().chars().take(200).collect();
            Malformed::Content(format!("its header: {reason}"))
        })?;
        header.layers.iter().map(|l| &l.head).try_for_each(check)?;
        if !header.layers.is_sorted_by(|a, b| a.head.name < b.head.name) {
            return Err(Malformed::Content("its header: layers stand out of order".into()));
        }
        Ok(header)
    }
}
