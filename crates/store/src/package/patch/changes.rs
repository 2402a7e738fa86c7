//! The differences between the tiles of two layers.

use crate::Footprint;
use overfly_core::tile::TileId;
use std::cmp::Ordering;

/// A tile that differs between two layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Only the new layer has the tile.
    Added(TileId),
    /// Both layers have the tile, with different footprints.
    Changed(TileId),
    /// Only the old layer has the tile.
    Removed(TileId),
}

/// Returns the differences between two lists of footprints, each in the order of tiles.
pub fn changes(old: &[Footprint], new: &[Footprint]) -> Vec<Change> {
    let (mut old, mut new) = (old.iter().peekable(), new.iter().peekable());
    let mut found = Vec::new();
    loop {
        let order = match (old.peek(), new.peek()) {
            (None, None) => return found,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(a), Some(b)) => a.tile.cmp(&b.tile),
        };
        let before = if order.is_le() { old.next() } else { None };
        let after = if order.is_ge() { new.next() } else { None };
        match (before, after) {
            (Some(a), None) => found.push(Change::Removed(a.tile)),
            (None, Some(b)) => found.push(Change::Added(b.tile)),
            (Some(a), Some(b)) if a != b => found.push(Change::Changed(b.tile)),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(column: u32, keypoints: u32) -> Footprint {
        Footprint {
            tile: TileId::new(8, column, 5).unwrap(),
            content_hash: [1; 32],
            acquired: None,
            valid_fraction: 1.0,
            horizontal_error_m: Some(1.0),
            keypoints,
            distinctiveness: 0.0,
            sources: String::new(),
            valid_outline: None,
        }
    }

    #[test]
    fn finds_added_changed_and_removed_tiles() {
        let old = [1, 2, 4, 7].map(|c| footprint(c, 3));
        let new = [footprint(0, 3), footprint(2, 3), footprint(4, 5), footprint(9, 3)];
        let tile = |c| TileId::new(8, c, 5).unwrap();
        let expected = [
            Change::Added(tile(0)),
            Change::Removed(tile(1)),
            Change::Changed(tile(4)),
            Change::Removed(tile(7)),
            Change::Added(tile(9)),
        ];
        assert_eq!(changes(&old, &new), expected);
        assert_eq!(changes(&old, &old), []);
    }
}
