//! `Relief`: how far the ground under a view rises above, or falls below, the plane on which the view's grid lies.

/// The relief under a view: for each pixel of its grid the height of the ground above the reference, the plane at the height of the
/// ground under the image's centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    width_px: usize,
    height_px: usize,
    /// Metres, row by row.
    rises_m: Vec<f32>,
}

impl Relief {
    /// Makes the relief of a grid of a size from the rise at the centre of each of its pixels, metres, row by row; `None` where their
    /// number is another one, or one is not finite.
    pub fn new([width_px, height_px]: [usize; 2], rises_m: Vec<f32>) -> Option<Self> {
        let is_whole = rises_m.len() == width_px * height_px && rises_m.iter().all(|rise| rise.is_finite());
        is_whole.then_some(Self { width_px, height_px, rises_m })
    }

    /// The rises of a row of pixels, metres.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.rises_m[y * self.width_px..][..self.width_px]
    }

    /// The rise at a position of the grid, metres, bilinear between pixel centres; beyond the edge that of the edge.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let along = |at: f64, extent: usize| {
            let at = (at - 0.5).clamp(0.0, extent as f64 - 1.0);
            let from = (at as usize).min(extent.saturating_sub(2));
            (from, (from + 1).min(extent - 1), at - from as f64)
        };
        if self.rises_m.is_empty() {
            return 0.0;
        }
        let ((left, right, across), (top, bottom, down)) = (along(x, self.width_px), along(y, self.height_px));
        let line = |y: usize| {
            let [a, b] = [left, right].map(|x| f64::from(self.rises_m[y * self.width_px + x]));
            a + (b - a) * across
        };
        line(top) + (line(bottom) - line(top)) * down
    }
}
