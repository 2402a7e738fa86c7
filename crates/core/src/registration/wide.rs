//! Wide search: a frame's cells against the cells of a whole layer.
//!
//! [`scan`] compares every template with every place of a map of merged cells and keeps the best places; [`Closer`]
//! weighs one of them on the unmerged cells around it. Scores are, as in [`super::coarse`], sums of products over the
//! square root of a sum of energies; here over all of a place's cells, since its templates have zero mean.

use super::cell_dots::{COLUMNS_STEP, ROWS_STEP, TemplateCell, cell_dots};
pub use super::cell_template::{CellTemplate, CellView};
use crate::feature::{CELL_ZERO, CELLS, CellMap, CellWindow};
use crate::simd::dispatch;
use std::cmp::Ordering;

/// Farthest cell of a template of [`scan`] from its middle.
pub const SCAN_HALF: usize = 7;
/// Around a place, the square whose energy stands for what lies under any template: a frame's edge has 10 to 15 cells. Where
/// it is much smaller than the template, dull ground beside bold edges outshines the right place.
const ENERGY_HALF: usize = 5;
/// A place with less than this share of the map's mean energy is compared as if it had that much.
const LEAST_ENERGY_SHARE: f32 = 0.1;
/// Templates so many numbers apart have their maxima in common: neighbours in heading each have their own, for on few cells a
/// grid of roads fits as well a step of heading away.
const APART: usize = 6;

/// A place found by [`scan`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Column and row of the cell under the template's middle.
    pub cell: [i64; 2],
    /// Which template.
    pub template: usize,
    /// How well it fits.
    pub score: f32,
}

impl Place {
    /// Best first; never undecided, so that neither threads nor order change what is kept.
    fn order(&self, other: &Self) -> Ordering {
        other.score.total_cmp(&self.score).then(self.cell.cmp(&other.cell)).then(self.template.cmp(&other.template))
    }
}

/// What a scan found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scan {
    /// The best places, best first, each higher than its neighbours; a place may come under several headings.
    pub places: Vec<Place>,
    /// Cells that a template's middle was laid on.
    pub cells: usize,
}

/// Lays every template on every known cell of `blocks`; keeps the `most` best local maxima of those that `holds` (a
/// cell under a template's middle) lets pass. Templates reach [`SCAN_HALF`] cells at most.
pub fn scan(
    map: &CellMap,
    blocks: &[[i64; 2]],
    templates: &[CellTemplate],
    most: usize,
    threads: usize,
    holds: &(dyn Fn([i64; 2], usize) -> bool + Sync),
) -> Scan {
    let laid: Vec<Laid> = templates.iter().map(Laid::of).collect();
    let work = |blocks: &[[i64; 2]]| {
        let mut found = Scan::default();
        // Only what cannot be among the best is passed over.
        let mut least = 0.0;
        for &block in blocks {
            let scene = Scene::of(map, block);
            found.cells += scene.compared;
            for turn in 0..APART.min(laid.len()) {
                let best = scene.compare(laid.iter().enumerate().skip(turn).step_by(APART));
                let maxima = best.maxima(block, least).filter(|place| holds(place.cell, place.template));
                found.places.extend(maxima);
            }
            if found.places.len() > 4 * most {
                keep_best(&mut found.places, most);
                least = found.places.last().map_or(least, |p| p.score);
            }
        }
        found
    };
    let share = blocks.len().div_ceil(threads.max(1)).max(1);
    let mut all = Scan::default();
    std::thread::scope(|scope| {
        let handles: Vec<_> = blocks.chunks(share).map(|chunk| scope.spawn(move || work(chunk))).collect();
        for handle in handles {
            let part = handle.join().expect("a scan does not panic");
            all.cells += part.cells;
            all.places.extend(part.places);
        }
    });
    keep_best(&mut all.places, most);
    all
}

fn keep_best(places: &mut Vec<Place>, most: usize) {
    if places.len() > most && most > 0 {
        places.select_nth_unstable_by(most - 1, Place::order);
    }
    places.truncate(most);
    places.sort_by(Place::order);
}

/// Cells along a block's edge with a template's reach on both sides, and lanes that are loaded beyond.
const SCAN_WIDTH: usize = CELLS + 2 * (SCAN_HALF + 1);

/// A template as a block's window meets it.
struct Laid {
    cells: Vec<TemplateCell>,
    /// What a window of zeros would give.
    zero: i32,
    scale: f32,
}

impl Laid {
    fn of(template: &CellTemplate) -> Self {
        let zero = i32::from(CELL_ZERO) * template.total();
        Self { cells: template.laid_out(SCAN_WIDTH, SCAN_HALF), zero, scale: template.norm().sqrt().recip() }
    }
}

/// A block and what is around it.
struct Scene {
    window: CellWindow,
    /// For each place one over the square root of the energy around; 0 where nothing is known.
    weights: Vec<f32>,
    compared: usize,
}

impl Scene {
    fn of(map: &CellMap, block: [i64; 2]) -> Self {
        let [left, top] = block.map(|b| b * CELLS as i64 - SCAN_HALF as i64);
        let mut window = CellWindow::new(SCAN_WIDTH, SCAN_WIDTH);
        map.cut(left, top, &mut window);
        let around = 2 * ENERGY_HALF + 1;
        let least = (LEAST_ENERGY_SHARE * map.mean_energy() * (around * around) as f32).max(1.0);
        let mut weights = vec![0.0; CELLS * CELLS];
        weigh(&window.energies, least, &mut weights);
        let compared = weights.iter().filter(|&&w| w > 0.0).count();
        Self { window, weights, compared }
    }

    /// The best of some templates at every place.
    fn compare<'a>(&self, templates: impl Iterator<Item = (usize, &'a Laid)>) -> Best {
        let count = CELLS * CELLS;
        let mut best = Best { scores: vec![0.0; count], templates: vec![0; count] };
        let mut sums = vec![0; count];
        for (index, laid) in templates {
            cell_dots(&self.window.cells, SCAN_WIDTH, &laid.cells, CELLS, &mut sums);
            take(&mut best, &sums, index as u32, laid);
        }
        best.scores.iter_mut().zip(&self.weights).for_each(|(score, weight)| *score *= weight);
        best
    }
}

/// The best template of every place of one block.
struct Best {
    scores: Vec<f32>,
    templates: Vec<u32>,
}

dispatch! {
    fn take(best: &mut Best, sums: &[i32], index: u32, laid: &Laid) {
        let (scores, templates) = (&mut best.scores[..sums.len()], &mut best.templates[..sums.len()]);
        let (zero, scale) = (laid.zero, laid.scale);
        for i in 0..sums.len() {
            let value = (sums[i] - zero) as f32 * scale;
            let better = value > scores[i];
            scores[i] = if better { value } else { scores[i] };
            templates[i] = if better { index } else { templates[i] };
        }
    }
}

dispatch! {
    /// For each place of a block one over the square root of the energy around, at least of `least`; 0 where its cell is
    /// unknown.
    fn weigh(energies: &[u8], least: f32, weights: &mut [f32]) {
        const INSET: usize = SCAN_HALF - ENERGY_HALF;
        let mut across = [[0u16; CELLS]; SCAN_WIDTH];
        for (row, sums) in energies.chunks_exact(SCAN_WIDTH).zip(&mut across) {
            for shift in 0..=2 * ENERGY_HALF {
                for (sum, &e) in sums.iter_mut().zip(&row[INSET + shift..][..CELLS]) {
                    *sum += u16::from(e);
                }
            }
        }
        for (y, out) in weights.chunks_exact_mut(CELLS).enumerate() {
            let mut sums = [0u16; CELLS];
            for row in &across[y + INSET..=y + INSET + 2 * ENERGY_HALF] {
                (0..CELLS).for_each(|x| sums[x] += row[x]);
            }
            let middle = &energies[(y + SCAN_HALF) * SCAN_WIDTH + SCAN_HALF..][..CELLS];
            for x in 0..CELLS {
                let weight = 1.0 / f32::from(sums[x]).max(least).sqrt();
                out[x] = if middle[x] > 0 { weight } else { 0.0 };
            }
        }
    }
}

dispatch! {
    /// The highest of each place's neighbours within the block, itself among them.
    fn highest_around(scores: &[f32], highest: &mut [f32]) {
        let mut across = [[0f32; CELLS]; CELLS + 2];
        for (row, out) in scores.chunks_exact(CELLS).zip(&mut across[1..]) {
            out.copy_from_slice(row);
            for x in 1..CELLS {
                out[x] = out[x].max(row[x - 1]);
                out[x - 1] = out[x - 1].max(row[x]);
            }
        }
        for (y, out) in highest.chunks_exact_mut(CELLS).enumerate() {
            for x in 0..CELLS {
                out[x] = across[y][x].max(across[y + 1][x]).max(across[y + 2][x]);
            }
        }
    }
}

impl Best {
    /// Places above `least`, itself at least 0, that no neighbour within the block exceeds.
    fn maxima(&self, block: [i64; 2], least: f32) -> impl Iterator<Item = Place> + '_ {
        let mut highest = vec![0.0; self.scores.len()];
        highest_around(&self.scores, &mut highest);
        (0..self.scores.len()).filter_map(move |i| {
            let score = self.scores[i];
            let cell = [block[0] * CELLS as i64 + (i % CELLS) as i64, block[1] * CELLS as i64 + (i / CELLS) as i64];
            let template = self.templates[i] as usize;
            (score > least && score >= highest[i]).then_some(Place { cell, template, score })
        })
    }
}

/// Templates that differ little, to weigh places again on unmerged cells.
pub struct Closer {
    reach: usize,
    half: usize,
    templates: Vec<(CellTemplate, Vec<TemplateCell>)>,
    /// The cells of the first, which stand for those of all.
    mask: Vec<TemplateCell>,
    window: CellWindow,
    energies: Vec<[u8; 4]>,
    sums: Vec<i32>,
    energy: Vec<i32>,
}

impl Closer {
    /// Of templates, the most likely first, that reach `half` cells at most; to be laid within `reach` (at most 7) cells of
    /// a place. `None` where there is no template.
    pub fn new(templates: Vec<CellTemplate>, reach: usize, half: usize) -> Option<Self> {
        let width = COLUMNS_STEP + 2 * half;
        let rows = (2 * reach + 1).next_multiple_of(ROWS_STEP);
        let mask = templates.first()?.mask_laid_out(width, half);
        let lay = |t: CellTemplate| {
            let laid = t.laid_out(width, half);
            (t, laid)
        };
        let window = CellWindow::new(width, rows + 2 * half);
        let energies = vec![[0; 4]; window.energies.len()];
        let templates = templates.into_iter().map(lay).collect();
        let sums = vec![0; rows * COLUMNS_STEP];
        Some(Self { reach, half, templates, mask, window, energies, energy: sums.clone(), sums })
    }

    /// The best around a cell of an unmerged map: the cell under the template's middle, the template and its score, here
    /// over the very cells that it covers.
    pub fn best(&mut self, map: &CellMap, cell: [i64; 2]) -> Option<Place> {
        let Self { reach, half, templates, mask, window, energies, sums, energy } = self;
        let (places, width) = (2 * *reach + 1, COLUMNS_STEP + 2 * *half);
        let [left, top] = cell.map(|c| c - (*reach + *half) as i64);
        map.cut(left, top, window);
        energies.iter_mut().zip(&window.energies).for_each(|(to, &e)| to[0] = e);
        cell_dots(energies, width, mask, COLUMNS_STEP, energy);
        let least = (LEAST_ENERGY_SHARE * map.mean_energy() * mask.len() as f32).max(1.0);
        let mut best: Option<Place> = None;
        for (index, (template, laid)) in templates.iter().enumerate() {
            cell_dots(&window.cells, width, laid, COLUMNS_STEP, sums);
            let zero = i32::from(CELL_ZERO) * template.total();
            let scale = template.norm().sqrt().recip();
            for (x, y) in (0..places).flat_map(|y| (0..places).map(move |x| (x, y))) {
                let i = y * COLUMNS_STEP + x;
                let score = (sums[i] - zero) as f32 * scale / (energy[i] as f32).max(least).sqrt();
                if best.is_none_or(|b| score > b.score) {
                    let cell = [cell[0] + x as i64 - *reach as i64, cell[1] + y as i64 - *reach as i64];
                    best = Some(Place { cell, template: index, score });
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::{CELL_PX, Structure, cells_of};
    use crate::pixels::{Gray, Mask};

    const EDGE_PX: usize = CELLS * CELL_PX;

    /// Fields ploughed each in its own direction, others in each tile.
    fn ground(seed: u32) -> Gray {
        let hash = |x: u32, y: u32, k: u32| {
            let mut v =
                x.wrapping_mul(374_761_393) ^ y.wrapping_mul(668_265_263) ^ (seed * 31 + k).wrapping_mul(69_069);
            v = (v ^ (v >> 13)).wrapping_mul(1_274_126_177);
            (v ^ (v >> 16)) % 200
        };
        let pixel = |i: usize| {
            let (x, y) = ((i % EDGE_PX) as u32, (i / EDGE_PX) as u32);
            let angle = hash(x / 70, y / 55, 1) as f64 / 200.0 * std::f64::consts::PI;
            let along = f64::from(x) * angle.cos() + f64::from(y) * angle.sin();
            (100.0 + 60.0 * (0.5 * along).sin()) as f32
        };
        Gray::from_values(EDGE_PX, EDGE_PX, (0..EDGE_PX * EDGE_PX).map(pixel).collect()).unwrap()
    }

    /// A view turned by `heading_rad` of the ground around a point.
    fn seen(ground: &Gray, at: [f64; 2], heading_rad: f64) -> CellView {
        let (width, height) = (280, 210);
        let (sin, cos) = heading_rad.sin_cos();
        let pixel = |i: usize| {
            let (x, y) = ((i % width) as f64 + 0.5 - 140.0, (i / width) as f64 + 0.5 - 105.0);
            ground.sample(at[0] + x * cos - y * sin, at[1] + x * sin + y * cos)
        };
        let gray = Gray::from_values(width, height, (0..width * height).map(pixel).collect()).unwrap();
        let mask = Mask::filled(width, height, true);
        CellView::of(&Structure::of(&gray, &mask), &mask, [140.0, 105.0]).unwrap()
    }

    fn world() -> CellMap {
        let blob = |seed: u32| {
            let cells = cells_of(&ground(seed), &Mask::filled(EDGE_PX, EDGE_PX, true));
            cells.into_iter().map(|v| v as u8).collect::<Vec<u8>>()
        };
        CellMap::of_tiles((0..20).map(|i| ([100 + i % 5, 200 + i / 5], blob(i))).collect())
    }

    #[test]
    fn a_view_is_found_among_many_tiles_whatever_its_heading_and_the_threads() {
        let fine = world();
        let merged = fine.merged(2);
        let (tile, at, heading_rad) = (13u32, [270.0, 230.0], 2.0);
        let view = seen(&ground(tile), at, heading_rad);
        let steps: Vec<f64> = (0..40).map(|i| f64::from(i) * std::f64::consts::TAU / 40.0).collect();
        let templates: Vec<_> = steps.iter().map(|&h| view.template(h, 1.0, 32.0, SCAN_HALF).unwrap()).collect();
        let found = scan(&merged, merged.blocks(), &templates, 50, 1, &|_, _| true);
        let true_px = [(100 + tile % 5) as f64 * 512.0 + at[0], (200 + tile / 5) as f64 * 512.0 + at[1]];
        let off = |cell: [i64; 2], pitch_px: f64| {
            let d = |i: usize| (cell[i] as f64 + 0.5) * pitch_px - true_px[i];
            d(0).hypot(d(1))
        };
        assert!(off(found.places[0].cell, 32.0) < 32.0, "{:?}", found.places[0]);
        assert!((steps[found.places[0].template] - heading_rad).abs() < 0.2);
        assert!(found.cells > 19 * 256);
        for threads in [2, 3, 7] {
            assert_eq!(scan(&merged, merged.blocks(), &templates, 50, threads, &|_, _| true), found);
        }
        let mut closer = Closer::new(vec![view.template(heading_rad, 1.0, 16.0, 16).unwrap()], 2, 16).unwrap();
        let best = closer.best(&fine, found.places[0].cell.map(|c| 2 * c + 1)).unwrap();
        assert!(off(best.cell, 16.0) < 16.0 && best.score > found.places[0].score, "{best:?}");
    }

    #[test]
    fn keeps_to_what_holds() {
        let merged = world().merged(2);
        let view = seen(&ground(3), [250.0, 250.0], 0.0);
        let template = view.template(0.0, 1.0, 32.0, SCAN_HALF).unwrap();
        let west = |cell: [i64; 2], _| cell[0] < 102 * 16;
        let found = scan(&merged, merged.blocks(), &[template], 20, 2, &west);
        assert!(!found.places.is_empty() && found.places.iter().all(|p| p.cell[0] < 102 * 16));
    }
}
