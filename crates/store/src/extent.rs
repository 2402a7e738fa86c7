//! The extent of a layer, from its tiles.

use overfly_core::geodesy::{GeodeticBounds, WORLD_M};
use overfly_core::tile::{MercatorBounds, TileId};

/// Returns the extent of tiles of one zoom: in the projection (the whole width if it crosses the antimeridian), and in degrees
/// (west, south, east, north; west exceeds east if it crosses the antimeridian).
pub fn extent(tiles: &[TileId]) -> (MercatorBounds, GeodeticBounds) {
    let half_m = WORLD_M / 2.0;
    let Some(first) = tiles.first() else {
        let world = MercatorBounds { min_x_m: -half_m, min_y_m: -half_m, max_x_m: half_m, max_y_m: half_m };
        return (world, [0.0; 4].into());
    };
    let union = tiles.iter().map(|t| t.mercator_bounds()).fold(first.mercator_bounds(), |a, b| MercatorBounds {
        min_x_m: a.min_x_m.min(b.min_x_m),
        min_y_m: a.min_y_m.min(b.min_y_m),
        max_x_m: a.max_x_m.max(b.max_x_m),
        max_y_m: a.max_y_m.max(b.max_y_m),
    });
    let south_deg = tiles.iter().map(|t| t.bounds().south_deg).fold(f64::INFINITY, f64::min);
    let north_deg = tiles.iter().map(|t| t.bounds().north_deg).fold(f64::NEG_INFINITY, f64::max);
    let mut columns: Vec<u32> = tiles.iter().map(|t| t.column()).collect();
    columns.sort_unstable();
    columns.dedup();
    // The widest gap between neighbouring columns lies outside the extent. It starts as the gap from the last column to the first.
    let size = 1u32 << first.zoom();
    let (mut west, mut east) = (columns[0], columns[columns.len() - 1]);
    let mut widest = size - 1 - (east - west);
    for pair in columns.windows(2) {
        if pair[1] - pair[0] - 1 > widest {
            widest = pair[1] - pair[0] - 1;
            (west, east) = (pair[1], pair[0]);
        }
    }
    let longitude = |column: u32| f64::from(column) / f64::from(size) * 360.0 - 180.0;
    (union, GeodeticBounds { west_deg: longitude(west), south_deg, east_deg: longitude(east + 1), north_deg })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extent_across_the_antimeridian_has_west_above_east() {
        let tile = |column| TileId::new(4, column, 7).unwrap();
        let (_, plain) = extent(&[tile(3), tile(4)]);
        assert_eq!((plain.west_deg, plain.east_deg), (-112.5, -67.5));
        let (bounds, across) = extent(&[tile(15), tile(0)]);
        assert_eq!((across.west_deg, across.east_deg), (157.5, -157.5));
        assert!((bounds.max_x_m - bounds.min_x_m - WORLD_M).abs() < 1.0);
    }
}
