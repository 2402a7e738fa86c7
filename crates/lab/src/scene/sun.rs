//! `Sun`: light and cast shadows on cells.

use super::cells::Cells;
use super::sample::{GREEN, WATER};
use rayon::prelude::*;

/// Share of light in a shadow, bluish: the sky alone.
const SKY: [f32; 3] = [0.36, 0.40, 0.48];

/// The position of the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Clockwise from north, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
}

impl Sun {
    /// The unit vector towards the sun: east, south, up.
    pub fn towards(&self) -> [f64; 3] {
        let (sin_az, cos_az) = self.azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = self.elevation_deg.to_radians().sin_cos();
        [sin_az * cos_el, -cos_az * cos_el, sin_el]
    }

    /// Light on a surface with this unit normal (east, south, up), as a factor on its colour; 1 on level ground in the sun.
    pub fn factor(&self, normal: [f64; 3], is_lit: bool) -> [f32; 3] {
        let t = self.towards();
        let facing = (normal[0] * t[0] + normal[1] * t[1] + normal[2] * t[2]).max(0.0) / t[2];
        // A wall sees half of the sky.
        let sky = (0.6 + 0.4 * normal[2]) as f32;
        SKY.map(|s| s * sky + if is_lit { (1.0 - s) * facing.min(1.9) as f32 } else { 0.0 })
    }

    /// Finds what lies in shadow, and multiplies all colours by their light.
    pub fn light(&self, cells: &mut Cells) {
        self.cast(cells);
        let towards = self.towards();
        let (columns, cell_m) = (cells.columns, cells.cell_m as f32);
        let (tops_m, kinds, shades) = (&cells.tops_m, &cells.kinds, &cells.shades);
        let rows = cells.rows;
        cells.colours.par_chunks_mut(columns).enumerate().for_each(|(row, line)| {
            for (column, colour) in line.iter_mut().enumerate() {
                let i = row * columns + column;
                let flatter = |before: usize, after: usize| {
                    let (a, b) = ((tops_m[i] - tops_m[before]) / cell_m, (tops_m[after] - tops_m[i]) / cell_m);
                    if a.abs() < b.abs() { a } else { b }
                };
                let gx = flatter(if column > 0 { i - 1 } else { i }, if column + 1 < columns { i + 1 } else { i });
                let gy = flatter(if row > 0 { i - columns } else { i }, if row + 1 < rows { i + columns } else { i });
                let most = if kinds[i] == GREEN { 0.8 } else { 2.0 };
                let (gx, gy) =
                    if kinds[i] == WATER { (0.0, 0.0) } else { (gx.clamp(-most, most), gy.clamp(-most, most)) };
                let norm = f64::from(1.0 + gx * gx + gy * gy).sqrt();
                let normal = [f64::from(-gx) / norm, f64::from(-gy) / norm, 1.0 / norm];
                debug_assert!(towards[2] > 0.0);
                let light = self.factor(normal, shades[i] == 0);
                for (value, l) in colour.iter_mut().zip(light) {
                    *value = (f32::from(*value) * l).clamp(0.0, 255.0) as u8;
                }
            }
        });
    }

    /// Carries the height of the shadow away from the sun, line by line, over digital lines of cells.
    fn cast(&self, cells: &mut Cells) {
        let t = self.towards();
        let is_by_rows = t[1].abs() >= t[0].abs();
        let (steps, width) = if is_by_rows { (cells.rows, cells.columns) } else { (cells.columns, cells.rows) };
        let (main, side) = if is_by_rows { (t[1], t[0]) } else { (t[0], t[1]) };
        let slope = side / main;
        let fall_m = (t[2] / main.abs() * cells.cell_m) as f32;
        // A line is named by its place in the first row or column.
        let shift = |step: usize| (step as f64 * slope).round() as i64;
        let bias = shift(steps - 1).max(0);
        let mut reach_m = vec![f32::MIN; width + shift(steps - 1).unsigned_abs() as usize];
        for n in 0..steps {
            let step = if main > 0.0 { steps - 1 - n } else { n };
            let first = bias - shift(step);
            for place in 0..width {
                let i = if is_by_rows { step * cells.columns + place } else { place * cells.columns + step };
                let reach = &mut reach_m[(first + place as i64) as usize];
                *reach -= fall_m;
                let above_m = *reach - cells.tops_m[i];
                cells.shades[i] = if above_m > 0.02 { (above_m * 4.0).ceil().clamp(1.0, 255.0) as u8 } else { 0 };
                *reach = reach.max(cells.tops_m[i]);
            }
        }
    }
}
