//! The coarse search: the frame under every heading and scale left open, over every place left open.

use super::area::SearchArea;
use super::map::{Map, PixelWindow};
use super::pose::{Frame, Pose, structure_of};
use super::request::LocateError;
use overfly_core::registration::coarse::{CoarseMap, Fourier, PlacedView, Reach, Surface};
use overfly_core::tile::{Gsd, WorldPixel};
use overfly_store::StoreError;

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
    /// Both searches as one.
    pub fn with(self, other: Self) -> Self {
        let places = self.places + other.places;
        let share = |a: f64, b: f64| if places > 0.0 { (a * self.places + b * other.places) / places } else { 0.0 };
        let mean = share(self.mean, other.mean);
        let square = |r: &Self| r.deviation.powi(2) + (r.mean - mean).powi(2);
        let deviation = share(square(&self), square(&other)).sqrt();
        Self { mean, deviation, places, peaks: distinct([self.peaks, other.peaks].concat()) }
    }

    /// A statistic in standard deviations of the surface.
    pub fn score(&self, statistic: f64) -> f64 {
        if self.deviation > 0.0 { (statistic - self.mean) / self.deviation } else { 0.0 }
    }
}

/// Edge of one correlated block of places: bounds memory and keeps the ground scale constant within.
pub const BLOCK_PX: i64 = 512;
/// Surfaces held at once for each thread, a megabyte each: a full turn under a vague height has thousands.
const BATCH: usize = 8;
/// Neighbouring hypotheses that share a denominator: their views differ by a few pixels at the rim.
const ALIKE: usize = 4;
/// Peaks kept.
const PEAKS: usize = 8;

/// Sums over surfaces, and the peaks of every block.
#[derive(Default)]
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
    map: &Map<'_>,
    frame: &Frame<'_>,
    area: &SearchArea,
    hypotheses: &[Hypothesis],
    threads: usize,
    wanted: &dyn Fn() -> bool,
) -> Result<CoarseResult, LocateError> {
    let mut tally = Tally::default();
    for block in area.blocks(BLOCK_PX) {
        if !wanted() {
            return Err(LocateError::GivenUp);
        }
        search_block(map, frame, area, &block, hypotheses, threads, &mut tally)?;
    }
    let mean = if tally.count > 0.0 { tally.sum / tally.count } else { 0.0 };
    let variance = if tally.count > 0.0 { tally.sum_squares / tally.count - mean * mean } else { 0.0 };
    let peaks = distinct(tally.peaks);
    Ok(CoarseResult { peaks, mean, deviation: variance.max(0.0).sqrt(), places: tally.count })
}

/// The frame under some hypotheses at one level.
struct Templates {
    hypotheses: Vec<Hypothesis>,
    views: Vec<PlacedView>,
}

fn search_block(
    map: &Map<'_>,
    frame: &Frame<'_>,
    area: &SearchArea,
    block: &PixelWindow,
    hypotheses: &[Hypothesis],
    threads: usize,
    tally: &mut Tally,
) -> Result<(), StoreError> {
    let templates = templates(frame, block.zoom, area.gsd_of(block), hypotheses);
    if templates.views.is_empty() {
        return Ok(());
    }
    let reach = Reach::from_views(&templates.views);
    let structure = map.window(&PixelWindow {
        zoom: block.zoom,
        left: block.left - reach.left as i64,
        top: block.top - reach.top as i64,
        width_px: block.width_px + reach.left + reach.right - 1,
        height_px: block.height_px + reach.top + reach.bottom - 1,
    })?;
    if structure.total_energy() <= 0.0 {
        return Ok(());
    }
    let coarse = CoarseMap::new(&structure, reach);
    let mut best = Best::new(block, area);
    let together = BATCH * threads.max(1);
    for (batch, views) in templates.views.chunks(together).enumerate() {
        for (within, surface) in correlate_all(&coarse, views, threads).iter().enumerate() {
            if let Some(surface) = surface {
                best.take(surface, batch * together + within, tally);
            }
        }
    }
    tally.peaks.extend(best.peaks(&templates.hypotheses));
    Ok(())
}

fn templates(frame: &Frame<'_>, zoom: u8, gsd: Gsd, hypotheses: &[Hypothesis]) -> Templates {
    let mut templates = Templates { hypotheses: Vec::new(), views: Vec::new() };
    for &hypothesis in hypotheses {
        let view = frame.view(zoom, gsd, hypothesis.heading_rad, hypothesis.height_ratio, [0.0; 2]);
        let Some(view) = view else { continue };
        let nadir_px = [view.grid.nadir_px[0].round() as i64, view.grid.nadir_px[1].round() as i64];
        let structure = structure_of(&view);
        if structure.total_energy() > 0.0 {
            templates.hypotheses.push(hypothesis);
            templates.views.push(PlacedView { structure, nadir_px });
        }
    }
    templates
}

/// One surface for each view, in order, whatever the number of threads.
fn correlate_all(map: &CoarseMap, views: &[PlacedView], threads: usize) -> Vec<Option<Surface>> {
    let share = views.len().div_ceil(ALIKE).div_ceil(threads.max(1)).max(1) * ALIKE;
    let work = |views: &[PlacedView]| {
        let mut fourier = map.fourier();
        views.chunks(ALIKE).flat_map(|alike| correlate_alike(map, &mut fourier, alike)).collect::<Vec<_>>()
    };
    if threads <= 1 {
        return work(views);
    }
    std::thread::scope(|scope| {
        let handles: Vec<_> = views.chunks(share).map(|chunk| scope.spawn(move || work(chunk))).collect();
        handles.into_iter().flat_map(|h| h.join().expect("correlation does not panic")).collect()
    })
}

/// Surfaces of views so alike that one denominator serves all.
fn correlate_alike(map: &CoarseMap, fourier: &mut Fourier, alike: &[PlacedView]) -> Vec<Option<Surface>> {
    let Some(spread) = map.normalisation(fourier, &alike[alike.len() / 2]) else {
        return alike.iter().map(|_| None).collect();
    };
    let mut surfaces = Vec::with_capacity(alike.len());
    for pair in alike.chunks(2) {
        let [first, second] = map.correlate(fourier, [&pair[0], &pair[pair.len() - 1]], &spread);
        surfaces.push(Some(first));
        if pair.len() == 2 {
            surfaces.push(Some(second));
        }
    }
    surfaces
}

/// The best T of every place of a block, and which hypothesis gave it.
struct Best<'a> {
    block: &'a PixelWindow,
    /// Whether a place belongs to the area.
    held: Vec<bool>,
    values: Vec<f32>,
    indices: Vec<u32>,
}

impl<'a> Best<'a> {
    fn new(block: &'a PixelWindow, area: &SearchArea) -> Self {
        let places = (0..block.height_px as i64).flat_map(|y| (0..block.width_px as i64).map(move |x| (x, y)));
        let held: Vec<bool> = places.map(|(x, y)| area.holds(block.left + x, block.top + y)).collect();
        let count = held.len();
        Self { block, held, values: vec![f32::NEG_INFINITY; count], indices: vec![0; count] }
    }

    fn take(&mut self, surface: &Surface, index: usize, tally: &mut Tally) {
        let width = self.block.width_px;
        for (row, surface) in surface.values.chunks_exact(width).enumerate().take(self.block.height_px) {
            let span = row * width..(row + 1) * width;
            let (held, best) = (&self.held[span.clone()], &mut self.values[span.clone()]);
            let indices = &mut self.indices[span];
            let (mut sum, mut squares, mut count) = (0f32, 0f32, 0u32);
            for x in 0..width {
                let counts = held[x] && surface[x] != 0.0;
                let value = if counts { surface[x] } else { 0.0 };
                sum += value;
                squares += value * value;
                count += u32::from(counts);
                let better = counts && value > best[x];
                best[x] = if better { value } else { best[x] };
                indices[x] = if better { index as u32 } else { indices[x] };
            }
            tally.sum += f64::from(sum);
            tally.sum_squares += f64::from(squares);
            tally.count += f64::from(count);
        }
    }

    /// Local maxima, whole pixels: the next level refines them.
    fn peaks(&self, hypotheses: &[Hypothesis]) -> Vec<Peak> {
        let (width, height) = (self.block.width_px, self.block.height_px);
        let is_peak = |x: usize, y: usize| {
            let value = self.values[y * width + x];
            let neighbours = (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|j| (x.saturating_sub(1)..(x + 2).min(width)).map(move |i| (i, j)));
            value > 0.0 && neighbours.into_iter().all(|(i, j)| self.values[j * width + i] <= value)
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let mut peaks: Vec<Peak> = places.filter(|&(x, y)| is_peak(x, y)).map(|at| self.peak(at, hypotheses)).collect();
        strongest_first(&mut peaks);
        peaks.truncate(PEAKS * 4);
        peaks
    }

    fn peak(&self, (x, y): (usize, usize), hypotheses: &[Hypothesis]) -> Peak {
        let i = y * self.block.width_px + x;
        let Hypothesis { heading_rad, height_ratio } = hypotheses[self.indices[i] as usize];
        let nadir = WorldPixel { x_px: (self.block.left + x as i64) as f64, y_px: (self.block.top + y as i64) as f64 };
        let pose = Pose { nadir, zoom: self.block.zoom, heading_rad, height_ratio };
        Peak { pose, statistic: f64::from(self.values[i]) }
    }
}

/// Drops peaks near better ones.
fn distinct(mut peaks: Vec<Peak>) -> Vec<Peak> {
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
