//! Paired comparison: does a view fit one place of the map better than another?
//!
//! Ground that repeats itself has many places that fit almost alike. How high one correlation peak stands does not tell them
//! apart, for whatever raises one raises all. The difference does: both places are compared with the same pixels of the frame, so
//! everything that they share cancels. Its standard error comes from the ground itself: the view is cut into blocks, and each
//! is left out once (the jackknife). On a lattice every block prefers either place by chance, and the difference stays within a
//! few standard errors; on unique ground almost all blocks prefer the right place.
//!
//! Blocks lie in the camera's own axes, so places under different headings and scales are compared by the same ground too.
//!
//! # References
//! Efron, Stein, the jackknife and its variance, Annals of Statistics 9, 1981.

use super::products::{CHANNELS_SCALE, ENERGIES_SCALE};
use crate::feature::Structure;

/// Edge of a cell, view pixels: the grain at which the ground common to both places is told.
const CELL_PX: f64 = 4.0;
/// Cells along the edge of a block. Blocks of 16 px are farther apart than structure is correlated with itself.
const BLOCK_CELLS: i32 = 4;
/// A block whose energy is below this share of the median block's is left out: dividing by its absence proves nothing.
const LEAST_BLOCK_SHARE: f64 = 0.05;
/// Fewer blocks give no standard error.
const MIN_BLOCKS: usize = 4;

/// Where a view lies on a map: everything that sets the products of both.
#[derive(Debug, Clone, Copy)]
pub struct Placement<'a> {
    /// Structure of the view, seen under the heading and scale of the place.
    pub view: &'a Structure,
    /// The nadir, pixels from the view's corner; it may lie outside.
    pub nadir_px: [f64; 2],
    /// Heading, radians clockwise from the map's north.
    pub heading_rad: f64,
    /// Scale of the view over the nominal scale.
    pub scale: f64,
    /// Structure of the map.
    pub map: &'a Structure,
    /// The map's pixel under the view's corner. The view must lie within the map.
    pub corner_px: [usize; 2],
}

/// Products of a view and the map under it, summed over cells of the camera's axes.
#[derive(Debug, Clone)]
pub struct PlacedProducts {
    first: [i32; 2],
    columns: usize,
    cells: Vec<Cell>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    /// Sum of products of channels.
    channels: i32,
    /// Sum of products of energies.
    energies: u32,
    /// Pixels with structure in the view.
    described: u16,
    /// Of these, pixels of which the map knows something.
    mapped: u16,
}

impl Cell {
    fn is_compared(self) -> bool {
        self.described > 0 && 2 * self.mapped >= self.described
    }
}

/// How much better a view fits one place than another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedDifference {
    /// T at the first place less T at the second, both over the ground that both places know.
    pub difference: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Share of the ground compared at the first place that the second knows too.
    pub overlap: f64,
    /// Blocks compared.
    pub blocks: usize,
}

impl PairedDifference {
    /// The difference in standard errors.
    pub fn t_score(&self) -> f64 {
        self.difference / self.standard_error.max(1e-12)
    }
}

impl PlacedProducts {
    /// Sums the products of a placement.
    pub fn new(placement: &Placement<'_>) -> Self {
        let Placement { view, nadir_px, map, corner_px, .. } = *placement;
        let axes = CameraAxes::new(placement);
        let corners = [[0, 0], [view.width_px, 0], [0, view.height_px], [view.width_px, view.height_px]];
        let corners = corners.map(|[x, y]| axes.cell([x as f64 - nadir_px[0], y as f64 - nadir_px[1]]));
        let least = |axis: usize| corners.iter().map(|c| c[axis].floor() as i32).min().unwrap_or(0);
        let most = |axis: usize| corners.iter().map(|c| c[axis].floor() as i32).max().unwrap_or(0);
        let first = [least(0), least(1)];
        let (columns, rows) = ((most(0) - first[0] + 1) as usize, (most(1) - first[1] + 1) as usize);
        let mut cells = vec![Cell::default(); columns * rows];
        for y in 0..view.height_px {
            let own = y * view.width_px..(y + 1) * view.width_px;
            let under = (y + corner_px[1]) * map.width_px + corner_px[0];
            let under = under..under + view.width_px;
            let pixels = view.channels[own.clone()].iter().zip(&view.energy[own]);
            let ground = map.channels[under.clone()].iter().zip(&map.energy[under]);
            for (x, ((f, &e), (m, &g))) in pixels.zip(ground).enumerate() {
                if e == 0 {
                    continue;
                }
                let at = axes.cell([x as f64 + 0.5 - nadir_px[0], y as f64 + 0.5 - nadir_px[1]]);
                // Not negative, because `first` is the least of the corners: truncation is the floor.
                let [column, row] = [0, 1].map(|axis| (at[axis] - f64::from(first[axis])) as usize);
                let Some(cell) = cells.get_mut(row * columns + column) else { continue };
                cell.channels += (0..4).map(|k| i32::from(f[k]) * i32::from(m[k])).sum::<i32>();
                cell.energies += u32::from(e) * u32::from(g);
                cell.described += 1;
                cell.mapped += u16::from(g > 0);
            }
        }
        Self { first, columns, cells }
    }

    fn cell(&self, column: i32, row: i32) -> Option<Cell> {
        let (x, y) = (column - self.first[0], row - self.first[1]);
        let is_inside = x >= 0 && y >= 0 && (x as usize) < self.columns;
        if is_inside { self.cells.get(y as usize * self.columns + x as usize).copied() } else { None }
    }

    /// Compares two placements of one frame by the ground that both know; `None` where too few blocks are left.
    pub fn compare(&self, other: &Self) -> Option<PairedDifference> {
        let rows = self.cells.len() / self.columns.max(1);
        let block_columns = (self.columns as i32 / BLOCK_CELLS + 2) as usize;
        let mut blocks = vec![Pair::default(); block_columns * (rows / BLOCK_CELLS as usize + 2)];
        let first_block = self.first.map(|c| c.div_euclid(BLOCK_CELLS));
        let (mut compared, mut common) = (0u32, 0u32);
        for (i, cell) in self.cells.iter().enumerate().filter(|(_, cell)| cell.is_compared()) {
            compared += u32::from(cell.described);
            let (column, row) = ((i % self.columns) as i32 + self.first[0], (i / self.columns) as i32 + self.first[1]);
            let Some(rival) = other.cell(column, row).filter(|c| c.is_compared()) else { continue };
            common += u32::from(cell.described);
            let x = (column.div_euclid(BLOCK_CELLS) - first_block[0]) as usize;
            let y = (row.div_euclid(BLOCK_CELLS) - first_block[1]) as usize;
            blocks[y * block_columns + x].add(*cell, rival);
        }
        let blocks = strong_blocks(blocks);
        let (difference, standard_error) = jackknife(&blocks)?;
        let overlap = f64::from(common) / f64::from(compared.max(1));
        Some(PairedDifference { difference, standard_error, overlap, blocks: blocks.len() })
    }
}

/// Takes offsets from the nadir, view pixels, to the camera's axes (right, ahead), cells.
struct CameraAxes {
    sin: f64,
    cos: f64,
}

impl CameraAxes {
    fn new(placement: &Placement<'_>) -> Self {
        let (sin, cos) = placement.heading_rad.sin_cos();
        let per_cell = placement.scale * CELL_PX;
        Self { sin: sin / per_cell, cos: cos / per_cell }
    }

    fn cell(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.cos + y * self.sin, x * self.sin - y * self.cos]
    }
}

/// The sums of both places over one block, in units of 1.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    channels: [f64; 2],
    energies: [f64; 2],
}

impl Pair {
    fn add(&mut self, first: Cell, second: Cell) {
        for (k, cell) in [first, second].into_iter().enumerate() {
            self.channels[k] += f64::from(cell.channels) / CHANNELS_SCALE;
            self.energies[k] += f64::from(cell.energies) / ENERGIES_SCALE;
        }
    }

    fn energy(&self) -> f64 {
        self.energies[0] + self.energies[1]
    }
}

fn strong_blocks(mut blocks: Vec<Pair>) -> Vec<Pair> {
    let mut energies: Vec<f64> = blocks.iter().map(Pair::energy).filter(|e| *e > 0.0).collect();
    energies.sort_by(f64::total_cmp);
    let least = LEAST_BLOCK_SHARE * energies.get(energies.len() / 2).copied().unwrap_or(0.0);
    blocks.retain(|block| block.energy() > least);
    blocks
}

/// The difference of T between both places, and its standard error by leaving out one block at a time.
fn jackknife(blocks: &[Pair]) -> Option<(f64, f64)> {
    let n = blocks.len();
    let total = |pick: fn(&Pair) -> f64| blocks.iter().map(pick).sum::<f64>();
    let channels = [total(|b| b.channels[0]), total(|b| b.channels[1])];
    let energies = [total(|b| b.energies[0]), total(|b| b.energies[1])];
    if n < MIN_BLOCKS || energies[0] <= 0.0 || energies[1] <= 0.0 {
        return None;
    }
    let difference = |c: [f64; 2], e: [f64; 2]| c[0] / e[0].max(1e-9).sqrt() - c[1] / e[1].max(1e-9).sqrt();
    let without = |b: &Pair| {
        let less = |all: [f64; 2], one: [f64; 2]| [all[0] - one[0], all[1] - one[1]];
        difference(less(channels, b.channels), less(energies, b.energies))
    };
    let left: Vec<f64> = blocks.iter().map(without).collect();
    let mean = left.iter().sum::<f64>() / n as f64;
    let squares = left.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
    Some((difference(channels, energies), ((n - 1) as f64 / n as f64 * squares).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixels::{Gray, Mask};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Ground of 360 x 160 px, and a view of it with noise of its own. `repeats`: the right half shows the left half again, but
    /// for noise.
    fn ground(repeats: bool) -> [Gray; 2] {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let blobs: Vec<f32> = (0..36 * 16).map(|_| rng.random_range(0.0..200.0)).collect();
        let value = |x: usize, y: usize| blobs[(y / 10) * 36 + if repeats { x % 180 } else { x } / 10];
        [(); 2].map(|()| {
            let noisy = (0..360 * 160).map(|i| value(i % 360, i / 360) + rng.random_range(0.0..30.0)).collect();
            Gray::from_values(360, 160, noisy).unwrap()
        })
    }

    fn compared(repeats: bool) -> PairedDifference {
        let [map, frame] = ground(repeats);
        let map = Structure::new(&map, &Mask::filled(360, 160, true));
        let cut = (0..120 * 100).map(|i| frame.at(20 + i % 120, 30 + i / 120)).collect();
        let view = Structure::new(&Gray::from_values(120, 100, cut).unwrap(), &Mask::filled(120, 100, true));
        let at = |x: usize| {
            PlacedProducts::new(&Placement {
                view: &view,
                nadir_px: [60.0, 50.0],
                heading_rad: 0.4,
                scale: 1.0,
                map: &map,
                corner_px: [x, 30],
            })
        };
        at(20).compare(&at(200)).unwrap()
    }

    #[test]
    fn unique_ground_is_far_from_its_rival_and_repeated_ground_is_not() {
        let (unique, repeated) = (compared(false), compared(true));
        assert!(unique.t_score() > 8.0, "{unique:?}");
        assert!(repeated.t_score().abs() < 3.0, "{repeated:?}");
        assert!(unique.overlap > 0.95);
    }

    #[test]
    fn a_place_does_not_differ_from_itself_under_another_heading_of_the_same_ground() {
        // A view turned with the map is the same comparison: the blocks lie in the camera's axes.
        let [map, frame] = ground(false);
        let quarter = |g: &Gray| {
            let (w, h) = (g.width_px(), g.height_px());
            Gray::from_values(h, w, (0..w * h).map(|i| g.at(i / h, h - 1 - i % h)).collect()).unwrap()
        };
        let described = |g: &Gray| Structure::new(g, &Mask::filled(g.width_px(), g.height_px(), true));
        let (upright, turned) =
            ((described(&frame), described(&map)), (described(&quarter(&frame)), described(&quarter(&map))));
        let first = PlacedProducts::new(&Placement {
            view: &upright.0,
            nadir_px: [180.0, 80.0],
            heading_rad: 0.0,
            scale: 1.0,
            map: &upright.1,
            corner_px: [0, 0],
        });
        let second = PlacedProducts::new(&Placement {
            view: &turned.0,
            nadir_px: [80.0, 180.0],
            heading_rad: std::f64::consts::FRAC_PI_2,
            scale: 1.0,
            map: &turned.1,
            corner_px: [0, 0],
        });
        let difference = first.compare(&second).unwrap();
        assert!(difference.difference.abs() < 0.02 && difference.overlap > 0.97, "{difference:?}");
    }

    #[test]
    fn the_standard_error_is_that_of_a_mean_where_blocks_weigh_alike() {
        // With equal energies T is the sum over the root of the count, so the jackknife is exact.
        let values = [1.0, 3.0, 2.0, 6.0, 4.0];
        let blocks: Vec<Pair> = values.iter().map(|&v| Pair { channels: [v, 0.0], energies: [1.0, 1.0] }).collect();
        let (difference, error) = jackknife(&blocks).unwrap();
        assert!((difference - 16.0 / 5f64.sqrt()).abs() < 1e-12);
        let mean = 3.2;
        let spread = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        // Leaving out one changes T by about (v - mean / 2) / root n; the mean's own part cancels in the differences.
        let expected = (4.0 / 5.0 * spread / 4.0).sqrt();
        assert!((error / expected - 1.0).abs() < 1e-9, "{error} {expected}");
        assert_eq!(jackknife(&blocks[..3]), None);
    }
}
