//! `render`: the frame seen from above, north up, on a grid of the ground.

use super::Camera;
use crate::pixels::{Gray, Mask};

/// A north-up grid of ground pixels around the nadir.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundGrid {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Where the nadir lies, pixels from the grid's upper-left corner (may be outside).
    pub nadir_px: [f64; 2],
    /// Ground metres per pixel towards east and north.
    pub gsd_m_per_px: [f64; 2],
}

/// A frame on a ground grid, and which pixels of it the frame covers.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundView {
    /// Brightness as the frame's.
    pub gray: Gray,
    /// Covered by the frame.
    pub mask: Mask,
    /// Where and how large the pixels are.
    pub grid: GroundGrid,
}

/// How often the exact camera model is evaluated; between, the position in the frame is interpolated bilinearly. Over
/// 8 px of a view that is as sharp as the frame the error stays below 0.01 px for lenses and tilts in use.
const KNOT_PX: usize = 8;

impl GroundGrid {
    /// The smallest grid of these pixels that holds the frame's footprint under a heading, with `margin_px` around;
    /// `None` where the frame sees the horizon.
    pub fn around(camera: &Camera, heading_rad: f64, gsd_m_per_px: [f64; 2], margin_px: f64) -> Option<Self> {
        let corners = camera.footprint_in_level()?.map(|p| east_north(p, heading_rad));
        let extreme = |axis: usize, pick: fn(f64, f64) -> f64| {
            corners.iter().map(|c| c[axis]).reduce(pick).expect("a footprint has four corners")
        };
        let left = (extreme(0, f64::min) / gsd_m_per_px[0] - margin_px).floor();
        let right = (extreme(0, f64::max) / gsd_m_per_px[0] + margin_px).ceil();
        let top = (-extreme(1, f64::max) / gsd_m_per_px[1] - margin_px).floor();
        let bottom = (-extreme(1, f64::min) / gsd_m_per_px[1] + margin_px).ceil();
        Some(Self {
            width_px: (right - left) as usize,
            height_px: (bottom - top) as usize,
            nadir_px: [-left, -top],
            gsd_m_per_px,
        })
    }

    /// Metres east and north of the nadir at a position of the grid, pixels.
    pub fn enu_from_grid(&self, position_px: [f64; 2]) -> [f64; 2] {
        [
            (position_px[0] - self.nadir_px[0]) * self.gsd_m_per_px[0],
            (self.nadir_px[1] - position_px[1]) * self.gsd_m_per_px[1],
        ]
    }
}

/// The frame on a grid under a heading (radians clockwise from north of the image's upper edge). The frame should
/// be about as sharp as the grid: sampling is bilinear and does not average. Pixels whose sample would reach beyond
/// the frame's edge are masked.
pub fn render(frame: &Gray, camera: &Camera, heading_rad: f64, grid: &GroundGrid) -> GroundView {
    let (width, height) = (grid.width_px, grid.height_px);
    let mut gray = Gray::filled(width, height, 0.0);
    let mut mask = Mask::filled(width, height, false);
    let knots = Knots::new(camera, heading_rad, grid);
    let mut line = vec![[0f32; 2]; knots.columns];
    let mut row = Row::new(width);
    for y in 0..height {
        knots.line(y, &mut line);
        place_row(&line, [frame.width_px(), frame.height_px()], &mut row);
        let span = y * width..(y + 1) * width;
        sample_row(frame, &row, &mut gray.values_mut()[span.clone()], &mut mask.values_mut()[span]);
    }
    GroundView { gray, mask, grid: *grid }
}

/// Of each pixel of a row: the frame's pixel to its upper left (`OUTSIDE` where the frame does not cover it) and how far
/// on towards the next, in [0, 1].
struct Row {
    columns: Vec<u32>,
    rows: Vec<u32>,
    right: Vec<f32>,
    down: Vec<f32>,
}

const OUTSIDE: u32 = u32::MAX;

impl Row {
    fn new(width: usize) -> Self {
        Self { columns: vec![0; width], rows: vec![0; width], right: vec![0.0; width], down: vec![0.0; width] }
    }
}

/// Where a row's pixels lie in a frame of `size_px`, between the knots of its line.
fn place_row(line: &[[f32; 2]], size_px: [usize; 2], row: &mut Row) {
    let fractions: [f32; KNOT_PX] = std::array::from_fn(|i| i as f32 / KNOT_PX as f32);
    let most = size_px.map(|n| n as f32 - 1.0);
    // A sample on the very last pixel is taken from the one before it.
    let last = size_px.map(|n| n.saturating_sub(2) as u32);
    let cells = row.columns.chunks_mut(KNOT_PX).zip(row.rows.chunks_mut(KNOT_PX));
    let cells = cells.zip(row.right.chunks_mut(KNOT_PX).zip(row.down.chunks_mut(KNOT_PX)));
    for (((columns, rows), (right, down)), knots) in cells.zip(line.windows(2)) {
        for i in 0..columns.len() {
            let at = |axis: usize| knots[0][axis] + (knots[1][axis] - knots[0][axis]) * fractions[i] - 0.5;
            let (x, y) = (at(0), at(1));
            let inside = x >= 0.0 && y >= 0.0 && x <= most[0] && y <= most[1];
            let (column, down_to) = ((x as u32).min(last[0]), (y as u32).min(last[1]));
            columns[i] = if inside { column } else { OUTSIDE };
            rows[i] = down_to;
            (right[i], down[i]) = (x - column as f32, y - down_to as f32);
        }
    }
}

/// Bilinear samples of the pixels that the frame covers; the others stay as they are.
fn sample_row(frame: &Gray, row: &Row, out: &mut [f32], mask: &mut [u8]) {
    let (width, values) = (frame.width_px(), frame.values());
    let (right_px, below_px) = (usize::from(width > 1), if frame.height_px() > 1 { width } else { 0 });
    for (x, (out, mask)) in out.iter_mut().zip(mask).enumerate() {
        if row.columns[x] == OUTSIDE {
            continue;
        }
        let at = row.rows[x] as usize * width + row.columns[x] as usize;
        let (top, bottom) = (&values[at..], &values[at + below_px..]);
        let a = top[0] + (top[right_px] - top[0]) * row.right[x];
        let b = bottom[0] + (bottom[right_px] - bottom[0]) * row.right[x];
        *out = a + (b - a) * row.down[x];
        *mask = 255;
    }
}

/// Frame positions at every `KNOT_PX`-th grid pixel centre; NaN where the camera does not see.
struct Knots {
    columns: usize,
    positions: Vec<[f32; 2]>,
}

impl Knots {
    fn new(camera: &Camera, heading_rad: f64, grid: &GroundGrid) -> Self {
        let columns = grid.width_px / KNOT_PX + 2;
        let rows = grid.height_px / KNOT_PX + 2;
        let (sin, cos) = heading_rad.sin_cos();
        let mut positions = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let centre = [(i * KNOT_PX) as f64 + 0.5, (j * KNOT_PX) as f64 + 0.5];
                let [east_m, north_m] = grid.enu_from_grid(centre);
                let (right_m, ahead_m) = (east_m * cos - north_m * sin, east_m * sin + north_m * cos);
                let seen = camera.frame_from_level(right_m, ahead_m);
                positions.push(seen.map_or([f32::NAN; 2], |p| [p[0] as f32, p[1] as f32]));
            }
        }
        Self { columns, positions }
    }

    /// The knots' positions on a row of pixels between two rows of knots.
    fn line(&self, y: usize, line: &mut [[f32; 2]]) {
        let (j, fraction) = (y / KNOT_PX, (y % KNOT_PX) as f32 / KNOT_PX as f32);
        let (above, below) = (&self.positions[j * self.columns..], &self.positions[(j + 1) * self.columns..]);
        for ((out, above), below) in line.iter_mut().zip(above).zip(below) {
            *out = std::array::from_fn(|axis| above[axis] + (below[axis] - above[axis]) * fraction);
        }
    }
}

/// Right and ahead to east and north.
fn east_north(level: [f64; 2], heading_rad: f64) -> [f64; 2] {
    let (sin, cos) = heading_rad.sin_cos();
    [level[0] * cos + level[1] * sin, level[1] * cos - level[0] * sin]
}

#[cfg(test)]
mod tests {
    use super::super::View;
    use super::*;

    #[test]
    fn heading_east_puts_the_upper_edge_to_the_east() {
        let mut frame = Gray::filled(64, 48, 10.0);
        for y in 0..4 {
            for x in 0..64 {
                frame.values_mut()[y * 64 + x] = 200.0;
            }
        }
        let camera = Camera::new(&View::Nadir { gsd_m_per_px: 2.0 }, 64, 48).unwrap();
        let heading_rad = 90f64.to_radians();
        let grid = GroundGrid::around(&camera, heading_rad, [2.0, 2.0], 0.0).unwrap();
        assert!(grid.width_px.abs_diff(48) <= 2 && grid.height_px.abs_diff(64) <= 2);
        let view = render(&frame, &camera, heading_rad, &grid);
        assert!(view.gray.at(46, 32) > 150.0 && view.gray.at(10, 32) < 20.0);
    }

    #[test]
    fn nothing_beyond_the_frame_is_marked_valid() {
        let frame = Gray::filled(64, 48, 10.0);
        let camera = Camera::new(&View::Nadir { gsd_m_per_px: 1.0 }, 64, 48).unwrap();
        let grid = GroundGrid::around(&camera, 0.6, [1.0, 1.0], 3.0).unwrap();
        let view = render(&frame, &camera, 0.6, &grid);
        let share = view.mask.valid_fraction() * (grid.width_px * grid.height_px) as f64 / (64.0 * 48.0);
        assert!(share > 0.93 && share <= 1.0, "{share}");
    }
}
