//! The coarse search: the frame under every heading and scale left open, over every place left open.

use super::area::SearchArea;
use super::map::{Map, PixelWindow};
use super::pose::{Frame, Pose, structure_of};
use super::request::LocateError;
use crate::feature::Structure;
use crate::registration::coarse::{CoarseMap, Surface};
use crate::store::StoreError;
use crate::tile::{Gsd, WorldPixel};

/// A heading and a scale to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Radians clockwise from north.
    pub heading_rad: f64,
    /// True height over stated height.
    pub height_ratio: f64,
}

/// A place where the frame may lie.
#[derive(Debug, Clone, Copy)]
pub struct Peak {
    /// Where and how.
    pub pose: Pose,
    /// T there.
    pub statistic: f64,
}

/// What the coarse search found.
#[derive(Debug, Clone, Default)]
pub struct CoarseResult {
    /// The best places, best first, none within a few pixels of a better one.
    pub peaks: Vec<Peak>,
    /// Mean of T over everything searched.
    pub mean: f64,
    /// Standard deviation of T over everything searched.
    pub deviation: f64,
    /// Places, headings and scales compared.
    pub places: f64,
}

impl CoarseResult {
    /// A statistic in standard deviations of the surface.
    pub fn score(&self, statistic: f64) -> f64 {
        if self.deviation > 0.0 { (statistic - self.mean) / self.deviation } else { 0.0 }
    }
}

/// Edge of one correlated block of places: bounds memory and keeps the ground scale constant within.
pub const BLOCK_PX: i64 = 512;
/// Surfaces held at once: a full turn under a vague height has thousands.
const BATCH: usize = 64;
/// Peaks kept.
const PEAKS: usize = 8;

/// Sums over surfaces, and the best of every place.
struct Tally {
    sum: f64,
    sum_squares: f64,
    count: f64,
    peaks: Vec<Peak>,
}

/// Searches `area` at its zoom, while `wanted` (asked before each block). `frame` must be prepared for that zoom.
///
/// # Errors
/// Where the store cannot give a tile; [`LocateError::GivenUp`].
pub fn search(
    map: &mut Map<'_>,
    frame: &Frame<'_>,
    area: &SearchArea,
    hypotheses: &[Hypothesis],
    threads: usize,
    wanted: &dyn Fn() -> bool,
) -> Result<CoarseResult, LocateError> {
    let mut tally = Tally { sum: 0.0, sum_squares: 0.0, count: 0.0, peaks: Vec::new() };
    for block in area.blocks(BLOCK_PX) {
        if !wanted() {
            return Err(LocateError::GivenUp);
        }
        search_block(map, frame, area, &block, hypotheses, threads, &mut tally)?;
    }
    let mean = if tally.count > 0.0 { tally.sum / tally.count } else { 0.0 };
    let variance = if tally.count > 0.0 { tally.sum_squares / tally.count - mean * mean } else { 0.0 };
    let peaks = distinct(tally.peaks, area.zoom());
    Ok(CoarseResult { peaks, mean, deviation: variance.max(0.0).sqrt(), places: tally.count })
}

/// A view of one hypothesis, ready to be correlated.
struct Template {
    hypothesis: Hypothesis,
    structure: Structure,
    nadir_px: [i64; 2],
}

fn search_block(
    map: &mut Map<'_>,
    frame: &Frame<'_>,
    area: &SearchArea,
    block: &PixelWindow,
    hypotheses: &[Hypothesis],
    threads: usize,
    tally: &mut Tally,
) -> Result<(), StoreError> {
    let gsd = area.gsd_of(block);
    let templates = templates(frame, block.zoom, gsd, hypotheses);
    let reach = |pick: fn(&Template) -> i64| templates.iter().map(pick).max().unwrap_or(0);
    let left = reach(|t| t.nadir_px[0]);
    let top = reach(|t| t.nadir_px[1]);
    let right = reach(|t| t.structure.width_px as i64 - t.nadir_px[0]);
    let bottom = reach(|t| t.structure.height_px as i64 - t.nadir_px[1]);
    if templates.is_empty() {
        return Ok(());
    }
    // A camera so tilted that it does not see its nadir still needs the nadirs' own block inside.
    let (left, top, right, bottom) = (left.max(0), top.max(0), right.max(1), bottom.max(1));
    let window = PixelWindow {
        zoom: block.zoom,
        left: block.left - left,
        top: block.top - top,
        width_px: block.width_px + (left + right) as usize,
        height_px: block.height_px + (top + bottom) as usize,
    };
    let (gray, mask) = map.window(&window)?;
    let structure = Structure::of(&gray, &mask);
    if structure.total_energy() <= 0.0 {
        return Ok(());
    }
    let coarse = CoarseMap::new(&structure);
    let mut best = vec![(f32::NEG_INFINITY, 0usize); block.width_px * block.height_px];
    for (batch, some) in templates.chunks(BATCH).enumerate() {
        let surfaces = correlate_all(&coarse, some, threads);
        for (within, (template, surface)) in some.iter().zip(&surfaces).enumerate() {
            let Some(surface) = surface else { continue };
            let offset = [(left - template.nadir_px[0]) as usize, (top - template.nadir_px[1]) as usize];
            accumulate(surface, offset, block, area, batch * BATCH + within, tally, &mut best);
        }
    }
    tally.peaks.extend(peaks_of(&best, block, &templates));
    Ok(())
}

fn templates(frame: &Frame<'_>, zoom: u8, gsd: Gsd, hypotheses: &[Hypothesis]) -> Vec<Template> {
    let make = |&hypothesis: &Hypothesis| {
        let view = frame.view(zoom, gsd, hypothesis.heading_rad, hypothesis.height_ratio, [0.0; 2])?;
        let nadir_px = [view.grid.nadir_px[0].round() as i64, view.grid.nadir_px[1].round() as i64];
        let structure = structure_of(&view);
        (structure.total_energy() > 0.0).then_some(Template { hypothesis, structure, nadir_px })
    };
    hypotheses.iter().filter_map(make).collect()
}

/// One surface for each template, in order, whatever the number of threads.
fn correlate_all(map: &CoarseMap, templates: &[Template], threads: usize) -> Vec<Option<Surface>> {
    let share = templates.len().div_ceil(threads.max(1)).max(1);
    let work = |chunk: &[Template]| {
        let mut fourier = map.fourier();
        chunk.iter().map(|t| map.correlate(&mut fourier, &t.structure)).collect::<Vec<_>>()
    };
    if threads <= 1 {
        return work(templates);
    }
    std::thread::scope(|scope| {
        let handles: Vec<_> = templates.chunks(share).map(|chunk| scope.spawn(move || work(chunk))).collect();
        handles.into_iter().flat_map(|h| h.join().expect("correlation does not panic")).collect()
    })
}

fn accumulate(
    surface: &Surface,
    offset: [usize; 2],
    block: &PixelWindow,
    area: &SearchArea,
    index: usize,
    tally: &mut Tally,
    best: &mut [(f32, usize)],
) {
    for y in 0..block.height_px.min(surface.height.saturating_sub(offset[1])) {
        let row = &surface.values[(y + offset[1]) * surface.width..][..surface.width];
        for x in 0..block.width_px.min(surface.width.saturating_sub(offset[0])) {
            let value = row[x + offset[0]];
            if value == 0.0 || !area.holds(block.left + x as i64, block.top + y as i64) {
                continue;
            }
            tally.sum += f64::from(value);
            tally.sum_squares += f64::from(value).powi(2);
            tally.count += 1.0;
            let place = &mut best[y * block.width_px + x];
            if value > place.0 {
                *place = (value, index);
            }
        }
    }
}

/// Local maxima of the best T of every place, refined to a fraction of a pixel by no one: the next level does that.
fn peaks_of(best: &[(f32, usize)], block: &PixelWindow, templates: &[Template]) -> Vec<Peak> {
    let (width, height) = (block.width_px, block.height_px);
    let is_peak = |x: usize, y: usize| {
        let value = best[y * width + x].0;
        let neighbours = (y.saturating_sub(1)..(y + 2).min(height))
            .flat_map(|j| (x.saturating_sub(1)..(x + 2).min(width)).map(move |i| (i, j)));
        value > 0.0 && neighbours.into_iter().all(|(i, j)| best[j * width + i].0 <= value)
    };
    let mut peaks: Vec<Peak> = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .filter(|&(x, y)| is_peak(x, y))
        .map(|(x, y)| {
            let (value, index) = best[y * width + x];
            let Hypothesis { heading_rad, height_ratio } = templates[index].hypothesis;
            let nadir = WorldPixel { x_px: (block.left + x as i64) as f64, y_px: (block.top + y as i64) as f64 };
            Peak { pose: Pose { nadir, zoom: block.zoom, heading_rad, height_ratio }, statistic: f64::from(value) }
        })
        .collect();
    strongest_first(&mut peaks);
    peaks.truncate(PEAKS * 4);
    peaks
}

/// Drops peaks near better ones.
fn distinct(mut peaks: Vec<Peak>, _zoom: u8) -> Vec<Peak> {
    const APART_PX: f64 = 4.0;
    strongest_first(&mut peaks);
    let mut kept: Vec<Peak> = Vec::new();
    for peak in peaks {
        let near = |k: &Peak| {
            let (dx, dy) = (k.pose.nadir.x_px - peak.pose.nadir.x_px, k.pose.nadir.y_px - peak.pose.nadir.y_px);
            dx.hypot(dy) < APART_PX
        };
        if !kept.iter().any(near) {
            kept.push(peak);
        }
        if kept.len() == PEAKS {
            break;
        }
    }
    kept
}

fn strongest_first(peaks: &mut [Peak]) {
    peaks.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
}
