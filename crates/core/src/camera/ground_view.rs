//! `render`: resamples a frame onto a north-up grid of the ground.

use super::{Camera, Relief};
use crate::geodesy::{BodyFrame, Enu};
use crate::pixels::{Gray, Mask};

/// A north-up grid of ground pixels around the nadir.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundGrid {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Position of the nadir, pixels from the grid's upper-left corner; it may lie outside the grid.
    pub nadir_px: [f64; 2],
    /// Ground sample distance towards east and north, metres per pixel.
    pub gsd_m_per_px: [f64; 2],
}

/// A frame resampled onto a ground grid, and the mask of the pixels that the frame covers.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundView {
    /// Brightness, on the frame's scale.
    pub gray: Gray,
    /// Pixels that the frame covers.
    pub mask: Mask,
    /// Position and size of the pixels.
    pub grid: GroundGrid,
}

/// Distance between knots, the grid pixels at which the exact camera model is evaluated. Between knots the position in
/// the frame is interpolated bilinearly. Over 8 px of a view as sharp as the frame the error stays below 0.01 px for
/// lenses and tilts in use.
const KNOT_PX: usize = 8;

impl GroundGrid {
    /// The smallest grid with these pixels that contains the frame's footprint under a heading and a margin of `margin_px`
    /// around it; `None` where the frame sees the horizon.
    pub fn around(camera: &Camera, heading_rad: f64, gsd_m_per_px: [f64; 2], margin_px: f64) -> Option<Self> {
        Self::around_relief(camera, heading_rad, gsd_m_per_px, margin_px, [0.0; 2])
    }

    /// As [`GroundGrid::around`], for ground that rises above the reference by something between two heights, metres.
    pub fn around_relief(
        camera: &Camera,
        heading_rad: f64,
        gsd_m_per_px: [f64; 2],
        margin_px: f64,
        rises_m: [f64; 2],
    ) -> Option<Self> {
        let frame = BodyFrame::from_heading_rad(heading_rad);
        let [low, high] = rises_m.map(|rise_m| camera.footprint_at_rise(rise_m));
        let corners = [low?, high?].concat().into_iter().map(|corner| frame.enu_from_body(corner)).collect::<Vec<_>>();
        let extreme = |axis: fn(&Enu) -> f64, pick: fn(f64, f64) -> f64| {
            corners.iter().map(axis).reduce(pick).expect("a footprint has four corners")
        };
        let left = (extreme(|c| c.east_m, f64::min) / gsd_m_per_px[0] - margin_px).floor();
        let right = (extreme(|c| c.east_m, f64::max) / gsd_m_per_px[0] + margin_px).ceil();
        let top = (-extreme(|c| c.north_m, f64::max) / gsd_m_per_px[1] - margin_px).floor();
        let bottom = (-extreme(|c| c.north_m, f64::min) / gsd_m_per_px[1] + margin_px).ceil();
        Some(Self {
            width_px: (right - left) as usize,
            height_px: (bottom - top) as usize,
            nadir_px: [-left, -top],
            gsd_m_per_px,
        })
    }

    /// The offset from the nadir of a position of the grid, pixels.
    pub fn enu_from_grid(&self, position_px: [f64; 2]) -> Enu {
        Enu {
            east_m: (position_px[0] - self.nadir_px[0]) * self.gsd_m_per_px[0],
            north_m: (self.nadir_px[1] - position_px[1]) * self.gsd_m_per_px[1],
        }
    }
}

/// Resamples a frame onto a grid. `heading_rad` is the direction of the image's upper edge, radians clockwise from north.
/// The frame should be about as sharp as the grid, because sampling is bilinear and does not average. A pixel is masked
/// where its sample would reach beyond the frame's edge.
pub fn render(frame: &Gray, camera: &Camera, heading_rad: f64, grid: &GroundGrid) -> GroundView {
    let (width, height) = (grid.width_px, grid.height_px);
    let mut gray = Gray::filled(width, height, 0.0);
    let mut mask = Mask::filled(width, height, false);
    let knots = KnotGrid::new(camera, heading_rad, grid);
    let mut line = vec![[0f32; 2]; knots.columns];
    let mut row = SampleRow::new(width);
    for y in 0..height {
        knots.line(y, &mut line);
        place_row(&line, [frame.width_px(), frame.height_px()], &mut row);
        let span = y * width..(y + 1) * width;
        sample_row(frame, &row, &mut gray.values_mut()[span.clone()], &mut mask.values_mut()[span]);
    }
    GroundView { gray, mask, grid: *grid }
}

/// As [`render`], with the ground of the grid at its relief: each pixel is projected exactly. Ground that other ground hides is not told
/// from it.
pub fn render_on_relief(
    frame: &Gray,
    camera: &Camera,
    heading_rad: f64,
    grid: &GroundGrid,
    relief: &Relief,
) -> GroundView {
    let (width, height) = (grid.width_px, grid.height_px);
    let mut gray = Gray::filled(width, height, 0.0);
    let mut mask = Mask::filled(width, height, false);
    let turn = BodyFrame::from_heading_rad(heading_rad);
    let mut row = SampleRow::new(width);
    for y in 0..height {
        for (x, rise_m) in relief.row(y).iter().enumerate() {
            let ground = turn.body_from_enu(grid.enu_from_grid([x as f64 + 0.5, y as f64 + 0.5]));
            let seen = camera.frame_from_ground(ground, f64::from(*rise_m)).unwrap_or([f64::NAN; 2]);
            row.place(x, seen.map(|v| v as f32 - 0.5), [frame.width_px(), frame.height_px()]);
        }
        let span = y * width..(y + 1) * width;
        sample_row(frame, &row, &mut gray.values_mut()[span.clone()], &mut mask.values_mut()[span]);
    }
    GroundView { gray, mask, grid: *grid }
}

/// Sampling positions of a row of grid pixels: column and row of the frame's pixel to the upper left (the column is
/// `OUTSIDE` where the frame does not cover the grid pixel), and the fractions in [0, 1] towards the next pixel.
struct SampleRow {
    columns: Vec<u32>,
    rows: Vec<u32>,
    right: Vec<f32>,
    down: Vec<f32>,
}

const OUTSIDE: u32 = u32::MAX;

impl SampleRow {
    fn new(width: usize) -> Self {
        Self { columns: vec![0; width], rows: vec![0; width], right: vec![0.0; width], down: vec![0.0; width] }
    }

    /// Places pixel `index` at a position from the centre of the frame's first pixel; outside where that is not a number.
    fn place(&mut self, index: usize, [x, y]: [f32; 2], size_px: [usize; 2]) {
        let most = size_px.map(|n| n as f32 - 1.0);
        let last = size_px.map(|n| n.saturating_sub(2) as u32);
        let inside = x >= 0.0 && y >= 0.0 && x <= most[0] && y <= most[1];
        let (column, down_to) = ((x as u32).min(last[0]), (y as u32).min(last[1]));
        self.columns[index] = if inside { column } else { OUTSIDE };
        self.rows[index] = down_to;
        (self.right[index], self.down[index]) = (x - column as f32, y - down_to as f32);
    }
}

/// Computes the sampling positions of a row in a frame of `size_px` from the knots of its line.
fn place_row(line: &[[f32; 2]], size_px: [usize; 2], row: &mut SampleRow) {
    let fractions: [f32; KNOT_PX] = std::array::from_fn(|i| i as f32 / KNOT_PX as f32);
    let most = size_px.map(|n| n as f32 - 1.0);
    // A sample on the last pixel is interpolated from the pixel before it.
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

/// Samples the frame bilinearly at the positions of a row. Pixels that the frame does not cover keep their value.
fn sample_row(frame: &Gray, row: &SampleRow, out: &mut [f32], mask: &mut [u8]) {
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

/// Frame positions at every `KNOT_PX`-th grid pixel centre; NaN where the frame does not show the ground.
struct KnotGrid {
    columns: usize,
    positions: Vec<[f32; 2]>,
}

impl KnotGrid {
    fn new(camera: &Camera, heading_rad: f64, grid: &GroundGrid) -> Self {
        let columns = grid.width_px / KNOT_PX + 2;
        let rows = grid.height_px / KNOT_PX + 2;
        let frame = BodyFrame::from_heading_rad(heading_rad);
        let mut positions = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let centre = [(i * KNOT_PX) as f64 + 0.5, (j * KNOT_PX) as f64 + 0.5];
                let seen = camera.frame_from_body(frame.body_from_enu(grid.enu_from_grid(centre)));
                positions.push(seen.map_or([f32::NAN; 2], |p| [p[0] as f32, p[1] as f32]));
            }
        }
        Self { columns, positions }
    }

    /// Interpolates the knots' positions at a row of pixels between two rows of knots.
    fn line(&self, y: usize, line: &mut [[f32; 2]]) {
        let (j, fraction) = (y / KNOT_PX, (y % KNOT_PX) as f32 / KNOT_PX as f32);
        let (above, below) = (&self.positions[j * self.columns..], &self.positions[(j + 1) * self.columns..]);
        for ((out, above), below) in line.iter_mut().zip(above).zip(below) {
            *out = std::array::from_fn(|axis| above[axis] + (below[axis] - above[axis]) * fraction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Attitude, Height, Intrinsics, View};
    use super::*;
    use crate::geodesy::BodyOffset;

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

    /// A slope that rises to the east, seen from 500 m: a point of the ground appears where the line of sight meets it, which a march
    /// along the ray finds.
    #[test]
    fn a_frame_is_laid_where_its_rays_meet_the_relief() {
        let intrinsics = Intrinsics { distortion: [0.05, 0.0, 0.0, 0.0, 0.0], ..Intrinsics::centred(80, 60, 60.0) };
        let attitude = Attitude::exact(0.2, -0.1);
        let view = View::Posed { intrinsics, height: Height::AboveGround(500.0), attitude };
        let camera = Camera::new(&view, 80, 60).unwrap();
        let heading_rad = 0.7;
        let grid = GroundGrid::around_relief(&camera, heading_rad, [6.0, 6.0], 1.0, [-80.0, 120.0]).unwrap();
        let rise_m = |east_m: f64, north_m: f64| 0.15 * east_m - 0.05 * north_m;
        let enu = |x: usize, y: usize| grid.enu_from_grid([x as f64 + 0.5, y as f64 + 0.5]);
        let pixels = (0..grid.height_px).flat_map(|y| (0..grid.width_px).map(move |x| (x, y)));
        let rises = pixels.map(|(x, y)| rise_m(enu(x, y).east_m, enu(x, y).north_m) as f32).collect();
        let relief = Relief::new([grid.width_px, grid.height_px], rises).unwrap();
        let column_of: Vec<f32> = (0..80 * 60).map(|i| (i % 80) as f32).collect();
        let frame = Gray::from_values(80, 60, column_of).unwrap();
        let laid = render_on_relief(&frame, &camera, heading_rad, &grid, &relief);
        let turn = BodyFrame::from_heading_rad(heading_rad);
        for pixel in [[40.0, 30.0], [10.5, 50.5], [70.25, 8.5]] {
            // March down the ray until it is below the ground.
            let flat = camera.body_from_frame(pixel).unwrap();
            let share_of = |drop_m: f64| {
                let ground =
                    BodyOffset { right_m: flat.right_m * drop_m / 500.0, ahead_m: flat.ahead_m * drop_m / 500.0 };
                (ground, turn.enu_from_body(ground))
            };
            let mut drop_m = 300.0;
            while 500.0 - drop_m > rise_m(share_of(drop_m).1.east_m, share_of(drop_m).1.north_m) {
                drop_m += 0.01;
            }
            let met = share_of(drop_m).1;
            let at = [met.east_m / 6.0 + grid.nadir_px[0], grid.nadir_px[1] - met.north_m / 6.0];
            let (x, y) = (at[0] as usize, at[1] as usize);
            assert!(laid.mask.at(x, y), "{pixel:?} is seen");
            let seen = f64::from(laid.gray.at(x, y)) + 0.5;
            assert!((seen - pixel[0]).abs() < 1.0, "{pixel:?}: column {seen}");
            assert!((relief.at(at) - rise_m(met.east_m, met.north_m)).abs() < 1e-3);
        }
    }

    #[test]
    fn a_flat_relief_changes_nothing() {
        let frame = Gray::from_values(64, 48, (0..64 * 48).map(|i| (i % 64 + 2 * (i / 64)) as f32).collect()).unwrap();
        let view = View::Posed {
            intrinsics: Intrinsics::centred(64, 48, 50.0),
            height: Height::AboveGround(100.0),
            attitude: Attitude::exact(0.1, 0.05),
        };
        let camera = Camera::new(&view, 64, 48).unwrap();
        let grid = GroundGrid::around(&camera, 0.3, [2.0, 2.0], 1.0).unwrap();
        let relief = Relief::new([grid.width_px, grid.height_px], vec![0.0; grid.width_px * grid.height_px]).unwrap();
        let (flat, laid) =
            (render(&frame, &camera, 0.3, &grid), render_on_relief(&frame, &camera, 0.3, &grid, &relief));
        let pairs =
            flat.gray.values().iter().zip(laid.gray.values()).zip(flat.mask.values().iter().zip(laid.mask.values()));
        let both: Vec<f32> =
            pairs.filter(|(_, (a, b))| **a != 0 && **b != 0).map(|((a, b), _)| (a - b).abs()).collect();
        assert!(both.len() > 1500, "{}", both.len());
        assert!(both.iter().all(|difference| *difference < 0.1), "positions differ by the knots' interpolation only");
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
