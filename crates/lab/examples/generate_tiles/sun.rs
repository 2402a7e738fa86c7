//! `Sun`: sunlight over a canvas, and the shadows in it.

use crate::canvas::{PIXELS_PER_M, SceneCanvas};
use crate::relief::Relief;
use rayon::prelude::*;

/// The greatest height of anything, metres.
const TALLEST_M: f32 = 30.0;

/// The position of the sun.
#[derive(Clone, Copy)]
pub struct Sun {
    /// Clockwise from north, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
}

impl SceneCanvas {
    /// Shades slopes and casts shadows.
    pub fn light(&mut self, sun: Sun) {
        let (sin_az, cos_az) = sun.azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = sun.elevation_deg.to_radians().sin_cos();
        let towards = [(sin_az * cos_el) as f32, (-cos_az * cos_el) as f32, sin_el as f32];
        let rise_per_px = (sin_el / cos_el / PIXELS_PER_M) as f32;
        let reach_px = (TALLEST_M / rise_per_px) as usize;
        let relief = Relief::new(self, reach_px as f64 / PIXELS_PER_M);
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
}
