//! What a ray sees of a world: the first cell whose top it passes, or whose side it meets.

use super::cells::{BLOCK, Cells};
use super::sample::{FIRST_BUILDING, GREEN};
use super::world::World;

/// Where a ray met the cells.
struct Hit {
    point: [f64; 3],
    cell: usize,
    /// The cell before it.
    before: usize,
    /// Whether it met the side of the cell and not its top.
    is_side: bool,
}

impl World {
    /// The colour that a ray from `origin` sees. Scene coordinates; `direction` points down.
    pub fn seen(&self, origin: [f64; 3], direction: [f64; 3]) -> [f32; 3] {
        let hit = self.cells.first_hit(&Ray::new(origin, direction));
        let cells = &self.cells;
        let own = cells.colours[hit.cell].map(f32::from);
        let depth_m = f64::from(cells.tops_m[hit.cell]) - hit.point[2];
        if !hit.is_side || depth_m < 0.3 {
            return own;
        }
        let kind = cells.kinds[hit.cell];
        if kind >= FIRST_BUILDING {
            return self.wall(&hit, kind);
        }
        if kind == GREEN {
            // Leaves below the crown's upper side.
            let dark = 1.0 - 0.45 * (depth_m / 3.0).min(1.0) as f32;
            return own.map(|c| c * dark);
        }
        own
    }

    fn wall(&self, hit: &Hit, kind: u16) -> [f32; 3] {
        let [x, y, z] = hit.point;
        let (colour, [nx, ny]) = self.buildings[usize::from(kind - FIRST_BUILDING)].wall_at(x, y, z);
        let shadow_m = f64::from(self.cells.tops_m[hit.before]) + 0.25 * f64::from(self.cells.shades[hit.before]);
        let is_lit = self.cells.shades[hit.before] == 0 || z > shadow_m;
        let light = self.sun.factor([nx, ny, 0.0], is_lit);
        std::array::from_fn(|i| colour[i] * light[i])
    }
}

/// A ray that points down.
struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
    /// One over the direction.
    inverse: [f64; 3],
}

impl Ray {
    fn new(origin: [f64; 3], direction: [f64; 3]) -> Self {
        // A ray straight down leaves no cell.
        let inverse = direction.map(|d| if d.abs() < 1e-12 { f64::MAX } else { 1.0 / d });
        Self { origin, direction, inverse }
    }

    #[inline]
    fn z_m(&self, t: f64) -> f64 {
        self.origin[2] + t * self.direction[2]
    }

    /// Where it comes down to a height.
    #[inline]
    fn at_height(&self, z_m: f64) -> f64 {
        (z_m - self.origin[2]) * self.inverse[2]
    }

    fn point(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + t * self.direction[axis])
    }
}

/// The squares of a grid that a ray crosses, one after the other.
struct Walk {
    square: [i64; 2],
    step: [i64; 2],
    /// Where the ray leaves the square on each axis.
    next: [f64; 2],
    /// From one border to the next.
    delta: [f64; 2],
}

impl Walk {
    /// Begins at `t` on a grid of squares of this side.
    #[inline]
    fn new(ray: &Ray, side_m: f64, t: f64) -> Self {
        let mut walk = Self { square: [0; 2], step: [0; 2], next: [f64::MAX; 2], delta: [f64::MAX; 2] };
        for axis in 0..2 {
            let square = ((ray.origin[axis] + t * ray.direction[axis]) / side_m).floor();
            walk.square[axis] = square as i64;
            if ray.inverse[axis] != f64::MAX {
                let is_up = ray.direction[axis] > 0.0;
                walk.step[axis] = if is_up { 1 } else { -1 };
                let edge = if is_up { square + 1.0 } else { square };
                walk.next[axis] = (edge * side_m - ray.origin[axis]) * ray.inverse[axis];
                walk.delta[axis] = side_m * ray.inverse[axis].abs();
            }
        }
        walk
    }

    /// Where the ray leaves the square.
    #[inline]
    fn end(&self) -> f64 {
        self.next[0].min(self.next[1])
    }

    #[inline]
    fn advance(&mut self) {
        let axis = usize::from(self.next[1] < self.next[0]);
        self.square[axis] += self.step[axis];
        self.next[axis] += self.delta[axis];
    }
}

impl Cells {
    /// Walks block by block where the ray stays above all of a block, else cell by cell.
    fn first_hit(&self, ray: &Ray) -> Hit {
        let across = self.columns.div_ceil(BLOCK);
        let down = self.rows.div_ceil(BLOCK);
        let clamp = |v: i64, n: usize| v.clamp(0, n as i64 - 1) as usize;
        let mut t = ray.at_height(f64::from(self.highest_m) + 0.01).max(0.0);
        let mut blocks = Walk::new(ray, self.cell_m * BLOCK as f64, t);
        loop {
            let end = blocks.end();
            let top_m = self.block_tops_m[clamp(blocks.square[1], down) * across + clamp(blocks.square[0], across)];
            if ray.z_m(end) <= f64::from(top_m)
                && let Some(hit) = self.hit_between(ray, t, end)
            {
                return hit;
            }
            t = end;
            blocks.advance();
        }
    }

    /// The first hit on the way from `t` to `end`.
    fn hit_between(&self, ray: &Ray, mut t: f64, end: f64) -> Option<Hit> {
        let mut walk = Walk::new(ray, self.cell_m, t);
        let mut before = None;
        loop {
            let cell = self.index(walk.square[0], walk.square[1]);
            let top_m = f64::from(self.tops_m[cell]);
            let out = walk.end();
            let is_side = ray.z_m(t) <= top_m;
            if is_side || ray.z_m(out) <= top_m {
                // In the first cell of a block the one before is not known: that against the longer step of the ray.
                let axis = usize::from(ray.direction[1].abs() > ray.direction[0].abs());
                let back = |a: usize| walk.square[a] - if a == axis { walk.step[a] } else { 0 };
                let before = before.unwrap_or_else(|| self.index(back(0), back(1)));
                let at = if is_side { t } else { ray.at_height(top_m) };
                return Some(Hit { point: ray.point(at), cell, before, is_side });
            }
            if out >= end {
                return None;
            }
            before = Some(cell);
            t = out;
            walk.advance();
        }
    }
}
