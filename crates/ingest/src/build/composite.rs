//! Composing a base tile from the sources that meet it: the first source covers, the next ones fill its invalid pixels.

use super::recipe::KEYPOINTS_PER_TILE;
use super::source_pool::SourcePool;
use crate::raster::RasterError;
use overfly_core::feature::keypoint;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use overfly_store::{Source, StoreError, TileContent};

/// Why a tile cannot be made.
#[derive(Debug)]
pub enum TileFailure {
    /// A source cannot be read.
    Source {
        /// The source's index.
        index: usize,
        /// Why.
        error: RasterError,
    },
    /// The tile cannot be encoded, or a tile below it cannot be decoded.
    Store(StoreError),
}

/// Returns the content of a tile; `None` where no source has a valid pixel in it. `indices` are the sources that meet the
/// tile, in covering order.
///
/// # Errors
/// Where a source cannot be read, or the tile cannot be encoded.
pub fn compose(tile: TileId, indices: &[usize], pool: &SourcePool) -> Result<Option<TileContent>, TileFailure> {
    let mut seen: Vec<&Source> = Vec::new();
    let mut pixels: Option<MaskedColour> = None;
    for &index in indices {
        let fail = |error| TileFailure::Source { index, error };
        let Some(below) = pool.warp(index, tile).map_err(fail)? else { continue };
        let contributes = match &mut pixels {
            None => below.mask.values().iter().any(|&v| v != 0),
            Some(above) => fill(above, &below),
        };
        if contributes {
            seen.push(pool.source(index));
            pixels.get_or_insert(below);
        }
        if pixels.as_ref().is_some_and(|p| p.mask.is_full()) {
            break;
        }
    }
    let Some(pixels) = pixels else { return Ok(None) };
    if pool.holds_heights() {
        return TileContent::encode_heights(tile, &pixels, &seen).map(Some).map_err(TileFailure::Store);
    }
    let keypoints = keypoint::describe(&pixels.colour.to_gray(), &pixels.mask, KEYPOINTS_PER_TILE);
    TileContent::encode(tile, &pixels, &seen, Some(&keypoints)).map(Some).map_err(TileFailure::Store)
}

/// Fills the invalid pixels of `above` from `below`; true where any pixel was filled.
pub fn fill(above: &mut MaskedColour, below: &MaskedColour) -> bool {
    let width = above.mask.width_px();
    let mut filled = false;
    for index in 0..above.mask.values().len() {
        if above.mask.values()[index] == 0 && below.mask.values()[index] != 0 {
            let (x, y) = (index % width, index / width);
            above.colour.set(x, y, below.colour.at(x, y));
            above.mask.set(x, y, true);
            filled = true;
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::pixels::{Colour, Mask};

    #[test]
    fn fills_invalid_pixels_only() {
        let flat = |value: u8| MaskedColour {
            colour: Colour::from_values(2, 1, vec![value; 6]).unwrap(),
            mask: Mask::filled(2, 1, true),
        };
        let mut above = flat(10);
        above.mask.set(1, 0, false);
        assert!(fill(&mut above, &flat(20)));
        assert_eq!((above.colour.at(0, 0), above.colour.at(1, 0)), ([10; 3], [20; 3]));
        assert!(above.mask.is_full());
        assert!(!fill(&mut above, &flat(30)));
    }
}
