//! `WideSearch`: for areas too large for the coarse search. The cells of the layer tell where the coarse search is worthwhile.
//!
//! 1. Scan: the frame's cells, a few along its edge, under every heading and scale against every place of the level's
//!    merged cells (`registration::wide::scan`).
//! 2. The best of these are compared again on unmerged cells, under intermediate headings and scales (`CellRefiner`).
//! 3. Around the best of those the coarse search is made, and its peaks are refined and verified as in any search.

use super::area::SearchArea;
use super::camera_pose::CameraPose;
use super::cancellation::CancellationToken;
use super::coarse_peaks::CoarsePeaks;
use super::coarse_search;
use super::error::LocateError;
use super::frame_pyramid::{FramePyramid, structure_of};
use super::hypotheses::{Hypothesis, REACH_SIGMAS, around, hypotheses, step};
use super::levels::CellLevel;
use super::map::Map;
use super::request::FixRequest;
use super::search_context::SearchContext;
use overfly_core::feature::{CELL_PX, CELLS, CellMap};
use overfly_core::geodesy::Geodetic;
use overfly_core::registration::wide::{CellMatch, CellRefiner, CellTemplate, CellView, SCAN_HALF, scan};
use overfly_core::tile::{Gsd, MercatorBounds, TILE_SIZE_PX, WorldPixel, gsd_at};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A step of heading moves the frame's corner by at most one in this many parts of a merged cell, in the count of `hypotheses`.
const CELL_STEPS: f64 = 2.4;
/// The best places of the scan are compared again: this many times the square root of the places, headings and scales scanned.
const CANDIDATES: f64 = 8.0;
/// One in this many of those is compared under all intermediate headings and scales.
const INTERMEDIATE_SHARE: usize = 8;
/// Places of one heading and scale that one thread takes at a time.
const CHUNK: usize = 512;
/// Number of places for the coarse search, likeliest first: in the first step, and in a second step if the first gives no sure fix.
const STEP_PLACES: [usize; 2] = [3, 12];
/// Radius of the coarse search around a place, coarse pixels: more than a cell and a half at the level of the cells.
const AROUND_PX: f64 = 7.0;
/// The templates of a latitude band are used for ground sample distances between 1 / this and this times the band's.
const BAND: f64 = 1.01;

/// The cells of a layer and of a frame, ready to be compared.
pub struct WideSearch<'a> {
    request: &'a FixRequest,
    level: CellLevel,
    near: Gsd,
    fine: Arc<CellMap>,
    merged: Arc<CellMap>,
    view: CellView,
    half_diagonal_cells: f64,
}

/// A place under one heading and scale.
#[derive(Debug, Clone, Copy)]
struct CellCandidate {
    /// The unmerged cell under the centre of the view.
    cell: [i64; 2],
    score: f32,
    hypothesis: Hypothesis,
    /// The frame's size in map pixels there, over its size at the centre of the area.
    scale: f64,
}

impl CellCandidate {
    /// A key of heading, scale and latitude band.
    fn group(&self) -> [u64; 3] {
        [self.hypothesis.heading_rad, self.hypothesis.height_ratio, self.scale].map(f64::to_bits)
    }
}

impl<'a> WideSearch<'a> {
    /// Reads the layer's cells (cached by the reader) and describes the frame, whose pyramid must have the level. `None` where layer
    /// or frame have no cells. Where the level's cells exceed the reader's cache, only those within `bounds` are read.
    ///
    /// # Errors
    /// [`LocateError::Store`]; [`LocateError::MemoryLimit`] where even the cells within `bounds` exceed the cache.
    pub fn new(
        context: &SearchContext<'a>,
        frame: &FramePyramid<'_>,
        level: CellLevel,
        centre: Geodetic,
        bounds: &MercatorBounds,
    ) -> Result<Option<Self>, LocateError> {
        let layer = context.layer;
        let cells = |pitch: usize| -> Result<Arc<CellMap>, LocateError> {
            let found = context.store.cells_around(layer, level.zoom, pitch, bounds)?;
            found.ok_or_else(|| LocateError::MemoryLimit { layer: layer.name.clone(), zoom: level.zoom })
        };
        let (merged, fine) = (cells(level.pitch)?, cells(1)?);
        let near = gsd_at(centre, level.zoom);
        let Some(ground) = frame.view(&Hypothesis::STATED.pose(WorldPixel::default(), level.zoom), near, [0.0; 2])
        else {
            return Ok(None);
        };
        let Some(view) = CellView::new(&structure_of(&ground), &ground.mask, ground.grid.nadir_px) else {
            return Ok(None);
        };
        let (w, h) = frame.camera().frame_size_px();
        let half_diagonal_m = f64::from(w).hypot(f64::from(h)) / 2.0 * frame.camera().gsd_m_per_px();
        let half_diagonal_cells = half_diagonal_m / (near.mean_m_per_px() * level.pitch_px());
        let search = Self { request: context.request, level, near, fine, merged, view, half_diagonal_cells };
        Ok((!search.merged.blocks().is_empty()).then_some(search))
    }

    /// The likeliest places of the area, one list for each step of the search, and the number of coarse pixels that the scan covered.
    ///
    /// # Errors
    /// [`LocateError::Cancelled`].
    pub fn places(
        &self,
        area: &SearchArea,
        threads: usize,
        cancellation: &CancellationToken,
    ) -> Result<(Vec<Vec<CameraPose>>, f64), LocateError> {
        let hypotheses = hypotheses(self.request, CELL_STEPS * self.half_diagonal_cells).concat();
        let bands = self.bands(area);
        let cells: usize = bands.iter().map(|(_, blocks)| blocks.len() * CELLS * CELLS).sum();
        let most = (CANDIDATES * ((cells * hypotheses.len()) as f64).sqrt()) as usize;
        let mut candidates: Vec<CellCandidate> = Vec::new();
        let mut compared = 0;
        for (scale, blocks) in bands {
            cancellation.check()?;
            let (kept, templates): (Vec<_>, Vec<_>) = hypotheses
                .iter()
                .filter_map(|h| Some((*h, self.template(*h, scale, self.level.pitch, SCAN_HALF)?)))
                .unzip();
            let holds = |cell: [i64; 2], template: usize| {
                let pose = self.pose(cell, self.level.pitch, kept[template], scale);
                area.contains(pose.at_zoom(area.zoom()).nadir)
            };
            let scanned = scan(&self.merged, &blocks, &templates, most, threads, &holds);
            compared += scanned.cells;
            let pitch = self.level.pitch as i64;
            let candidate = |p: CellMatch| CellCandidate {
                cell: p.cell.map(|c| c * pitch + pitch / 2),
                score: p.score,
                hypothesis: kept[p.template],
                scale,
            };
            candidates.extend(scanned.matches.into_iter().map(candidate));
        }
        // Sorting is stable and bands come in order: the same whatever the threads.
        candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
        candidates.truncate(most);
        let per_cell = (self.level.pitch_px() * 2f64.powi(i32::from(area.zoom()) - i32::from(self.level.zoom))).powi(2);
        let mut closer = self.compare_closer(candidates, false, threads);
        closer.sort_by(|a, b| b.score.total_cmp(&a.score));
        closer.truncate(most / INTERMEDIATE_SHARE);
        Ok((self.steps_of(self.compare_closer(closer, true, threads)), compared as f64 * per_cell))
    }

    /// The blocks that intersect the area, in bands of latitude, each with the frame's scale there.
    fn bands(&self, area: &SearchArea) -> Vec<(f64, Vec<[i64; 2]>)> {
        let block_px = self.level.pitch_px() * CELLS as f64;
        let mut bands: BTreeMap<i64, Vec<[i64; 2]>> = BTreeMap::new();
        for &[column, row] in self.merged.blocks() {
            let from = [column as f64 * block_px, row as f64 * block_px];
            let factor = 2f64.powi(i32::from(area.zoom()) - i32::from(self.level.zoom));
            if !area.intersects(from.map(|v| v * factor), block_px * factor) {
                continue;
            }
            let world_px = f64::from(TILE_SIZE_PX) * 2f64.powi(i32::from(self.level.zoom));
            let middle = WorldPixel { x_px: from[0], y_px: (from[1] + block_px / 2.0).min(world_px) };
            let Ok(place) = middle.to_geodetic(self.level.zoom) else { continue };
            let scale = self.near.mean_m_per_px() / gsd_at(place, self.level.zoom).mean_m_per_px();
            bands.entry((scale.ln() / (2.0 * BAND.ln())).round() as i64).or_default().push([column, row]);
        }
        bands.into_iter().map(|(band, blocks)| ((band as f64 * 2.0 * BAND.ln()).exp(), blocks)).collect()
    }

    fn template(&self, hypothesis: Hypothesis, scale: f64, pitch: usize, half: usize) -> Option<CellTemplate> {
        let ratio = hypothesis.height_ratio * scale;
        self.view.template(hypothesis.heading_rad, ratio, (pitch * CELL_PX) as f64, half)
    }

    /// The pose at which the centre of the view lies on a cell.
    fn pose(&self, cell: [i64; 2], pitch: usize, hypothesis: Hypothesis, scale: f64) -> CameraPose {
        let middle = self.view.middle_px(hypothesis.heading_rad, hypothesis.height_ratio * scale);
        let at = |axis: usize| (cell[axis] as f64 + 0.5) * (pitch * CELL_PX) as f64 - middle[axis];
        hypothesis.pose(WorldPixel { x_px: at(0), y_px: at(1) }, self.level.zoom)
    }

    /// Compares places again on unmerged cells; under headings and scales around the scan's where `between`.
    fn compare_closer(&self, mut candidates: Vec<CellCandidate>, between: bool, threads: usize) -> Vec<CellCandidate> {
        candidates.sort_by_key(|c| (c.group(), c.cell));
        let groups = candidates.chunk_by(|a, b| a.group() == b.group());
        let groups: Vec<&[CellCandidate]> = groups.flat_map(|group| group.chunks(CHUNK)).collect();
        in_parallel(&groups, threads, &|group| self.compare_group_closer(group, between)).concat()
    }

    /// As [`Self::compare_closer`], for places of one heading and scale.
    fn compare_group_closer(&self, candidates: &[CellCandidate], between: bool) -> Vec<CellCandidate> {
        let Some(&CellCandidate { hypothesis, scale, .. }) = candidates.first() else { return Vec::new() };
        let half = self.level.pitch * (SCAN_HALF + 1);
        let hypotheses = if between { self.between(hypothesis) } else { vec![hypothesis] };
        let (made, templates): (Vec<_>, Vec<_>) =
            hypotheses.into_iter().filter_map(|h| Some((h, self.template(h, scale, 1, half)?))).unzip();
        let Some(mut refiner) = CellRefiner::new(templates, self.level.pitch, half) else { return Vec::new() };
        let weigh = |candidate: &CellCandidate| {
            let best = refiner.refine(&self.fine, candidate.cell)?;
            Some(CellCandidate { cell: best.cell, score: best.score, hypothesis: made[best.template], scale })
        };
        candidates.iter().filter_map(weigh).collect()
    }

    /// The headings and scales between one of the scan and its neighbours.
    fn between(&self, hypothesis: Hypothesis) -> Vec<Hypothesis> {
        let step = step(CELL_STEPS * self.half_diagonal_cells);
        let fine_step = 1.0 / (self.half_diagonal_cells * self.level.pitch as f64);
        let reach = (0.75 * step).min(REACH_SIGMAS * self.request.scale_sigma_ratio);
        let ratios = around(reach, fine_step);
        let turns = around(step / 2.0, fine_step);
        let turned = |t: f64, r: f64| Hypothesis {
            heading_rad: hypothesis.heading_rad + t,
            height_ratio: hypothesis.height_ratio * r.exp(),
        };
        turns.iter().flat_map(|&t| ratios.iter().map(move |&r| turned(t, r))).collect()
    }

    /// The best poses, none next to a better one, one list for each step.
    fn steps_of(&self, mut found: Vec<CellCandidate>) -> Vec<Vec<CameraPose>> {
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let apart_px = self.level.pitch_px();
        let mut kept: Vec<CameraPose> = Vec::new();
        for CellCandidate { cell, hypothesis, scale, .. } in found {
            let pose = self.pose(cell, 1, hypothesis, scale);
            let near =
                |k: &CameraPose| (k.nadir.x_px - pose.nadir.x_px).hypot(k.nadir.y_px - pose.nadir.y_px) < apart_px;
            if !kept.iter().any(near) {
                kept.push(pose);
            }
            if kept.len() == STEP_PLACES.iter().sum::<usize>() {
                break;
            }
        }
        let rest = kept.split_off(STEP_PLACES[0].min(kept.len()));
        vec![kept, rest]
    }

    /// Makes the coarse search around some places.
    ///
    /// # Errors
    /// As [`coarse_search::search`].
    pub fn search_around(
        &self,
        map: &Map<'_>,
        frame: &FramePyramid<'_>,
        poses: &[CameraPose],
        zoom: u8,
        threads: usize,
        cancellation: &CancellationToken,
    ) -> Result<CoarsePeaks, LocateError> {
        let spread = 1.0 / (self.half_diagonal_cells * self.level.pitch as f64);
        let work = |pose: &CameraPose| {
            let pose = pose.at_zoom(zoom);
            let area = SearchArea::around_pixel(zoom, pose.nadir, AROUND_PX);
            let hypotheses: Vec<Hypothesis> = [0.0, -0.5 * spread, 0.5 * spread]
                .map(|turn| Hypothesis { heading_rad: pose.heading_rad + turn, height_ratio: pose.height_ratio })
                .into();
            coarse_search::search(map, frame, &area, &hypotheses, 1, cancellation)
        };
        let results = in_parallel(poses, threads, &work).into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(results.into_iter().fold(CoarsePeaks::default(), CoarsePeaks::merged_with))
    }
}

/// The results of `work` for every item, in the items' order. A thread that is free takes the next item.
fn in_parallel<I: Sync, R: Send>(items: &[I], threads: usize, work: &(dyn Fn(&I) -> R + Sync)) -> Vec<R> {
    if threads <= 1 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let take = || {
        let index = next.fetch_add(1, Ordering::Relaxed);
        items.get(index).map(|item| (index, work(item)))
    };
    let mut done: Vec<(usize, R)> = std::thread::scope(|scope| {
        let handles: Vec<_> =
            (0..threads).map(|_| scope.spawn(|| std::iter::from_fn(take).collect::<Vec<_>>())).collect();
        handles.into_iter().flat_map(|h| h.join().expect("a comparison does not panic")).collect()
    });
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}
