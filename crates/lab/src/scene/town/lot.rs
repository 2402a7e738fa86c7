//! `Lot`: a piece of a block with its own house and garden.

use super::district::{Block, District, Use};
use crate::scene::noise::{chance, hash};

/// A lot, in the district's coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Lot {
    /// First and last u, metres.
    pub u_m: [f64; 2],
    /// v at the street and at the back, metres; the back may be the smaller.
    pub v_m: [f64; 2],
    /// Draws that belong to it.
    pub seed: u32,
}

/// Mean width of a lot, metres; `None` where blocks are not divided.
fn width_m(district: &District, seed: u32) -> Option<f64> {
    let wide = f64::from(chance(seed, 3, 3));
    match district.used {
        Use::Houses => Some(15.0 + 9.0 * wide),
        Use::Rows => Some(9.0 + 6.0 * wide),
        _ => None,
    }
}

/// How a block is divided: two rows of lots, back to back.
struct LotRows {
    inner_m: [f64; 4],
    count: i32,
    seed: u32,
}

impl LotRows {
    fn new(district: &District, block: &Block) -> Option<Self> {
        let seed = block.seed(district);
        let inner_m @ [u0, u1, v0, v1] = block.inner_m(district);
        let width_m = width_m(district, seed).filter(|w| u1 - u0 > *w && v1 > v0)?;
        Some(Self { inner_m, count: ((u1 - u0) / width_m).round().max(1.0) as i32, seed })
    }

    /// Border `n` of a row, u in metres. Inner borders are not evenly spaced.
    fn border_m(&self, n: i32, row: i32) -> f64 {
        let is_inner = n > 0 && n < self.count;
        let shift = if is_inner { 0.3 * (f64::from(chance(self.seed ^ 17, n, row)) - 0.5) } else { 0.0 };
        let [u0, u1, ..] = self.inner_m;
        u0 + (u1 - u0) * (f64::from(n) + shift) / f64::from(self.count)
    }

    fn lot(&self, k: i32, row: i32) -> Lot {
        let [_, _, v0, v1] = self.inner_m;
        let middle_m = 0.5 * (v0 + v1);
        let v_m = if row == 0 { [v0, middle_m] } else { [v1, middle_m] };
        Lot { u_m: [self.border_m(k, row), self.border_m(k + 1, row)], v_m, seed: hash(self.seed, k, row) }
    }
}

/// The lots of a block; none where it is not divided.
pub fn lots(district: &District, block: &Block) -> Vec<Lot> {
    let Some(rows) = LotRows::new(district, block) else { return Vec::new() };
    (0..2 * rows.count).map(|k| rows.lot(k / 2, k % 2)).collect()
}

/// The lot of a point of a block, in the district's coordinates; `None` where it is not divided.
pub fn lot_at(district: &District, block: &Block, uv: [f64; 2]) -> Option<Lot> {
    let rows = LotRows::new(district, block)?;
    let [u0, u1, v0, v1] = rows.inner_m;
    let row = i32::from(uv[1] > 0.5 * (v0 + v1));
    let last = rows.count - 1;
    let k = (((uv[0] - u0) / (u1 - u0) * f64::from(rows.count)).floor() as i32).clamp(0, last);
    let step = i32::from(uv[0] >= rows.border_m(k + 1, row)) - i32::from(uv[0] < rows.border_m(k, row));
    Some(rows.lot((k + step).clamp(0, last), row))
}

impl Lot {
    /// Width along the street, metres.
    pub fn width_m(&self) -> f64 {
        self.u_m[1] - self.u_m[0]
    }

    /// Depth from the street, metres.
    pub fn depth_m(&self) -> f64 {
        (self.v_m[1] - self.v_m[0]).abs()
    }

    /// The place of a point: metres along the street from the lot's first border, and metres from the street.
    pub fn local(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [u - self.u_m[0], (v - self.v_m[0]) * (self.v_m[1] - self.v_m[0]).signum()]
    }

    /// The point at a place of [`Lot::local`], in the district's coordinates.
    pub fn uv(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        [self.u_m[0] + s, self.v_m[0] + t * (self.v_m[1] - self.v_m[0]).signum()]
    }

    /// A draw in [0, 1).
    pub fn draw(&self, n: u32) -> f64 {
        f64::from(chance(self.seed ^ n.wrapping_mul(0x0101_0101), 1, 1))
    }

    /// From the street to the house, metres.
    pub fn setback_m(&self, used: Use) -> f64 {
        if used == Use::Rows { 0.6 * self.draw(20) } else { 2.5 + 4.0 * self.draw(20) }
    }
}
