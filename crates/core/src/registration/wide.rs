//! Wide search: a frame's cells against the cells of a whole layer.
//!
//! [`scan`] compares every template with every place of a map of merged cells and keeps the best matches; [`CellRefiner`]
//! scores one of them again on the unmerged cells around. Scores are, as in [`super::coarse`], sums of products over the
//! square root of a sum of energies; here over all cells around a place, since the templates have zero mean.

use super::cell_dots::{COLUMNS_STEP, ROWS_STEP, TemplateCell, cell_dots};
pub use super::cell_template::{CellTemplate, CellView};
use crate::feature::{CELL_ZERO, CELLS, CellMap, CellWindow};
use crate::simd::dispatch;
use std::cmp::Ordering;

/// Largest distance of a cell of a [`scan`] template from the template's middle, cells.
pub const SCAN_HALF: usize = 7;
/// Half edge of the square around a place whose energy normalises the scores of all templates: a frame's edge has 10 to 15
/// cells. With a square much smaller than the template, dull ground beside bold edges outscores the right place.
const ENERGY_HALF: usize = 5;
/// The energy of a place counts as at least this share of the map's mean energy.
const LEAST_ENERGY_SHARE: f32 = 0.1;
/// Local maxima are taken over every sixth template: neighbours in heading keep maxima of their own, for on few cells a grid
/// of roads fits as well a step of heading away.
const TEMPLATE_GROUPS: usize = 6;

/// A template laid on a place of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellMatch {
    /// Column and row of the cell under the template's middle.
    pub cell: [i64; 2],
    /// Index of the template.
    pub template: usize,
    /// Score, higher is better.
    pub score: f32,
}

impl CellMatch {
    /// Best first, a total order: neither threads nor the order of the blocks change the result.
    fn order(&self, other: &Self) -> Ordering {
        other.score.total_cmp(&self.score).then(self.cell.cmp(&other.cell)).then(self.template.cmp(&other.template))
    }
}

/// Result of a scan.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scan {
    /// The best matches, best first, each a local maximum; a place may occur under several headings.
    pub matches: Vec<CellMatch>,
    /// Number of cells on which templates' middles were laid.
    pub cells: usize,
}

/// Lays every template on every known cell of `blocks` and returns the `most` best local maxima among those that `accepts`
/// admits, given the cell under the template's middle and the template's index. Templates reach [`SCAN_HALF`] cells at most.
pub fn scan(
    map: &CellMap,
    blocks: &[[i64; 2]],
    templates: &[CellTemplate],
    most: usize,
    threads: usize,
    accepts: &(dyn Fn([i64; 2], usize) -> bool + Sync),
) -> Scan {
    let laid: Vec<LaidTemplate> = templates.iter().map(LaidTemplate::new).collect();
    let work = |blocks: &[[i64; 2]]| {
        let mut found = Scan::default();
        // Scores up to this cannot be among the best.
        let mut least = 0.0;
        for &block in blocks {
            let window = BlockWindow::new(map, block);
            found.cells += window.compared;
            for group in 0..TEMPLATE_GROUPS.min(laid.len()) {
                let best = window.compare(laid.iter().enumerate().skip(group).step_by(TEMPLATE_GROUPS));
                let maxima = best.maxima(block, least).filter(|found| accepts(found.cell, found.template));
                found.matches.extend(maxima);
            }
            if found.matches.len() > 4 * most {
                keep_best(&mut found.matches, most);
                least = found.matches.last().map_or(least, |p| p.score);
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
            all.matches.extend(part.matches);
        }
    });
    keep_best(&mut all.matches, most);
    all
}

fn keep_best(matches: &mut Vec<CellMatch>, most: usize) {
    if matches.len() > most && most > 0 {
        matches.select_nth_unstable_by(most - 1, CellMatch::order);
    }
    matches.truncate(most);
    matches.sort_by(CellMatch::order);
}

/// Edge of the window of a block, cells: the block, the reach of a template on both sides, and lanes loaded beyond.
const SCAN_WIDTH: usize = CELLS + 2 * (SCAN_HALF + 1);

/// A template laid out for the window of a block.
struct LaidTemplate {
    cells: Vec<TemplateCell>,
    /// Sum of products with a window of zeros, each of which is stored as [`CELL_ZERO`].
    zero: i32,
    scale: f32,
}

impl LaidTemplate {
    fn new(template: &CellTemplate) -> Self {
        let zero = i32::from(CELL_ZERO) * template.total();
        Self { cells: template.laid_out(SCAN_WIDTH, SCAN_HALF), zero, scale: template.norm().sqrt().recip() }
    }
}

/// A block and the cells around.
struct BlockWindow {
    window: CellWindow,
    /// For each place one over the square root of the energy around; 0 where the cell is unknown.
    weights: Vec<f32>,
    compared: usize,
}

impl BlockWindow {
    fn new(map: &CellMap, block: [i64; 2]) -> Self {
        let [left, top] = block.map(|b| b * CELLS as i64 - SCAN_HALF as i64);
        let mut window = CellWindow::new(SCAN_WIDTH, SCAN_WIDTH);
        map.cut(left, top, &mut window);
        let around = 2 * ENERGY_HALF + 1;
        let least = (LEAST_ENERGY_SHARE * map.mean_energy() * (around * around) as f32).max(1.0);
        let mut weights = vec![0.0; CELLS * CELLS];
        energy_weights(&window.energies, least, &mut weights);
        let compared = weights.iter().filter(|&&w| w > 0.0).count();
        Self { window, weights, compared }
    }

    /// The best of some templates at every place.
    fn compare<'a>(&self, templates: impl Iterator<Item = (usize, &'a LaidTemplate)>) -> BestTemplates {
        let count = CELLS * CELLS;
        let mut best = BestTemplates { scores: vec![0.0; count], templates: vec![0; count] };
        let mut sums = vec![0; count];
        for (index, laid) in templates {
            cell_dots(&self.window.cells, SCAN_WIDTH, &laid.cells, CELLS, &mut sums);
            keep_better(&mut best, &sums, index as u32, laid);
        }
        best.scores.iter_mut().zip(&self.weights).for_each(|(score, weight)| *score *= weight);
        best
    }
}

/// The best template of every place of one block.
struct BestTemplates {
    scores: Vec<f32>,
    templates: Vec<u32>,
}

dispatch! {
    fn keep_better(best: &mut BestTemplates, sums: &[i32], index: u32, laid: &LaidTemplate) {
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
    /// Writes for each place of a block one over the square root of the energy around, counted as at least `least`; 0 where
    /// the cell is unknown.
    fn energy_weights(energies: &[u8], least: f32, weights: &mut [f32]) {
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
    /// Writes for each place of a block the highest score among the place and its neighbours within the block.
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

impl BestTemplates {
    /// The places with a score above `least` (at least 0) that no neighbour within the block exceeds.
    fn maxima(&self, block: [i64; 2], least: f32) -> impl Iterator<Item = CellMatch> + '_ {
        let mut highest = vec![0.0; self.scores.len()];
        highest_around(&self.scores, &mut highest);
        (0..self.scores.len()).filter_map(move |i| {
            let score = self.scores[i];
            let cell = [block[0] * CELLS as i64 + (i % CELLS) as i64, block[1] * CELLS as i64 + (i / CELLS) as i64];
            let template = self.templates[i] as usize;
            (score > least && score >= highest[i]).then_some(CellMatch { cell, template, score })
        })
    }
}

/// Scores matches again on unmerged cells, with templates that differ little.
pub struct CellRefiner {
    reach: usize,
    half: usize,
    templates: Vec<(CellTemplate, Vec<TemplateCell>)>,
    /// The cells of the first template, which stand for those of all.
    mask: Vec<TemplateCell>,
    window: CellWindow,
    energies: Vec<[u8; 4]>,
    sums: Vec<i32>,
    energy: Vec<i32>,
}

impl CellRefiner {
    /// Makes a refiner of templates, the most likely first, that reach `half` cells at most and are laid within `reach` (at
    /// most 7) cells of a place. `None` where there is no template.
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

    /// The best match around a cell of an unmerged map. The score is normalised by the energy of the very cells that the
    /// template covers.
    pub fn refine(&mut self, map: &CellMap, cell: [i64; 2]) -> Option<CellMatch> {
        let Self { reach, half, templates, mask, window, energies, sums, energy } = self;
        let (places, width) = (2 * *reach + 1, COLUMNS_STEP + 2 * *half);
        let [left, top] = cell.map(|c| c - (*reach + *half) as i64);
        map.cut(left, top, window);
        energies.iter_mut().zip(&window.energies).for_each(|(to, &e)| to[0] = e);
        cell_dots(energies, width, mask, COLUMNS_STEP, energy);
        let least = (LEAST_ENERGY_SHARE * map.mean_energy() * mask.len() as f32).max(1.0);
        let mut best: Option<CellMatch> = None;
        for (index, (template, laid)) in templates.iter().enumerate() {
            cell_dots(&window.cells, width, laid, COLUMNS_STEP, sums);
            let zero = i32::from(CELL_ZERO) * template.total();
            let scale = template.norm().sqrt().recip();
            for (x, y) in (0..places).flat_map(|y| (0..places).map(move |x| (x, y))) {
                let i = y * COLUMNS_STEP + x;
                let score = (sums[i] - zero) as f32 * scale / (energy[i] as f32).max(least).sqrt();
                if best.is_none_or(|b| score > b.score) {
                    let cell = [cell[0] + x as i64 - *reach as i64, cell[1] + y as i64 - *reach as i64];
                    best = Some(CellMatch { cell, template: index, score });
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::{CELL_PX, Structure, describe_cells};
    use crate::pixels::{Gray, Mask};

    const EDGE_PX: usize = CELLS * CELL_PX;

    /// Fields, each ploughed in a direction of its own; every tile has others.
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
        CellView::new(&Structure::new(&gray, &mask), &mask, [140.0, 105.0]).unwrap()
    }

    fn world() -> CellMap {
        let blob = |seed: u32| {
            let cells = describe_cells(&ground(seed), &Mask::filled(EDGE_PX, EDGE_PX, true));
            cells.into_iter().map(|v| v as u8).collect::<Vec<u8>>()
        };
        CellMap::from_tiles((0..20).map(|i| ([100 + i % 5, 200 + i / 5], blob(i))).collect())
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
        assert!(off(found.matches[0].cell, 32.0) < 32.0, "{:?}", found.matches[0]);
        assert!((steps[found.matches[0].template] - heading_rad).abs() < 0.2);
        assert!(found.cells > 19 * 256);
        for threads in [2, 3, 7] {
            assert_eq!(scan(&merged, merged.blocks(), &templates, 50, threads, &|_, _| true), found);
        }
        let mut refiner = CellRefiner::new(vec![view.template(heading_rad, 1.0, 16.0, 16).unwrap()], 2, 16).unwrap();
        let best = refiner.refine(&fine, found.matches[0].cell.map(|c| 2 * c + 1)).unwrap();
        assert!(off(best.cell, 16.0) < 16.0 && best.score > found.matches[0].score, "{best:?}");
    }

    #[test]
    fn returns_only_accepted_places() {
        let merged = world().merged(2);
        let view = seen(&ground(3), [250.0, 250.0], 0.0);
        let template = view.template(0.0, 1.0, 32.0, SCAN_HALF).unwrap();
        let west = |cell: [i64; 2], _| cell[0] < 102 * 16;
        let found = scan(&merged, merged.blocks(), &[template], 20, 2, &west);
        assert!(!found.matches.is_empty() && found.matches.iter().all(|p| p.cell[0] < 102 * 16));
    }
}
