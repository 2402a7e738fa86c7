//! `HeightGrid`: the heights of the ground on pixels of one zoom.

use super::WorldPixel;

/// Heights of the ground above the zero of its datum, a value at the centre of each pixel of a window of the world at one zoom. Columns
/// may run past the antimeridian.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightGrid {
    zoom: u8,
    left: i64,
    top: i64,
    width_px: usize,
    /// Metres, row by row; NaN where unknown.
    heights_m: Vec<f32>,
}

impl HeightGrid {
    /// Makes a grid of unknown heights whose upper-left pixel is `corner` of the world at `zoom`.
    pub fn unknown(zoom: u8, [left, top]: [i64; 2], [width_px, height_px]: [usize; 2]) -> Self {
        Self { zoom, left, top, width_px, heights_m: vec![f32::NAN; width_px * height_px] }
    }

    /// Zoom of the pixels.
    pub fn zoom(&self) -> u8 {
        self.zoom
    }

    /// Columns and rows.
    pub fn size_px(&self) -> [usize; 2] {
        [self.width_px, self.heights_m.len() / self.width_px.max(1)]
    }

    /// The heights, metres, row by row; NaN where unknown.
    pub fn heights_m(&self) -> &[f32] {
        &self.heights_m
    }

    /// Copies the part of another grid of the same zoom that lies within this one, when that lies `columns` further east.
    pub fn paste_shifted(&mut self, other: &Self, columns: i64) {
        let [width, height] = self.size_px().map(|n| n as i64);
        let [other_width, other_height] = other.size_px().map(|n| n as i64);
        let (dx, dy) = (other.left + columns - self.left, other.top - self.top);
        let (x0, x1) = (dx.max(0), (dx + other_width).min(width));
        if x0 >= x1 {
            return;
        }
        for y in dy.max(0)..(dy + other_height).min(height) {
            let from = ((y - dy) * other_width + x0 - dx) as usize;
            let (to, count) = ((y * width + x0) as usize, (x1 - x0) as usize);
            self.heights_m[to..to + count].copy_from_slice(&other.heights_m[from..from + count]);
        }
    }

    /// Makes a grid of heights, metres, row by row, NaN where unknown; `None` where their number is not that of the pixels.
    pub fn from_heights(zoom: u8, [left, top]: [i64; 2], width_px: usize, heights_m: Vec<f32>) -> Option<Self> {
        let is_whole = width_px > 0 && heights_m.len().is_multiple_of(width_px);
        is_whole.then_some(Self { zoom, left, top, width_px, heights_m })
    }

    /// The grid at a zoom that is `levels` coarser: the mean of each block of pixels, unknown where less than half of it is known. The corner
    /// and the size are multiples of the block, as those of a tile are.
    pub fn shrunk(&self, levels: u8) -> Self {
        let block = 1usize << levels;
        let [width, height] = self.size_px().map(|n| n >> levels);
        let mean = |i: usize| {
            let (left, top) = (i % width * block, i / width * block);
            let rows = (top..top + block).map(|y| &self.heights_m[y * self.width_px + left..][..block]);
            let known = rows.flatten().filter(|height| height.is_finite()).map(|height| f64::from(*height));
            let (sum, count) = known.fold((0.0, 0), |(sum, count), height| (sum + height, count + 1));
            if 2 * count < block * block { f32::NAN } else { (sum / f64::from(count as u32)) as f32 }
        };
        Self {
            zoom: self.zoom - levels,
            left: self.left >> levels,
            top: self.top >> levels,
            width_px: width,
            heights_m: (0..width * height).map(mean).collect(),
        }
    }

    /// The height at a point of the world at any zoom, metres, bilinear between pixel centres; `None` where one of the four around is
    /// unknown or outside.
    pub fn at(&self, point: WorldPixel, zoom: u8) -> Option<f64> {
        let factor = 2f64.powi(i32::from(self.zoom) - i32::from(zoom));
        self.at_offset([point.x_px * factor - self.left as f64, point.y_px * factor - self.top as f64])
    }

    /// As [`HeightGrid::at`], for a position in pixels right of and below the grid's corner.
    pub fn at_offset(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let [width, height] = self.size_px();
        let (x, y) = (x - 0.5, y - 0.5);
        let is_inside = x >= 0.0 && y >= 0.0 && x <= width as f64 - 1.0 && y <= height as f64 - 1.0;
        if !is_inside || width < 2 || height < 2 {
            return None;
        }
        let (i, j) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
        let (right, down) = (x - i as f64, y - j as f64);
        let row = |j: usize| {
            let [a, b] = [self.heights_m[j * width + i], self.heights_m[j * width + i + 1]].map(f64::from);
            a + (b - a) * right
        };
        let (above, below) = (row(j), row(j + 1));
        let height_m = above + (below - above) * down;
        height_m.is_finite().then_some(height_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> HeightGrid {
        let heights = (0..6 * 5).map(|i| (100 + 10 * (i % 6) + i / 6) as f32).collect();
        HeightGrid::from_heights(12, [1000, 2000], 6, heights).unwrap()
    }

    #[test]
    fn heights_of_a_plane_are_linear_between_pixel_centres_at_any_zoom() {
        let grid = plane();
        for (x, y) in [(1000.5, 2000.5), (1002.25, 2003.75), (1005.5, 2004.5)] {
            let expected = 100.0 + 10.0 * (x - 1000.5) + (y - 2000.5);
            let same = grid.at(WorldPixel { x_px: x, y_px: y }, 12).unwrap();
            let finer = grid.at(WorldPixel { x_px: x * 4.0, y_px: y * 4.0 }, 14).unwrap();
            assert!((same - expected).abs() < 1e-4 && (finer - expected).abs() < 1e-4, "{x} {y}: {same} {finer}");
        }
    }

    #[test]
    fn a_height_beside_an_unknown_one_or_beyond_the_edge_is_unknown() {
        let mut grid = plane();
        grid.heights_m[2 * 6 + 3] = f32::NAN;
        let at = |x: f64, y: f64| grid.at_offset([x, y]);
        assert!(at(3.5, 2.5).is_none() && at(3.0, 2.0).is_none() && at(1.5, 1.5).is_some());
        assert!(at(0.4, 2.0).is_none() && at(2.0, 4.6).is_none() && at(f64::NAN, 1.0).is_none());
    }

    #[test]
    fn a_plane_shrunk_is_the_same_plane_and_a_gap_counts_by_its_share() {
        let heights = (0..8 * 8).map(|i| (10 * (i % 8) + i / 8) as f32).collect();
        let mut grid = HeightGrid::from_heights(12, [-16, 800], 8, heights).unwrap();
        for hole in [0, 1, 8, 9, 2] {
            grid.heights_m[hole] = f32::NAN;
        }
        let half = grid.shrunk(1);
        assert_eq!((half.zoom(), half.size_px()), (11, [4, 4]));
        assert!(half.heights_m()[0].is_nan() && half.heights_m()[1] > 20.0);
        let at = WorldPixel { x_px: -12.0, y_px: 806.0 };
        assert_eq!((half.at(at, 12), grid.shrunk(2).at_offset([1.5, 1.5])), (grid.at(at, 12), Some(55.0 + 5.5)));
    }

    #[test]
    fn pasting_copies_what_lies_within() {
        let mut window = HeightGrid::unknown(12, [998, 2003], [4, 4]);
        window.paste_shifted(&plane(), 0);
        assert_eq!(window.heights_m()[2], 103.0);
        assert_eq!(window.heights_m()[4 + 3], 114.0);
        assert!(window.heights_m()[..2].iter().chain(&window.heights_m()[8..]).all(|h| h.is_nan()));
        window.paste_shifted(&plane(), 1 << 20);
        assert_eq!(window.heights_m()[2], 103.0);
    }
}
