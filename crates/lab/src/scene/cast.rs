//! What a ray sees of a world: the first cell whose top it passes, or whose side it meets.

use super::cells::{BLOCK, Cells, FIRST_BUILDING, GREEN};
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
        let hit = self.cells.first_hit(origin, direction);
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

/// Moves a ray this far over a border, metres, so that rounding cannot leave it before the border.
const OVER_M: f64 = 1e-7;

impl Cells {
    /// Walks block by block where the ray stays above all of a block, else cell by cell.
    fn first_hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Hit {
        let run = direction[0].hypot(direction[1]).max(1e-12);
        let over = OVER_M / run;
        let block_m = self.cell_m * BLOCK as f64;
        let across = self.columns.div_ceil(BLOCK);
        let down = self.rows.div_ceil(BLOCK);
        let mut t = ((origin[2] - f64::from(self.highest_m) - 0.01) / -direction[2]).max(0.0);
        loop {
            let at = |axis: usize| origin[axis] + t * direction[axis];
            let block = [at(0), at(1)].map(|v| (v / block_m).floor());
            let end = exit(origin, direction, block, block_m);
            let clamp = |v: f64, n: usize| v.clamp(0.0, n as f64 - 1.0) as usize;
            let top_m = self.block_tops_m[clamp(block[1], down) * across + clamp(block[0], across)];
            if origin[2] + end * direction[2] <= f64::from(top_m) {
                if let Some(hit) = self.hit_before(origin, direction, t, end) {
                    return hit;
                }
            }
            t = end.max(t) + over;
        }
    }

    /// The first hit on the way from `t` to `end`.
    fn hit_before(&self, origin: [f64; 3], direction: [f64; 3], mut t: f64, end: f64) -> Option<Hit> {
        let over = OVER_M / direction[0].hypot(direction[1]).max(1e-12);
        let mut before = None;
        while t < end {
            let place = [0, 1].map(|axis| ((origin[axis] + t * direction[axis]) / self.cell_m).floor());
            let cell = self.index(place[0] as i64, place[1] as i64);
            let top_m = f64::from(self.tops_m[cell]);
            let hit = |t: f64, is_side: bool| {
                let point = [0, 1, 2].map(|axis| origin[axis] + t * direction[axis]);
                let step = [0, 1].map(|axis| place[axis] as i64 - direction[axis].signum() as i64);
                // Into a block the cell before is not known: the one that the steeper part of the ray came from.
                let across = if direction[0].abs() > direction[1].abs() {
                    [step[0], place[1] as i64]
                } else {
                    [place[0] as i64, step[1]]
                };
                let before = before.unwrap_or_else(|| self.index(across[0], across[1]));
                Some(Hit { point, cell, before, is_side })
            };
            if origin[2] + t * direction[2] <= top_m {
                return hit(t, true);
            }
            let out = exit(origin, direction, place, self.cell_m);
            if origin[2] + out * direction[2] <= top_m {
                return hit((origin[2] - top_m) / -direction[2], false);
            }
            before = Some(cell);
            t = out.max(t) + over;
        }
        None
    }
}

/// Where on a ray a square of this side ends.
#[inline]
fn exit(origin: [f64; 3], direction: [f64; 3], square: [f64; 2], side_m: f64) -> f64 {
    let border = |axis: usize| {
        let d = direction[axis];
        if d.abs() < 1e-12 {
            return f64::MAX;
        }
        let edge = (square[axis] + if d > 0.0 { 1.0 } else { 0.0 }) * side_m;
        (edge - origin[axis]) / d
    };
    border(0).min(border(1))
}
