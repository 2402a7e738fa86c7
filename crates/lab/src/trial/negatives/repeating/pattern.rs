//! `RepeatingPattern`: a pattern over the plane, metres, with elements that are missing or displaced, some of them in one epoch
//! only.

use super::pattern_kind::PatternKind;
use crate::trial::negatives::cell_hash::cell_hash;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// A pattern over the plane. Lengths are metres, shares are ratios of the period.
#[derive(Debug, Clone, PartialEq)]
pub struct RepeatingPattern {
    /// What repeats.
    pub kind: PatternKind,
    /// The lattice's periods along its own two axes.
    pub period_m: [f64; 2],
    /// Direction of the first axis, radians counter-clockwise from east.
    pub angle_rad: f64,
    /// Position of the lattice.
    pub phase_m: [f64; 2],
    /// Share of the period that an element covers.
    pub fill: f64,
    /// Whether every second row is shifted by half a period.
    pub is_staggered: bool,
    /// Greatest displacement of an element, share of the shorter period.
    pub jitter: f64,
    /// Share of missing elements.
    pub missing: f64,
    /// Share of the elements whose defects and tone differ between the epochs.
    pub changed: f64,
    /// Number of tones, for kinds whose elements differ.
    pub tones: u32,
    /// Seed of defects and tones.
    pub seed: u32,
}

/// A cell of the lattice, and a point in it relative to the cell's middle, metres.
struct Cell {
    x: i32,
    y: i32,
    u_m: f64,
    v_m: f64,
}

/// The element of a cell.
struct Element {
    shift_m: [f64; 2],
    size: f64,
    tone: f64,
}

impl RepeatingPattern {
    /// Draws a pattern of a kind whose main period is `period_m`.
    pub fn random(kind: PatternKind, period_m: f64, rng: &mut ChaCha8Rng) -> Self {
        let stretch = if rng.random_bool(0.5) { 1.0 } else { rng.random_range(1.0..2.2) };
        let is_hexagonal = kind == PatternKind::Dots && rng.random_bool(0.35);
        let ratio = match kind {
            PatternKind::Stripes | PatternKind::Waves => rng.random_range(6.0..20.0),
            PatternKind::SolarRows => rng.random_range(3.0..9.0),
            PatternKind::Vineyard => rng.random_range(6.0..20.0f64).round(),
            PatternKind::Bricks => rng.random_range(1.2..3.0),
            PatternKind::Pivots => 1.0,
            _ if is_hexagonal => 0.75f64.sqrt(),
            _ => stretch,
        };
        let is_exact = rng.random_bool(0.4);
        let period_m = [period_m, period_m * ratio];
        Self {
            kind,
            // The longer side of a brick lies along the rows.
            period_m: if kind == PatternKind::Bricks { [period_m[1], period_m[0]] } else { period_m },
            angle_rad: rng.random_range(0.0..PI),
            phase_m: period_m.map(|p| p * rng.random_range(0.0..1e3)),
            fill: rng.random_range(0.3..0.7),
            is_staggered: is_hexagonal || kind == PatternKind::Bricks,
            jitter: if is_exact { 0.0 } else { rng.random_range(0.0..0.15) },
            missing: if is_exact { 0.0 } else { rng.random_range(0.0..0.2) },
            changed: [0.0, 0.3, 1.0, 1.0][rng.random_range(0..4)],
            tones: rng.random_range(2..6),
            seed: rng.random(),
        }
    }

    /// How much ink lies at a point of the plane (metres east and north) in an epoch: 0 is bare ground, 1 a whole element.
    pub fn ink_at(&self, [x_m, y_m]: [f64; 2], epoch: u32) -> f64 {
        let (sin, cos) = self.angle_rad.sin_cos();
        let (u, v) = (x_m * cos + y_m * sin + self.phase_m[0], y_m * cos - x_m * sin + self.phase_m[1]);
        let cell = self.cell(u, v);
        match self.kind {
            PatternKind::Stripes | PatternKind::Waves | PatternKind::Vineyard => self.row_ink(&cell, epoch),
            PatternKind::Dots | PatternKind::Orchard | PatternKind::Pivots => self.disc_ink(&cell, epoch),
            PatternKind::SolarRows | PatternKind::Houses => self.rectangle_ink(&cell, epoch),
            PatternKind::Checkers => {
                let is_dark = (cell.x + cell.y).rem_euclid(2) == 1;
                if is_dark { self.element(cell.x, cell.y, epoch).map_or(0.0, |_| 1.0) } else { 0.0 }
            }
            PatternKind::Parcels | PatternKind::Streets | PatternKind::Bricks => self.tiled_ink(&cell, epoch),
            PatternKind::Hatch => {
                let turn = 0.5 + self.fill * 1.5;
                let across = u * turn.cos() + v * turn.sin();
                let second = (across / self.period_m[1]).rem_euclid(1.0) < 0.5 * self.fill;
                let first = cell.u_m.abs() < 0.25 * self.fill * self.period_m[0];
                f64::from(u8::from(first) + u8::from(second)) / 2.0
            }
        }
    }

    fn cell(&self, u: f64, v: f64) -> Cell {
        let [p, q] = self.period_m;
        let y = (v / q).floor();
        let u = if self.is_staggered { u + 0.5 * p * y.rem_euclid(2.0) } else { u };
        let x = (u / p).floor();
        Cell { x: x as i32, y: y as i32, u_m: u - (x + 0.5) * p, v_m: v - (y + 0.5) * q }
    }

    /// A uniform number in [0, 1) for a cell. Changed cells have another one in each epoch.
    fn chance(&self, x: i32, y: i32, salt: u32, epoch: u32) -> f64 {
        let unit = |seed: u32| f64::from(cell_hash(x, y, seed)) / 2f64.powi(32);
        let is_changed = unit(self.seed ^ 0x51ED_270B) < self.changed;
        let seed = if is_changed { self.seed ^ epoch.wrapping_mul(0x9E37_79B9) } else { self.seed };
        unit(seed.wrapping_add(salt.wrapping_mul(0x632B_E5AB)))
    }

    /// The element of a cell; `None` where it is missing.
    fn element(&self, x: i32, y: i32, epoch: u32) -> Option<Element> {
        if self.chance(x, y, 1, epoch) < self.missing {
            return None;
        }
        let reach_m = self.jitter * self.period_m[0].min(self.period_m[1]);
        let shift = |salt| (2.0 * self.chance(x, y, salt, epoch) - 1.0) * reach_m;
        let levels = f64::from(self.tones.max(2) - 1);
        Some(Element {
            shift_m: [shift(2), shift(3)],
            size: 1.0 - 2.0 * self.jitter * self.chance(x, y, 4, epoch),
            tone: (self.chance(x, y, 5, epoch) * f64::from(self.tones)).floor() / levels,
        })
    }

    /// Rows along the second axis. Its period is the length of a segment, which can be missing.
    fn row_ink(&self, cell: &Cell, epoch: u32) -> f64 {
        if self.element(cell.x, cell.y, epoch).is_none() {
            return 0.0;
        }
        let [p, q] = self.period_m;
        // A whole row is displaced, not a segment of it.
        let shift_m = (2.0 * self.chance(cell.x, 0, 2, epoch) - 1.0) * self.jitter * p;
        let u_m = cell.u_m - shift_m;
        match self.kind {
            PatternKind::Waves => 0.5 + 0.5 * (TAU * u_m / p).cos(),
            // Headlands at the ends of the segments, and a track every `tones + 4` rows.
            PatternKind::Vineyard if cell.v_m.abs() > 0.5 * q - p => 0.0,
            PatternKind::Vineyard if cell.x.rem_euclid(self.tones as i32 + 4) == 0 => 0.0,
            _ => f64::from(u8::from(u_m.abs() < 0.5 * self.fill * p)),
        }
    }

    fn disc_ink(&self, cell: &Cell, epoch: u32) -> f64 {
        let Some(element) = self.element(cell.x, cell.y, epoch) else { return 0.0 };
        let shorter_m = self.period_m[0].min(self.period_m[1]);
        let is_pivot = self.kind == PatternKind::Pivots;
        let (radius_m, shift_m) = if is_pivot {
            (0.47 * shorter_m, [0.0; 2])
        } else {
            (0.5 * self.fill * shorter_m * element.size, element.shift_m)
        };
        let r = (cell.u_m - shift_m[0]).hypot(cell.v_m - shift_m[1]) / radius_m;
        match self.kind {
            _ if r >= 1.0 => 0.0,
            PatternKind::Orchard => 1.0 - 0.6 * r * r,
            PatternKind::Pivots => 0.25 + 0.75 * element.tone,
            _ => 1.0,
        }
    }

    fn rectangle_ink(&self, cell: &Cell, epoch: u32) -> f64 {
        let [p, q] = self.period_m;
        if self.kind == PatternKind::SolarRows {
            // The first period is the distance of the rows.
            let is_panel = cell.u_m.abs() < 0.5 * self.fill * p && cell.v_m.abs() < 0.5 * q - 0.3 * p;
            return if is_panel { self.element(cell.x, cell.y, epoch).map_or(0.0, |_| 1.0) } else { 0.0 };
        }
        // A street runs between the rows 2 k and 2 k + 1.
        let to_street_m = if cell.y.rem_euclid(2) == 0 { 0.5 * q - cell.v_m } else { 0.5 * q + cell.v_m };
        if to_street_m < 0.12 * q {
            return 0.5;
        }
        let Some(element) = self.element(cell.x, cell.y, epoch) else { return 0.0 };
        let (u, v) = (cell.u_m - element.shift_m[0], cell.v_m - element.shift_m[1]);
        let half = 0.45 * self.fill * element.size;
        let is_house = u.abs() < half * p && v.abs() < 0.8 * half * q;
        if is_house { 0.7 + 0.3 * element.tone } else { 0.0 }
    }

    /// Cells that touch, with lines between them.
    fn tiled_ink(&self, cell: &Cell, epoch: u32) -> f64 {
        let [p, q] = self.period_m;
        let line_m = 0.5 * 0.3 * self.fill * p.min(q);
        let is_line = cell.u_m.abs() > 0.5 * p - line_m || cell.v_m.abs() > 0.5 * q - line_m;
        let tone = || self.element(cell.x, cell.y, epoch).map_or(0.0, |e| e.tone);
        match self.kind {
            PatternKind::Parcels => {
                if is_line {
                    0.0
                } else {
                    0.2 + 0.8 * tone()
                }
            }
            PatternKind::Streets => {
                if is_line {
                    1.0
                } else {
                    0.3 * tone()
                }
            }
            _ => {
                if is_line {
                    0.0
                } else {
                    0.75 + 0.25 * tone()
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn exact(kind: PatternKind) -> RepeatingPattern {
        let drawn = RepeatingPattern::random(kind, 40.0, &mut ChaCha8Rng::seed_from_u64(7));
        RepeatingPattern { jitter: 0.0, missing: 0.0, tones: 1, ..drawn }
    }

    #[test]
    fn repeats_exactly_without_defects() {
        for kind in PatternKind::ALL.into_iter().filter(|k| *k != PatternKind::Hatch) {
            let pattern = exact(kind);
            let (sin, cos) = pattern.angle_rad.sin_cos();
            // Whole periods that also repeat tracks (every 5th row), stagger and streets (every 2nd row), and checkers.
            let (a, b) = (10.0 * pattern.period_m[0], 2.0 * pattern.period_m[1]);
            let equal = (0..400).filter(|i| {
                let at = [3.7 * f64::from(*i), -2.3 * f64::from(*i)];
                let moved = [at[0] + a * cos - b * sin, at[1] + a * sin + b * cos];
                (pattern.ink_at(at, 1) - pattern.ink_at(moved, 2)).abs() < 1e-6
            });
            assert!(equal.count() >= 398, "{kind:?}");
        }
    }

    #[test]
    fn has_ink_and_ground() {
        for kind in PatternKind::ALL {
            let pattern = RepeatingPattern::random(kind, 40.0, &mut ChaCha8Rng::seed_from_u64(3));
            let inks: Vec<f64> =
                (0..4000).map(|i| pattern.ink_at([f64::from(i % 63) * 7.0, f64::from(i / 63) * 7.0], 0)).collect();
            assert!(inks.iter().all(|i| (0.0..=1.0).contains(i)), "{kind:?}");
            let mean = inks.iter().sum::<f64>() / 4000.0;
            assert!((0.05..0.95).contains(&mean), "{kind:?} {mean}");
        }
    }

    #[test]
    fn defects_change_with_the_epoch_by_the_stated_share() {
        let pattern = RepeatingPattern { missing: 0.5, changed: 0.4, ..exact(PatternKind::Dots) };
        let gone = |x: i32, epoch| pattern.element(x, x / 7, epoch).is_none();
        let differing = (0..5000).filter(|&x| gone(x, 1) != gone(x, 2)).count();
        // Of 40 % changed elements half differ.
        assert!((differing as f64 / 5000.0 - 0.2).abs() < 0.03, "{differing}");
        let same = RepeatingPattern { changed: 0.0, ..pattern };
        assert!((0..5000).all(|x| same.element(x, x / 7, 1).is_none() == same.element(x, x / 7, 2).is_none()));
    }
}
