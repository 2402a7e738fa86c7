//! Blending a base tile from the tiles of several stores: the first covers, the next ones fill its invalid pixels.

use super::shard::Shard;
use crate::build::composite::fill;
use crate::build::recipe::KEYPOINTS_PER_TILE;
use overfly_core::feature::keypoint;
use overfly_core::tile::TileId;
use overfly_store::{Source, StoreError, StoredTile, TileContent, decode, decode_heights};

/// A blended tile.
pub struct BlendedTile {
    /// The tile.
    pub tile: StoredTile,
    /// Whether its pixels are those that a build of all sources would make, if no older source lies between newer ones: no
    /// pixel that it shows below the first tile was compressed with loss.
    pub exact: bool,
}

/// Blends the shards' tiles of imagery or of heights, the first one on top. A first tile without invalid pixels is taken unchanged.
///
/// # Errors
/// [`StoreError`] where a tile is damaged, or the new tile cannot be encoded.
pub fn blend(tile: TileId, holders: &[&Shard<'_>], heights: bool) -> Result<BlendedTile, StoreError> {
    let decode = if heights { decode_heights } else { decode };
    let top = holders[0].stored(tile)?;
    let undecoded = |reason| StoreError::Encode { tile, reason };
    let mut pixels = decode(&top.image).map_err(undecoded)?;
    let mut seen: Vec<&Source> = holders[0].seen(tile);
    let mut exact = true;
    let mut filled = false;
    for holder in &holders[1..] {
        if pixels.mask.is_full() {
            break;
        }
        let below = holder.stored(tile)?;
        if fill(&mut pixels, &decode(&below.image).map_err(undecoded)?) {
            filled = true;
            exact &= below.media_type == "image/png";
            let more: Vec<_> = holder
                .seen(tile)
                .into_iter()
                .filter(|s| seen.iter().all(|o| o.content_hash != s.content_hash))
                .collect();
            seen.extend(more);
        }
    }
    if !filled {
        return Ok(BlendedTile { tile: top, exact });
    }
    seen.sort_by(|a, b| a.covering_order(b));
    if heights {
        let content = TileContent::encode_heights(tile, &pixels, &seen)?;
        return Ok(BlendedTile { tile: StoredTile::from_content(tile, content), exact });
    }
    let keypoints = keypoint::describe(&pixels.colour.to_gray(), &pixels.mask, KEYPOINTS_PER_TILE);
    let content = TileContent::encode(tile, &pixels, &seen, Some(&keypoints))?;
    Ok(BlendedTile { tile: StoredTile::from_content(tile, content), exact })
}
