//! Making an overview tile from the four tiles below it: each pixel is the mean of the valid ones of two by two.

use super::composite::TileFailure;
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use overfly_store::{
    Child, EncodedTile, StoreError, TileContent, cells_blob, content_hash, decode, encode, larger_error, outline_of,
};

/// The least number of valid pixels, of four, that make a valid pixel: half.
const ENOUGH: u32 = 2;

/// Returns the content of an overview; `None` where no pixel below is valid. Children are in the order of
/// `TileId::children`.
///
/// # Errors
/// Where a child cannot be decoded, or the tile cannot be encoded.
pub fn shrink(tile: TileId, children: &[Option<Child>; 4]) -> Result<Option<TileContent>, TileFailure> {
    let size = TILE_SIZE_PX as usize;
    let mut pixels = MaskedColour { colour: Colour::black(size, size), mask: Mask::filled(size, size, false) };
    for (index, child) in children.iter().enumerate() {
        let Some(child) = child else { continue };
        let decoded = decode(&child.image)
            .map_err(|reason| TileFailure::Store(StoreError::Encode { tile, reason: format!("a child: {reason}") }))?;
        halve_into(&mut pixels, &decoded, (index % 2 * size / 2, index / 2 * size / 2));
    }
    if pixels.mask.values().iter().all(|&v| v == 0) {
        return Ok(None);
    }
    let below = || children.iter().flatten();
    let (media_type, bytes) = encode(tile, &pixels).map_err(TileFailure::Store)?;
    let cells = cells_blob(&pixels);
    let image = EncodedTile { media_type, content_hash: content_hash(media_type, &bytes, &[], Some(&cells)), bytes };
    Ok(Some(TileContent {
        image,
        descriptors: None,
        cells: Some(cells),
        sources: union(below().map(|c| c.sources.as_str())),
        acquired: below().filter_map(|c| c.acquired.clone()).max(),
        valid_fraction: pixels.mask.valid_fraction(),
        horizontal_error_m: below().map(|c| c.horizontal_error_m).reduce(larger_error).flatten(),
        valid_outline: outline_of(&pixels.mask),
        keypoints: 0,
        distinctiveness: 0.0,
    }))
}

/// Writes `from` at half its size into `into`, with its upper-left corner at `corner`.
fn halve_into(into: &mut MaskedColour, from: &MaskedColour, corner: (usize, usize)) {
    let (width, height) = (from.mask.width_px() / 2, from.mask.height_px() / 2);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0u32; 3];
            let mut valid = 0;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = (2 * x + dx, 2 * y + dy);
                if from.mask.at(x, y) {
                    valid += 1;
                    let rgb = from.colour.at(x, y);
                    (0..3).for_each(|c| sum[c] += u32::from(rgb[c]));
                }
            }
            if valid >= ENOUGH {
                into.colour.set(corner.0 + x, corner.1 + y, sum.map(|s| ((s + valid / 2) / valid) as u8));
                into.mask.set(corner.0 + x, corner.1 + y, true);
            }
        }
    }
}

/// Returns the words of several lists, each once, in the order of their first occurrence.
fn union<'a>(lists: impl Iterator<Item = &'a str>) -> String {
    let mut words: Vec<&str> = Vec::new();
    for word in lists.flat_map(|list| list.split(' ')) {
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_valid_pixels_only() {
        let mut from = MaskedColour {
            colour: Colour::from_values(4, 2, (0..8).flat_map(|i| [i * 10; 3]).collect()).unwrap(),
            mask: Mask::filled(4, 2, true),
        };
        from.mask.set(0, 0, false);
        from.mask.set(2, 0, false);
        from.mask.set(3, 0, false);
        from.mask.set(2, 1, false);
        let mut into = MaskedColour { colour: Colour::black(4, 4), mask: Mask::filled(4, 4, false) };
        halve_into(&mut into, &from, (2, 1));
        // 10, 40, 50 of values 0 10 20 30 / 40 50 60 70; of the other four only one is valid.
        assert_eq!(into.colour.at(2, 1), [33; 3]);
        assert!(into.mask.at(2, 1) && !into.mask.at(3, 1) && !into.mask.at(0, 0));
    }

    #[test]
    fn names_each_source_once() {
        assert_eq!(union(["b a", "a", "c b"].into_iter()), "b a c");
    }
}
