//! What a build hands over of one tile.

use super::footprint::Footprint;
use super::imagery::{self, EncodedTile};
use super::source::Source;
use super::{StoreError, digest};
use crate::feature::cells_of;
use crate::feature::keypoint::{self, Keypoints};
use crate::pixels::MaskedColour;
use crate::tile::TileId;

/// What a tile with pixels holds.
#[derive(Debug, Clone, PartialEq)]
pub struct TileContent {
    /// Its imagery, encoded.
    pub image: EncodedTile,
    /// Its keypoints, encoded; `None` for an overview.
    pub descriptors: Option<Vec<u8>>,
    /// Its cells (`feature::cells_of`) as bytes.
    pub cells: Vec<u8>,
    /// Content hashes of the sources seen in it, hexadecimal, newest first, separated by spaces.
    pub sources: String,
    /// Newest acquisition date seen in it.
    pub acquired: Option<String>,
    /// Share of valid pixels.
    pub valid_fraction: f64,
    /// The largest horizontal error of the sources seen in it, metres.
    pub horizontal_error_m: f64,
    /// Keypoints described.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
}

impl TileContent {
    /// Encodes a tile and hashes its content; `seen` are the sources seen in it, in covering order.
    ///
    /// # Errors
    /// Where the encoder refuses.
    pub fn encode(
        tile: TileId,
        pixels: &MaskedColour,
        seen: &[&Source],
        keypoints: Option<&Keypoints>,
    ) -> Result<Self, StoreError> {
        let (media_type, bytes) = imagery::encode(tile, pixels)?;
        let descriptors = keypoints.map(keypoint::to_blob);
        let cells = cells_blob(pixels);
        let described = descriptors.as_deref().unwrap_or_default();
        let content_hash = digest::content_hash(media_type, &bytes, described, Some(&cells));
        let hashes: Vec<_> = seen.iter().map(|s| digest::hex(&s.content_hash)).collect();
        Ok(Self {
            image: EncodedTile { media_type, bytes, content_hash },
            descriptors,
            cells,
            sources: hashes.join(" "),
            acquired: seen.iter().filter_map(|s| s.acquired.clone()).max(),
            valid_fraction: pixels.mask.valid_fraction(),
            horizontal_error_m: seen.iter().map(|s| s.horizontal_error_m).fold(0.0, f64::max),
            keypoints: keypoints.map_or(0, |k| k.points.len() as u32),
            distinctiveness: keypoints.map_or(0.0, keypoint::distinctiveness),
        })
    }

    /// The row that says all this of a tile.
    pub(super) fn footprint(&self, tile: TileId) -> Footprint {
        Footprint {
            tile,
            content_hash: self.image.content_hash,
            acquired: self.acquired.clone(),
            valid_fraction: self.valid_fraction,
            horizontal_error_m: self.horizontal_error_m,
            keypoints: self.keypoints,
            distinctiveness: self.distinctiveness,
            sources: self.sources.clone(),
        }
    }
}

/// A tile's cells as they are stored.
pub fn cells_blob(pixels: &MaskedColour) -> Vec<u8> {
    cells_of(&pixels.colour.to_gray(), &pixels.mask).into_iter().map(|v| v as u8).collect()
}

/// What an overview needs to know of a tile below it.
#[derive(Debug, Clone, PartialEq)]
pub struct Child {
    /// Its imagery's bytes.
    pub image: Vec<u8>,
    /// As [`TileContent::sources`].
    pub sources: String,
    /// As [`TileContent::acquired`].
    pub acquired: Option<String>,
    /// As [`TileContent::horizontal_error_m`].
    pub horizontal_error_m: f64,
}
