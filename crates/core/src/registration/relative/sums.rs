//! The sums of one round of alignment: what brightness says about a motion, block by block of frame b.
//!
//! The model is `b(p) = gain a(S p) + plane(p)`, with a plane of its own for each block: vignetting, clouds and exposure
//! change it from place to place, and it says nothing of the motion. The gradient is b's own, turned into
//! a's axes (it needs no interpolation); a's values are interpolated by Catmull and Rom's cubic.

use super::Similarity;
use crate::pixels::Gray;
use crate::simd::dispatch;
use nalgebra::{SMatrix, SVector, Vector2};

/// Shift of b's centre in a (x, y), growth and turn (both times `Template::radius_px`), gain.
pub const PARAMETERS: usize = 5;
/// Pixels compared side by side.
const LANES: usize = 8;
/// A block is so many rows of lanes high.
const BLOCK_ROWS: usize = 8;
/// Planes are measured from a block's middle in halves of its size.
const HALF_BLOCK: f32 = (LANES - 1) as f32 / 2.0;
/// The pixels of a block that are in the overlap are spread along both axes: the least determinant of their moments,
/// coordinates in half blocks; a full block has 0.1.
const LEAST_SPREAD: f64 = 0.003;
/// Pixels this near to the edge are not compared: smoothing and interpolation need them.
const MARGIN_PX: usize = 4;
/// Blocks with fewer pixels in the overlap say nothing.
const LEAST_IN_BLOCK: f32 = 12.0;
/// Robust deviations below this many gray levels are rounding.
const LEAST_DEVIATION: f32 = 0.2;
/// Huber's bound, in robust standard deviations.
const HUBER: f32 = 1.345;
/// Columns of the design: the parameters and the block's plane; then the residual and b itself.
const COLUMNS: usize = PARAMETERS + PLANE + 2;
const GAIN: usize = PARAMETERS - 1;
const OFFSET: usize = PARAMETERS;
/// Offset, slope along x, slope along y.
const PLANE: usize = 3;
const RESIDUAL: usize = OFFSET + PLANE;
const SEEN: usize = RESIDUAL + 1;
const PRODUCTS: usize = COLUMNS * (COLUMNS + 1) / 2;

type Lanes = [f32; LANES];
type Plane = [f32; PLANE];

/// The pixels of b that are compared, on a grid, by blocks.
pub struct Template {
    /// About b's centre, px.
    pub centre: Vector2<f64>,
    /// Half of b's diagonal: growth and turn are measured at this distance.
    pub radius_px: f64,
    step: usize,
    blocks: Vec<Block>,
}

struct Block {
    rows: Vec<Row>,
}

/// Eight pixels of one row, `step` apart.
struct Row {
    /// Of the first pixel's centre, from b's centre.
    from_centre: [f32; 2],
    value: Lanes,
    slope: [Lanes; 2],
}

/// One block's part of the normal equations, its plane eliminated.
pub struct BlockSums {
    /// Normal matrix.
    pub normal: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Design times residual.
    pub right: SVector<f64, PARAMETERS>,
    /// Correlation of a and b.
    pub correlation: f64,
    /// Pixels compared, their absolute residuals' sum.
    pub count: f64,
    pub absolute: f64,
}

/// What the last round knew of brightness.
#[derive(Clone)]
pub struct Brightness {
    pub gain: f64,
    /// Robust standard deviation of the residuals, gray levels; before the first round far above any.
    pub deviation: f64,
    /// Each block's plane.
    planes: Vec<Plane>,
}

impl Brightness {
    pub fn unknown(template: &Template) -> Self {
        Self { gain: 1.0, deviation: 1e6, planes: vec![[0.0; PLANE]; template.blocks.len()] }
    }
}

impl Template {
    /// Pixels of `b` (smoothed) on a grid of `step` pixels.
    pub fn new(b: &Gray, centre: Vector2<f64>, step: usize) -> Self {
        let mut blocks = Vec::new();
        let (right, below) = (b.width_px().saturating_sub(MARGIN_PX), b.height_px().saturating_sub(MARGIN_PX));
        for top in (MARGIN_PX..below).step_by(step * BLOCK_ROWS) {
            let ys = || (top..below.min(top + step * BLOCK_ROWS)).step_by(step);
            let mut left = MARGIN_PX;
            while left + (LANES - 1) * step < right {
                blocks.push(Block { rows: ys().map(|y| Row::new(b, centre, [left, y], step)).collect() });
                left += LANES * step;
            }
        }
        let radius_px = Vector2::new(b.width_px() as f64, b.height_px() as f64).norm() / 2.0;
        Self { centre, radius_px, step, blocks }
    }

    /// Keeps the blocks that reach into `a`.
    pub fn cut_to(mut self, a: &Gray, motion: &Similarity) -> Self {
        let (width, height) = (a.width_px() as f64, a.height_px() as f64);
        let size = (self.step * BLOCK_ROWS) as f64 * motion.scale() * 1.5;
        self.blocks.retain(|block| {
            let q = motion.apply(block.middle(self.step) + self.centre);
            q.x > -size && q.y > -size && q.x < width + size && q.y < height + size
        });
        self
    }

    /// The middles of the blocks whose middle lies in `a`, px of b.
    pub fn middles_in<'a>(&'a self, a: &'a Gray, motion: &'a Similarity) -> impl Iterator<Item = Vector2<f64>> + 'a {
        let (width, height) = (a.width_px() as f64, a.height_px() as f64);
        self.blocks.iter().map(|block| block.middle(self.step) + self.centre).filter(move |&p| {
            let q = motion.apply(p);
            q.x > 0.0 && q.y > 0.0 && q.x < width && q.y < height
        })
    }

    /// One round over `a` (smoothed): the sums of every block that reaches into it, and the brightness for the next.
    pub fn sums(&self, a: &Gray, motion: &Similarity, brightness: &Brightness) -> (Vec<BlockSums>, Brightness) {
        sums(self, a, motion, brightness)
    }

    #[inline(always)]
    fn sums_of(&self, a: &Gray, motion: &Similarity, brightness: &Brightness) -> (Vec<BlockSums>, Brightness) {
        let round = Round::new(self, a, motion, brightness);
        let mut next = brightness.clone();
        let mut sums = Vec::with_capacity(self.blocks.len());
        for (block, plane) in self.blocks.iter().zip(&mut next.planes) {
            let mut products = [[0f32; LANES]; PRODUCTS];
            let (mut count, mut absolute) = ([0f32; LANES], [0f32; LANES]);
            for (row, number) in block.rows.iter().zip(0..) {
                round.add(row, *plane, number, &mut products, &mut count, &mut absolute);
            }
            let total = |lanes: &Lanes| lanes.iter().sum::<f32>();
            if total(&count) >= LEAST_IN_BLOCK {
                let Some((mut block_sums, off)) = eliminated(&products) else { continue };
                (block_sums.count, block_sums.absolute) = (f64::from(total(&count)), f64::from(total(&absolute)));
                (0..PLANE).for_each(|i| plane[i] += off[i]);
                sums.push(block_sums);
            }
        }
        (sums, next)
    }
}

dispatch! {
    fn sums(template: &Template, a: &Gray, motion: &Similarity, known: &Brightness) -> (Vec<BlockSums>, Brightness) {
        template.sums_of(a, motion, known)
    }
}

impl Block {
    /// From b's centre.
    fn middle(&self, step: usize) -> Vector2<f64> {
        let [x, y] = self.rows[self.rows.len() / 2].from_centre;
        Vector2::new(f64::from(x) + ((LANES - 1) * step) as f64 / 2.0, f64::from(y))
    }
}

impl Row {
    fn new(b: &Gray, centre: Vector2<f64>, first: [usize; 2], step: usize) -> Self {
        let [x, y] = first;
        let lanes = |value: fn(&Gray, usize, usize) -> f32| std::array::from_fn(|i| value(b, x + i * step, y));
        Self {
            from_centre: [(x as f64 + 0.5 - centre.x) as f32, (y as f64 + 0.5 - centre.y) as f32],
            value: lanes(Gray::at),
            slope: [
                lanes(|b, x, y| 0.5 * (b.at(x + 1, y) - b.at(x - 1, y))),
                lanes(|b, x, y| 0.5 * (b.at(x, y + 1) - b.at(x, y - 1))),
            ],
        }
    }
}

/// What stays the same for all pixels of a round.
struct Round<'a> {
    a: &'a Gray,
    step: f32,
    /// Scale times cosine and sine.
    turn: [f32; 2],
    /// Of b's centre in a, from the centre of a's first pixel.
    centre: [f32; 2],
    /// b's gradient to a's axes.
    slope: [f32; 2],
    per_radius: f32,
    gain: f32,
    bound: f32,
    /// Positions in a, from the centre of its first pixel, that can be interpolated: least and greatest.
    least: f32,
    most: [f32; 2],
}

impl<'a> Round<'a> {
    #[inline(always)]
    fn new(template: &Template, a: &'a Gray, motion: &Similarity, brightness: &Brightness) -> Self {
        let centre = motion.apply(template.centre);
        let square = motion.scale().powi(2);
        let deviation = (brightness.deviation as f32).max(LEAST_DEVIATION);
        Self {
            a,
            step: template.step as f32,
            turn: [motion.c as f32, motion.s as f32],
            centre: [(centre.x - 0.5) as f32, (centre.y - 0.5) as f32],
            slope: [(motion.c / square) as f32, (motion.s / square) as f32],
            per_radius: (1.0 / template.radius_px) as f32,
            gain: brightness.gain as f32,
            bound: HUBER * deviation,
            least: MARGIN_PX as f32,
            most: [a.width_px() as f32 - 1.0 - MARGIN_PX as f32, a.height_px() as f32 - 1.0 - MARGIN_PX as f32],
        }
    }

    #[inline(always)]
    fn add(
        &self,
        row: &Row,
        plane: Plane,
        number: usize,
        products: &mut [Lanes; PRODUCTS],
        count: &mut Lanes,
        absolute: &mut Lanes,
    ) {
        let [c, s] = self.turn;
        let [mut x, mut y, mut inside, mut dx] = [[0f32; LANES]; 4];
        let dy = row.from_centre[1];
        let down = (number as f32 - HALF_BLOCK) / HALF_BLOCK;
        let mut any = 0.0;
        for i in 0..LANES {
            dx[i] = row.from_centre[0] + i as f32 * self.step;
            x[i] = self.centre[0] + (c * dx[i] - s * dy);
            y[i] = self.centre[1] + (s * dx[i] + c * dy);
            let is_inside = (x[i] > self.least) & (y[i] > self.least) & (x[i] < self.most[0]) & (y[i] < self.most[1]);
            inside[i] = if is_inside { 1.0 } else { 0.0 };
            any += inside[i];
        }
        if any == 0.0 {
            return;
        }
        let value = self.interpolated(&x, &y, &inside);
        let mut j = [[0f32; LANES]; COLUMNS];
        let mut weight = [0f32; LANES];
        for i in 0..LANES {
            let (gx, gy) = (row.slope[0][i], row.slope[1][i]);
            let ax = self.slope[0] * gx - self.slope[1] * gy;
            let ay = self.slope[1] * gx + self.slope[0] * gy;
            let (ux, uy) = (dx[i] * self.per_radius, dy * self.per_radius);
            j[0][i] = ax;
            j[1][i] = ay;
            j[2][i] = ax * ux + ay * uy;
            j[3][i] = ay * ux - ax * uy;
            j[4][i] = value[i];
            let along = (i as f32 - HALF_BLOCK) / HALF_BLOCK;
            j[OFFSET][i] = 1.0;
            j[OFFSET + 1][i] = along;
            j[OFFSET + 2][i] = down;
            let residual = row.value[i] - self.gain * value[i] - (plane[0] + plane[1] * along + plane[2] * down);
            j[RESIDUAL][i] = residual;
            j[SEEN][i] = row.value[i];
            let size = residual.abs();
            weight[i] = inside[i] * (self.bound / size.max(self.bound));
            count[i] += inside[i];
            absolute[i] += inside[i] * size;
        }
        let mut k = 0;
        for row in 0..COLUMNS {
            for column in row..COLUMNS {
                for i in 0..LANES {
                    products[k][i] += weight[i] * j[row][i] * j[column][i];
                }
                k += 1;
            }
        }
    }

    /// a's values by Catmull and Rom's cubic; 0 outside.
    #[inline(always)]
    fn interpolated(&self, x: &Lanes, y: &Lanes, inside: &Lanes) -> Lanes {
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

/// The sums with the block's plane eliminated, and by how much the plane is off; `None` where too few pixels hold it.
fn eliminated(products: &[Lanes; PRODUCTS]) -> Option<(BlockSums, Plane)> {
    let mut full = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
    let mut k = 0;
    for row in 0..COLUMNS {
        for column in row..COLUMNS {
            let sum: f64 = products[k].iter().map(|&v| f64::from(v)).sum();
            (full[(row, column)], full[(column, row)]) = (sum, sum);
            k += 1;
        }
    }
    let of_plane = full.fixed_columns::<PLANE>(OFFSET).into_owned();
    let plane = of_plane.fixed_rows::<PLANE>(OFFSET).into_owned();
    let inverse = plane.try_inverse().filter(|_| plane.determinant() > LEAST_SPREAD * plane[(0, 0)].powi(3))?;
    let rest = full - of_plane * inverse * of_plane.transpose();
    let squares = rest[(GAIN, GAIN)].max(0.0) * rest[(SEEN, SEEN)].max(0.0);
    let correlation = if squares > 1e-6 { (rest[(GAIN, SEEN)] / squares.sqrt()).clamp(-1.0, 1.0) } else { 0.0 };
    let sums = BlockSums {
        normal: rest.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into_owned(),
        right: rest.fixed_view::<PARAMETERS, 1>(0, RESIDUAL).into_owned(),
        correlation,
        count: 0.0,
        absolute: 0.0,
    };
    let off = inverse * of_plane.row(RESIDUAL).transpose();
    Some((sums, [off[0] as f32, off[1] as f32, off[2] as f32]))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let template = Template::new(&b, Vector2::new(45.0, 35.0), 2);
        let motion = Similarity { c: 0.99, s: 0.03, t: Vector2::new(3.3, -2.1) };
        let bits = |(sums, _): (Vec<BlockSums>, Brightness)| -> Vec<u64> {
            sums.iter().flat_map(|b| b.normal.iter().chain(&b.right).map(|v| v.to_bits()).collect::<Vec<_>>()).collect()
        };
        let unknown = Brightness::unknown(&template);
        let either = bits(template.sums(&a, &motion, &unknown));
        assert!(!either.is_empty() && either == bits(template.sums_of(&a, &motion, &unknown)));
    }

    #[test]
    fn the_step_is_the_shift_and_a_plane_of_brightness_changes_nothing() {
        let (a, shifted) = (wavy(90, 70, 0.0), wavy(90, 70, 0.1));
        let ramp = |b: &Gray| {
            let value = |i: usize| b.values()[i] + 0.4 * (i % 90) as f32 - 0.7 * (i / 90) as f32 + 9.0;
            Gray::from_values(90, 70, (0..90 * 70).map(value).collect()).expect("one value a pixel")
        };
        for b in [ramp(&shifted), shifted] {
            let template = Template::new(&b, Vector2::new(45.0, 35.0), 2);
            let (sums, _) = template.sums(&a, &still(), &Brightness::unknown(&template));
            let normal: SMatrix<f64, PARAMETERS, PARAMETERS> = sums.iter().map(|s| s.normal).sum();
            let right: SVector<f64, PARAMETERS> = sums.iter().map(|s| s.right).sum();
            let step = normal.try_inverse().expect("textured") * right;
            assert!((step[0] - 0.1).abs() < 0.01 && step[1].abs() < 0.01, "{step}");
            assert!(sums.iter().all(|s| s.correlation > 0.98));
        }
    }
}
