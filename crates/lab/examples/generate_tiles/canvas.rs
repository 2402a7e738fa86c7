//! `Canvas`: the scene drawn at half a metre, colour and height, and the sun over it.

use crate::relief::Relief;
use rayon::prelude::*;

/// Canvas pixels per metre.
pub const PIXELS_PER_M: f64 = 2.0;
const TALLEST_M: f32 = 30.0;

/// Colours in [0, 255] and heights in metres, row by row from the north.
pub struct Canvas {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue.
    pub colours: Vec<[f32; 3]>,
    /// Metres above the ground.
    pub heights_m: Vec<f32>,
}

/// Where the sun stands.
#[derive(Clone, Copy)]
pub struct Sun {
    /// Clockwise from north, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
}

impl Canvas {
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

    /// Shades slopes and casts shadows.
    pub fn light(&mut self, sun: Sun) {
        let (sin_az, cos_az) = sun.azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = sun.elevation_deg.to_radians().sin_cos();
        let towards = [(sin_az * cos_el) as f32, (-cos_az * cos_el) as f32, sin_el as f32];
        let rise_per_px = (sin_el / cos_el / PIXELS_PER_M) as f32;
        let reach_px = (TALLEST_M / rise_per_px) as usize;
        let relief = Relief::of(self, reach_px as f64 / PIXELS_PER_M);
        let mut lit = self.colours.clone();
        lit.par_chunks_mut(self.width).enumerate().for_each(|(row, line)| {
            for (column, colour) in line.iter_mut().enumerate() {
                let (c, r) = (column as isize, row as isize);
                let slope = |dc: isize, dr: isize| {
                    (self.height_at(c + dc, r + dr) - self.height_at(c - dc, r - dr)).clamp(-1.3, 1.3)
                };
                let (gx, gy) = (slope(1, 0), slope(0, 1));
                let facing =
                    (-gx * towards[0] - gy * towards[1] + towards[2]) / (1.0 + gx * gx + gy * gy).sqrt() / towards[2];
                let base = self.height_at(c, r);
                let highest = (relief.tallest_m(c, r) - base) / rise_per_px;
                let blocked = (1..reach_px.min(highest.max(0.0) as usize + 2)).any(|k| {
                    let at = |t: f64| (t * k as f64).round() as isize;
                    self.height_at(c + at(sin_az), r - at(cos_az)) > base + 0.3 + rise_per_px * k as f32
                });
                let light = if blocked { [0.40, 0.45, 0.55] } else { [0.35 + 0.65 * facing.clamp(0.1, 1.6); 3] };
                for (value, l) in colour.iter_mut().zip(light) {
                    *value *= l;
                }
            }
        });
        self.colours = lit;
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
