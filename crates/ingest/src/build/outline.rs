//! `Outline`: a source's edge in the plane of the tile matrix, and the tiles that it meets.

use overfly_core::geodesy::{GeodesyError, Geodetic};
use overfly_core::tile::{TILE_SIZE_PX, TileId, WorldPixel};

/// Tiles are widened by this margin: edges of the outline are straight here and may be curved in truth.
const MARGIN_PX: f64 = 4.0;

/// A closed polygon in tile units of one zoom: x counts columns, y rows. x exceeds the world's edge where the source crosses
/// the antimeridian.
#[derive(Debug, Clone)]
pub struct Outline {
    zoom: u8,
    points: Vec<[f64; 2]>,
}

impl Outline {
    /// Makes an outline from points of longitude and latitude in degrees, not closed.
    ///
    /// # Errors
    /// [`GeodesyError`] where a point lies beyond 85.05 degrees of latitude.
    pub fn new(outline_deg: &[[f64; 2]], zoom: u8) -> Result<Self, GeodesyError> {
        let size = f64::from(1u32 << zoom);
        let mut points: Vec<[f64; 2]> = Vec::with_capacity(outline_deg.len());
        for [longitude_deg, latitude_deg] in outline_deg {
            let pixel = WorldPixel::from_geodetic(Geodetic::from_degrees(*latitude_deg, *longitude_deg)?, zoom)?;
            let (mut x, y) = (pixel.x_px / f64::from(TILE_SIZE_PX), pixel.y_px / f64::from(TILE_SIZE_PX));
            if let Some(previous) = points.last() {
                // Unwrapped: neighbouring points are less than half a world apart.
                x += ((previous[0] - x) / size).round() * size;
            }
            points.push([x, y]);
        }
        Ok(Self { zoom, points })
    }

    /// Returns the number of tiles in the outline's extent, an upper bound of [`Outline::tiles`].
    pub fn extent_tiles(&self) -> f64 {
        let [min, max] = self.extent();
        (max[0].floor() - min[0].floor() + 1.0) * (max[1].floor() - min[1].floor() + 1.0)
    }

    /// Returns every tile that the outline meets, each tile widened by a few pixels.
    pub fn tiles(&self) -> Vec<TileId> {
        let [min, max] = self.extent();
        let size = 1i64 << self.zoom;
        let rows = (min[1].floor() as i64).max(0)..=(max[1].floor() as i64).min(size - 1);
        let mut tiles = Vec::new();
        for row in rows {
            for column in min[0].floor() as i64..=max[0].floor() as i64 {
                if self.meets([column as f64, row as f64]) {
                    let wrapped = column.rem_euclid(size) as u32;
                    tiles.push(TileId::new(self.zoom, wrapped, row as u32).expect("wrapped into the matrix"));
                }
            }
        }
        tiles.sort();
        tiles.dedup();
        tiles
    }

    fn extent(&self) -> [[f64; 2]; 2] {
        let margin = MARGIN_PX / f64::from(TILE_SIZE_PX);
        let fold =
            |axis: usize, start: f64, pick: fn(f64, f64) -> f64| self.points.iter().map(|p| p[axis]).fold(start, pick);
        [
            [fold(0, f64::INFINITY, f64::min) - margin, fold(1, f64::INFINITY, f64::min) - margin],
            [fold(0, f64::NEG_INFINITY, f64::max) + margin, fold(1, f64::NEG_INFINITY, f64::max) + margin],
        ]
    }

    /// Whether the outline meets the widened unit square with the given upper-left corner.
    fn meets(&self, corner: [f64; 2]) -> bool {
        let margin = MARGIN_PX / f64::from(TILE_SIZE_PX);
        let low = [corner[0] - margin, corner[1] - margin];
        let high = [corner[0] + 1.0 + margin, corner[1] + 1.0 + margin];
        let edges = || self.points.iter().zip(self.points.iter().cycle().skip(1));
        if edges().any(|(a, b)| segment_meets_box(*a, *b, low, high)) {
            return true;
        }
        // No edge crosses the square, so the square lies wholly inside or wholly outside.
        let centre = [corner[0] + 0.5, corner[1] + 0.5];
        edges().filter(|(a, b)| crosses_ray(**a, **b, centre)).count() % 2 == 1
    }
}

/// Whether a segment meets a box, by the clipping algorithm of Liang and Barsky.
fn segment_meets_box(a: [f64; 2], b: [f64; 2], low: [f64; 2], high: [f64; 2]) -> bool {
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let step = b[axis] - a[axis];
        if step == 0.0 {
            if a[axis] < low[axis] || a[axis] > high[axis] {
                return false;
            }
            continue;
        }
        let (t0, t1) = ((low[axis] - a[axis]) / step, (high[axis] - a[axis]) / step);
        enter = enter.max(t0.min(t1));
        leave = leave.min(t0.max(t1));
    }
    enter <= leave
}

/// Whether a segment crosses the ray from a point towards positive x.
fn crosses_ray(a: [f64; 2], b: [f64; 2], from: [f64; 2]) -> bool {
    (a[1] > from[1]) != (b[1] > from[1]) && from[0] < a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(points: &[[f64; 2]]) -> Outline {
        Outline { zoom: 6, points: points.to_vec() }
    }

    fn names(outline: &Outline) -> Vec<(u32, u32)> {
        outline.tiles().iter().map(|t| (t.column(), t.row())).collect()
    }

    #[test]
    fn meets_tiles_that_it_crosses_encloses_or_lies_in() {
        assert_eq!(names(&outline(&[[3.2, 3.2], [3.8, 3.2], [3.5, 3.8]])), [(3, 3)]);
        assert_eq!(outline(&[[3.5, 3.5], [7.5, 3.5], [7.5, 7.5], [3.5, 7.5]]).tiles().len(), 25);
        let diamond = outline(&[[10.5, 5.2], [15.8, 10.5], [10.5, 15.8], [5.2, 10.5]]);
        assert!(
            diamond.tiles().len() < 100 && names(&diamond).contains(&(10, 10)) && !names(&diamond).contains(&(5, 5))
        );
    }

    #[test]
    fn a_thin_edge_within_the_margin_counts() {
        assert_eq!(names(&outline(&[[3.2, 3.2], [3.999, 3.2], [3.5, 3.8]])), [(3, 3), (4, 3)]);
    }

    #[test]
    fn wraps_at_the_antimeridian() {
        let across = Outline::new(&[[179.0, 1.0], [-179.0, 1.0], [-179.0, -1.0], [179.0, -1.0]], 6).unwrap();
        let columns: Vec<_> = across.tiles().iter().map(|t| t.column()).collect();
        assert!(columns.contains(&0) && columns.contains(&63) && columns.len() == 4, "{columns:?}");
    }

    #[test]
    fn refuses_the_poles() {
        assert!(Outline::new(&[[0.0, 84.0], [1.0, 84.0], [1.0, 86.0]], 6).is_err());
    }
}
