//! `Gray`: one 32-bit value a pixel.

/// A single-channel image, row by row from the top, shape (height, width). Camera and map grays run in [0, 255].
#[derive(Debug, Clone, PartialEq)]
pub struct Gray {
    width_px: usize,
    height_px: usize,
    values: Vec<f32>,
}

impl Gray {
    /// Makes an image of one value everywhere.
    pub fn filled(width_px: usize, height_px: usize, value: f32) -> Self {
        Self { width_px, height_px, values: vec![value; width_px * height_px] }
    }

    /// Makes an image of given values; `None` where the count does not fit the size.
    pub fn from_values(width_px: usize, height_px: usize, values: Vec<f32>) -> Option<Self> {
        (values.len() == width_px * height_px).then_some(Self { width_px, height_px, values })
    }

    /// Columns.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// All values, row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// As [`Gray::values`], mutable.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// One row.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width_px..(y + 1) * self.width_px]
    }

    /// The value at column x, row y.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width_px + x]
    }

    /// The image filtered by a symmetric five-pixel kernel along the rows, then along the columns. The kernel is given five
    /// neighbours in order. The rim, two pixels wide, is left unfiltered in the direction in which the kernel does not fit.
    pub fn filtered_5(&self, kernel: impl Fn([f32; 5]) -> f32) -> Self {
        let (width, height) = (self.width_px, self.height_px);
        let mut rows = self.clone();
        if width >= 5 {
            for y in 0..height {
                let target = &mut rows.values[y * width + 2..(y + 1) * width - 2];
                for (out, w) in target.iter_mut().zip(self.row(y).windows(5)) {
                    *out = kernel([w[0], w[1], w[2], w[3], w[4]]);
                }
            }
        }
        let mut out = rows.clone();
        for y in 2..height.saturating_sub(2) {
            let row = |j: usize| &rows.row(y + j - 2)[..width];
            let (a, b, c, d, e) = (row(0), row(1), row(2), row(3), row(4));
            let target = &mut out.values[y * width..(y + 1) * width];
            for x in 0..width {
                target[x] = kernel([a[x], b[x], c[x], d[x], e[x]]);
            }
        }
        out
    }

    /// The bilinear value at a position, pixels from the corner; the edge is repeated outside.
    pub fn sample(&self, x_px: f64, y_px: f64) -> f32 {
        let clamp = |v: f64, n: usize| v.clamp(0.0, (n - 1) as f64);
        let (x, y) = (clamp(x_px - 0.5, self.width_px), clamp(y_px - 0.5, self.height_px));
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width_px - 1), (y0 + 1).min(self.height_px - 1));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let top = self.at(x0, y0) + (self.at(x1, y0) - self.at(x0, y0)) * fx;
        let bottom = self.at(x0, y1) + (self.at(x1, y1) - self.at(x0, y1)) * fx;
        top + (bottom - top) * fy
    }
}
