//! The pixels of frame b that an alignment compares: a grid, in blocks, with b's own gradient.

use super::normal_equations::{LANES, Lanes};
use super::still_pixels::StillPixels;
use crate::pixels::Gray;
use crate::registration::similarity::Similarity;
use nalgebra::Vector2;

/// Rows of lanes in a block.
pub const BLOCK_ROWS: usize = 8;
/// Pixels this near to the edge are not compared: smoothing and interpolation need them.
pub const MARGIN_PX: usize = 4;

/// The pixels of b that are compared, on a grid, in blocks.
pub struct Template {
    /// Centre of b, px from the corner.
    pub centre: Vector2<f64>,
    /// Half of b's diagonal, px: growth and rotation are measured at this distance.
    pub radius_px: f64,
    /// Distance of neighbouring pixels of the grid, px.
    pub step: usize,
    /// The blocks.
    pub blocks: Vec<TemplateBlock>,
}

/// A block of the grid.
pub struct TemplateBlock {
    /// Rows from top to bottom.
    pub rows: Vec<TemplateRow>,
}

/// Eight pixels of one row, `step` apart.
pub struct TemplateRow {
    /// Centre of the first pixel, px from b's centre.
    pub from_centre: [f32; 2],
    /// Values of b.
    pub value: Lanes,
    /// Gradient of b along x and y, gray levels per px.
    pub slope: [Lanes; 2],
    /// 1 for pixels that are compared, 0 for those that stand still in the image.
    pub compared: Lanes,
}

impl Template {
    /// Makes the template of `b` (smoothed) on a grid of `step` pixels, without those that stand still.
    pub fn new(b: &Gray, centre: Vector2<f64>, step: usize, still: Option<StillPixels<'_>>) -> Self {
        let mut blocks = Vec::new();
        let (right, below) = (b.width_px().saturating_sub(MARGIN_PX), b.height_px().saturating_sub(MARGIN_PX));
        for top in (MARGIN_PX..below).step_by(step * BLOCK_ROWS) {
            let ys = || (top..below.min(top + step * BLOCK_ROWS)).step_by(step);
            let mut left = MARGIN_PX;
            while left + (LANES - 1) * step < right {
                let row = |y| TemplateRow::new(b, centre, [left, y], step, still);
                blocks.push(TemplateBlock { rows: ys().map(row).collect() });
                left += LANES * step;
            }
        }
        let radius_px = Vector2::new(b.width_px() as f64, b.height_px() as f64).norm() / 2.0;
        Self { centre, radius_px, step, blocks }
    }

    /// The template with the blocks only that reach into `a`.
    pub fn cut_to(mut self, a: &Gray, a_from_b: &Similarity) -> Self {
        let (width, height) = (a.width_px() as f64, a.height_px() as f64);
        let size = (self.step * BLOCK_ROWS) as f64 * a_from_b.scale() * 1.5;
        self.blocks.retain(|block| {
            let q = a_from_b.apply(block.middle(self.step) + self.centre);
            q.x > -size && q.y > -size && q.x < width + size && q.y < height + size
        });
        self
    }

    /// The middles of the blocks whose middle lies in `a`, px of b.
    pub fn middles_in<'a>(&'a self, a: &'a Gray, a_from_b: &'a Similarity) -> impl Iterator<Item = Vector2<f64>> + 'a {
        let (width, height) = (a.width_px() as f64, a.height_px() as f64);
        self.blocks.iter().map(|block| block.middle(self.step) + self.centre).filter(move |&p| {
            let q = a_from_b.apply(p);
            q.x > 0.0 && q.y > 0.0 && q.x < width && q.y < height
        })
    }
}

impl TemplateBlock {
    /// The middle of the block, px from b's centre.
    fn middle(&self, step: usize) -> Vector2<f64> {
        let [x, y] = self.rows[self.rows.len() / 2].from_centre;
        Vector2::new(f64::from(x) + ((LANES - 1) * step) as f64 / 2.0, f64::from(y))
    }
}

impl TemplateRow {
    fn new(b: &Gray, centre: Vector2<f64>, first: [usize; 2], step: usize, still: Option<StillPixels<'_>>) -> Self {
        let [x, y] = first;
        let stands = |i: usize| still.is_some_and(|s| s.holds(x + i * step, y));
        let lanes = |value: fn(&Gray, usize, usize) -> f32| std::array::from_fn(|i| value(b, x + i * step, y));
        Self {
            from_centre: [(x as f64 + 0.5 - centre.x) as f32, (y as f64 + 0.5 - centre.y) as f32],
            value: lanes(Gray::at),
            slope: [
                lanes(|b, x, y| 0.5 * (b.at(x + 1, y) - b.at(x - 1, y))),
                lanes(|b, x, y| 0.5 * (b.at(x, y + 1) - b.at(x, y - 1))),
            ],
            compared: std::array::from_fn(|i| if stands(i) { 0.0 } else { 1.0 }),
        }
    }
}
