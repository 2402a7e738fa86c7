//! One round of alignment: the normal equations of every block of frame b, from the brightness of both frames.
//!
//! The model is `b(p) = gain a(S p) + plane(p)`, with a plane of its own for each block: vignetting, clouds and exposure
//! change brightness from place to place, independently of the motion. The gradient is b's own, turned into a's axes
//! (it needs no interpolation). The values of a are interpolated by the cubic of Catmull and Rom.

use super::normal_equations::{
    BlockSums, COLUMNS, GAIN, LANES, Lanes, OFFSET, PLANE, PRODUCTS, Plane, RESIDUAL, SEEN, eliminate_plane,
};
use super::template::{MARGIN_PX, Template, TemplateRow};
use crate::pixels::Gray;
use crate::registration::similarity::Similarity;
use crate::simd::dispatch;

/// Planes are measured from a block's middle in halves of its size.
const HALF_BLOCK: f32 = (LANES - 1) as f32 / 2.0;
/// A block with fewer pixels in the overlap is left out.
const LEAST_IN_BLOCK: f32 = 12.0;
/// Robust deviations below this many gray levels are rounding.
const LEAST_DEVIATION: f32 = 0.2;
/// Huber's bound, in robust standard deviations.
const HUBER: f32 = 1.345;
/// Under an overlay a pixel beyond this many robust standard deviations counts for nothing (Tukey's biweight). Without one it would reject,
/// on ground that shows little, the very edges that draw the frames on each other.
pub const TUKEY: f64 = 6.0;
/// There a residual counts in the next deviation with at most half of that.
const WINSOR: f32 = 0.5;

/// Brightness of b against a, as the last round found it.
#[derive(Clone)]
pub struct Brightness {
    /// Contrast of b over that of a.
    pub gain: f64,
    /// Robust standard deviation of the residuals, gray levels; before the first round far above any.
    pub deviation: f64,
    /// Pixels beyond this many robust standard deviations count for nothing; infinite where all count.
    rejected_beyond: f64,
    /// The plane of each block.
    planes: Vec<Plane>,
}

impl Brightness {
    /// The brightness before the first round. Pixels beyond `rejected_beyond` robust standard deviations will count for nothing.
    pub fn unknown(template: &Template, rejected_beyond: f64) -> Self {
        Self { gain: 1.0, deviation: 1e6, rejected_beyond, planes: vec![[0.0; PLANE]; template.blocks.len()] }
    }
}

dispatch! {
    /// One round over `a` (smoothed): the sums of every block that reaches into `a`, and the brightness for the next round,
    /// its gain and deviation still those of this round.
    pub fn sum_blocks(
        template: &Template, a: &Gray, a_from_b: &Similarity, brightness: &Brightness,
    ) -> (Vec<BlockSums>, Brightness) {
        sum_blocks_plain(template, a, a_from_b, brightness)
    }
}

#[inline(always)]
fn sum_blocks_plain(
    template: &Template,
    a: &Gray,
    a_from_b: &Similarity,
    brightness: &Brightness,
) -> (Vec<BlockSums>, Brightness) {
    let round = Round::new(template, a, a_from_b, brightness);
    let mut next = brightness.clone();
    let mut sums = Vec::with_capacity(template.blocks.len());
    for (block, plane) in template.blocks.iter().zip(&mut next.planes) {
        let mut totals = Totals { products: [[0f32; LANES]; PRODUCTS], count: [0f32; LANES], absolute: [0f32; LANES] };
        for (row, number) in block.rows.iter().zip(0..) {
            round.add(row, *plane, number, &mut totals);
        }
        let total = |lanes: &Lanes| lanes.iter().sum::<f32>();
        if total(&totals.count) >= LEAST_IN_BLOCK {
            let Some((mut block_sums, off)) = eliminate_plane(&totals.products) else { continue };
            block_sums.count = f64::from(total(&totals.count));
            block_sums.absolute = f64::from(total(&totals.absolute));
            (0..PLANE).for_each(|i| plane[i] += off[i]);
            sums.push(block_sums);
        }
    }
    (sums, next)
}

/// Sums over the pixels of a block, lane by lane.
struct Totals {
    /// Weighted products of the design's columns.
    products: [Lanes; PRODUCTS],
    /// Pixels compared.
    count: Lanes,
    /// Absolute residuals, bounded.
    absolute: Lanes,
}

/// The places of a row's pixels in a.
struct Places {
    x: Lanes,
    y: Lanes,
    /// 1 where the pixel lies in a, else 0.
    inside: Lanes,
    /// Px from b's centre.
    dx: Lanes,
}

/// The values that all pixels of a round share.
struct Round<'a> {
    a: &'a Gray,
    step: f32,
    /// Scale times the cosine and sine of the rotation.
    turn: [f32; 2],
    /// Place of b's centre in a, px from the centre of a's first pixel.
    centre: [f32; 2],
    /// Turns b's gradient into a's axes.
    slope: [f32; 2],
    per_radius: f32,
    gain: f32,
    bound: f32,
    tukey: f32,
    winsor: f32,
    /// Bounds of the positions in a that can be interpolated, px from the centre of a's first pixel.
    least: f32,
    most: [f32; 2],
}

impl<'a> Round<'a> {
    #[inline(always)]
    fn new(template: &Template, a: &'a Gray, a_from_b: &Similarity, brightness: &Brightness) -> Self {
        let centre = a_from_b.apply(template.centre);
        let square = a_from_b.scale().powi(2);
        let deviation = (brightness.deviation as f32).max(LEAST_DEVIATION);
        Self {
            a,
            step: template.step as f32,
            turn: [a_from_b.c as f32, a_from_b.s as f32],
            centre: [(centre.x - 0.5) as f32, (centre.y - 0.5) as f32],
            slope: [(a_from_b.c / square) as f32, (a_from_b.s / square) as f32],
            per_radius: (1.0 / template.radius_px) as f32,
            gain: brightness.gain as f32,
            bound: HUBER * deviation,
            tukey: brightness.rejected_beyond as f32 * deviation,
            winsor: WINSOR * brightness.rejected_beyond as f32 * deviation,
            least: MARGIN_PX as f32,
            most: [a.width_px() as f32 - 1.0 - MARGIN_PX as f32, a.height_px() as f32 - 1.0 - MARGIN_PX as f32],
        }
    }

    #[inline(always)]
    fn add(&self, row: &TemplateRow, plane: Plane, number: usize, totals: &mut Totals) {
        let places = self.places(row);
        if places.inside.iter().sum::<f32>() == 0.0 {
            return;
        }
        let value = self.interpolated(&places);
        let dy = row.from_centre[1];
        let down = (number as f32 - HALF_BLOCK) / HALF_BLOCK;
        let mut j = [[0f32; LANES]; COLUMNS];
        let mut weight = [0f32; LANES];
        for i in 0..LANES {
            let (gx, gy) = (row.slope[0][i], row.slope[1][i]);
            let ax = self.slope[0] * gx - self.slope[1] * gy;
            let ay = self.slope[1] * gx + self.slope[0] * gy;
            let (ux, uy) = (places.dx[i] * self.per_radius, dy * self.per_radius);
            j[0][i] = ax;
            j[1][i] = ay;
            j[2][i] = ax * ux + ay * uy;
            j[3][i] = ay * ux - ax * uy;
            j[GAIN][i] = value[i];
            let along = (i as f32 - HALF_BLOCK) / HALF_BLOCK;
            j[OFFSET][i] = 1.0;
            j[OFFSET + 1][i] = along;
            j[OFFSET + 2][i] = down;
            let residual = row.value[i] - self.gain * value[i] - (plane[0] + plane[1] * along + plane[2] * down);
            j[RESIDUAL][i] = residual;
            j[SEEN][i] = row.value[i];
            let size = residual.abs();
            let beyond = (size / self.tukey).min(1.0);
            let biweight = (1.0 - beyond * beyond) * (1.0 - beyond * beyond);
            weight[i] = places.inside[i] * biweight * (self.bound / size.max(self.bound));
            totals.count[i] += places.inside[i];
            totals.absolute[i] += places.inside[i] * size.min(self.winsor);
        }
        let mut k = 0;
        for row in 0..COLUMNS {
            for column in row..COLUMNS {
                for i in 0..LANES {
                    totals.products[k][i] += weight[i] * j[row][i] * j[column][i];
                }
                k += 1;
            }
        }
    }

    #[inline(always)]
    fn places(&self, row: &TemplateRow) -> Places {
        let [c, s] = self.turn;
        let [mut x, mut y, mut inside, mut dx] = [[0f32; LANES]; 4];
        let dy = row.from_centre[1];
        for i in 0..LANES {
            dx[i] = row.from_centre[0] + i as f32 * self.step;
            x[i] = self.centre[0] + (c * dx[i] - s * dy);
            y[i] = self.centre[1] + (s * dx[i] + c * dy);
            let is_inside = (x[i] > self.least) & (y[i] > self.least) & (x[i] < self.most[0]) & (y[i] < self.most[1]);
            inside[i] = if is_inside { row.compared[i] } else { 0.0 };
        }
        Places { x, y, inside, dx }
    }

    /// The values of a by the cubic of Catmull and Rom; 0 outside.
    #[inline(always)]
    fn interpolated(&self, places: &Places) -> Lanes {
        let Places { x, y, inside, .. } = places;
        let (mut column, mut row) = ([0i32; LANES], [0i32; LANES]);
        let (mut tx, mut ty) = ([0f32; LANES], [0f32; LANES]);
        for i in 0..LANES {
            let (px, py) = (x[i].clamp(self.least, self.most[0]), y[i].clamp(self.least, self.most[1]));
            (column[i], row[i]) = (px as i32, py as i32);
            (tx[i], ty[i]) = (px - column[i] as f32, py - row[i] as f32);
        }
        let (wx, wy) = (weights(&tx), weights(&ty));
        let width = self.a.width_px();
        let mut out = [0f32; LANES];
        for i in 0..LANES {
            if inside[i] == 0.0 {
                continue;
            }
            let first = (row[i] as usize - 1) * width + column[i] as usize - 1;
            let mut along = [0f32; 4];
            for (k, wy) in wy.iter().enumerate() {
                let taps = &self.a.values()[first + k * width..][..4];
                for (sum, tap) in along.iter_mut().zip(taps) {
                    *sum += wy[i] * tap;
                }
            }
            out[i] = (wx[0][i] * along[0] + wx[1][i] * along[1]) + (wx[2][i] * along[2] + wx[3][i] * along[3]);
        }
        out
    }
}

/// The weights of the four pixels around, by the distance from the second one.
#[inline(always)]
fn weights(t: &Lanes) -> [Lanes; 4] {
    let mut w = [[0f32; LANES]; 4];
    for i in 0..LANES {
        let t = t[i];
        let (t2, t3) = (t * t, t * t * t);
        w[0][i] = 0.5 * (2.0 * t2 - t3 - t);
        w[1][i] = 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0);
        w[2][i] = 0.5 * (4.0 * t2 - 3.0 * t3 + t);
        w[3][i] = 0.5 * (t3 - t2);
    }
    w
}

#[cfg(test)]
mod tests {
    use super::super::normal_equations::PARAMETERS;
    use super::*;
    use nalgebra::{SMatrix, SVector, Vector2};

    fn wavy(width: usize, height: usize, shift: f64) -> Gray {
        let value = |i: usize| {
            let (x, y) = ((i % width) as f64 + shift, (i / width) as f64);
            (100.0 + 40.0 * (0.31 * x + 0.12 * y).sin() + 30.0 * (0.23 * y - 0.1 * x).cos()) as f32
        };
        Gray::from_values(width, height, (0..width * height).map(value).collect()).expect("one value a pixel")
    }

    fn still() -> Similarity {
        Similarity { c: 1.0, s: 0.0, t: Vector2::zeros() }
    }

    #[test]
    fn both_twins_agree_bit_for_bit() {
        let (a, b) = (wavy(90, 70, 0.0), wavy(90, 70, 0.3));
        let template = Template::new(&b, Vector2::new(45.0, 35.0), 2, None);
        let motion = Similarity { c: 0.99, s: 0.03, t: Vector2::new(3.3, -2.1) };
        let bits = |(sums, _): (Vec<BlockSums>, Brightness)| -> Vec<u64> {
            sums.iter().flat_map(|b| b.normal.iter().chain(&b.right).map(|v| v.to_bits()).collect::<Vec<_>>()).collect()
        };
        let unknown = Brightness::unknown(&template, TUKEY);
        let either = bits(sum_blocks(&template, &a, &motion, &unknown));
        assert!(!either.is_empty() && either == bits(sum_blocks_plain(&template, &a, &motion, &unknown)));
    }

    #[test]
    fn the_step_is_the_shift_and_a_plane_of_brightness_changes_nothing() {
        let (a, shifted) = (wavy(90, 70, 0.0), wavy(90, 70, 0.1));
        let ramp = |b: &Gray| {
            let value = |i: usize| b.values()[i] + 0.4 * (i % 90) as f32 - 0.7 * (i / 90) as f32 + 9.0;
            Gray::from_values(90, 70, (0..90 * 70).map(value).collect()).expect("one value a pixel")
        };
        for b in [ramp(&shifted), shifted] {
            let template = Template::new(&b, Vector2::new(45.0, 35.0), 2, None);
            let (sums, _) = sum_blocks(&template, &a, &still(), &Brightness::unknown(&template, TUKEY));
            let normal: SMatrix<f64, PARAMETERS, PARAMETERS> = sums.iter().map(|s| s.normal).sum();
            let right: SVector<f64, PARAMETERS> = sums.iter().map(|s| s.right).sum();
            let step = normal.try_inverse().expect("textured") * right;
            assert!((step[0] - 0.1).abs() < 0.01 && step[1].abs() < 0.01, "{step}");
            assert!(sums.iter().all(|s| s.correlation > 0.98));
        }
    }
}
