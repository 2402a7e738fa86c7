//! `SceneCanvas`: the scene drawn at half a metre, colour and height.

use rayon::prelude::*;

/// Canvas pixels per metre.
pub const PIXELS_PER_M: f64 = 2.0;

/// Colours in [0, 255] and heights in metres, row by row from the north.
pub struct SceneCanvas {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue.
    pub colours: Vec<[f32; 3]>,
    /// Metres above the ground.
    pub heights_m: Vec<f32>,
}

impl SceneCanvas {
    /// A canvas of `size_m` whose every pixel is what `ground` says of its middle (metres east and south).
    pub fn paint(size_m: [f64; 2], ground: impl Fn(f64, f64) -> ([f32; 3], f32) + Sync) -> Self {
        let (width, height) = ((size_m[0] * PIXELS_PER_M) as usize, (size_m[1] * PIXELS_PER_M) as usize);
        let mut colours = vec![[0.0; 3]; width * height];
        let mut heights_m = vec![0.0; width * height];
        colours.par_chunks_mut(width).zip(heights_m.par_chunks_mut(width)).enumerate().for_each(|(row, (c, h))| {
            for column in 0..width {
                (c[column], h[column]) =
                    ground((column as f64 + 0.5) / PIXELS_PER_M, (row as f64 + 0.5) / PIXELS_PER_M);
            }
        });
        Self { width, height, colours, heights_m }
    }

    /// Draws within a circle what rises above what is there.
    pub fn draw_within(&mut self, centre: [f64; 2], radius_m: f64, at: impl Fn(f64, f64) -> Option<([f32; 3], f32)>) {
        let range = |c: f64, n: usize| {
            let pixel = |v: f64| ((v * PIXELS_PER_M).max(0.0) as usize).min(n);
            pixel(c - radius_m)..pixel(c + radius_m + 1.0)
        };
        for row in range(centre[1], self.height) {
            for column in range(centre[0], self.width) {
                let drawn = at((column as f64 + 0.5) / PIXELS_PER_M, (row as f64 + 0.5) / PIXELS_PER_M);
                let i = row * self.width + column;
                if let Some((colour, height)) = drawn.filter(|(_, h)| *h > self.heights_m[i]) {
                    (self.colours[i], self.heights_m[i]) = (colour, height);
                }
            }
        }
    }

    /// Height at a pixel, the edge repeated.
    pub fn height_at(&self, column: isize, row: isize) -> f32 {
        let clamp = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
        self.heights_m[clamp(row, self.height) * self.width + clamp(column, self.width)]
    }

    /// Colour between pixels, bilinear, the edge repeated. Metres east and south.
    pub fn colour_at(&self, x_m: f64, y_m: f64) -> [f32; 3] {
        let clamp = |v: f64, n: usize| (v * PIXELS_PER_M - 0.5).clamp(0.0, (n - 1) as f64);
        let (x, y) = (clamp(x_m, self.width), clamp(y_m, self.height));
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let p = |x: usize, y: usize| self.colours[y * self.width + x];
        let (a, b, c, d) = (p(x0, y0), p(x1, y0), p(x0, y1), p(x1, y1));
        std::array::from_fn(|i| (a[i] * (1.0 - fx) + b[i] * fx) * (1.0 - fy) + (c[i] * (1.0 - fx) + d[i] * fx) * fy)
    }
}
