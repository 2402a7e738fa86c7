//! The wide search: where a prior leaves too much open for the coarse search, the cells of the whole layer say where to
//! look.
//!
//! 1. Scan: the frame's cells, a few along its edge, under every heading and scale against every place of the level's
//!    merged cells (`registration::wide::scan`).
//! 2. The best of these are weighed again on unmerged cells, under headings and scales between (`CellRefiner`).
//! 3. Around the best of those the coarse search is made as ever, and what it finds is looked at closely as ever.

use super::area::SearchArea;
use super::coarse_search::{self, CoarseResult, Hypothesis};
use super::hypotheses::{around, hypotheses};
use super::map::Map;
use super::pose::{Frame, Pose, structure_of};
use super::request::{FixRequest, LocateError};
use overfly_core::feature::{CELL_PX, CELLS, CellMap};
use overfly_core::geodesy::Geodetic;
use overfly_core::registration::wide::{CellMatch, CellRefiner, CellTemplate, CellView, SCAN_HALF, scan};
use overfly_core::tile::{Gsd, MercatorBounds, TILE_SIZE_PX, WorldPixel, gsd_at};
use overfly_store::{Layer, Reader};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A frame's edge (square root of its area) should have this many merged cells: on 8 the place of a frame years apart
/// stands no higher than chance puts some of a million others, on 12 it stands twice as high.
const EDGE_CELLS: f64 = 10.0;
/// A smaller frame is searched for on the finest cells, if it has as many as this.
const LEAST_EDGE_CELLS: f64 = 6.5;
/// Parts of a merged cell that a step of heading may move the frame's corner, as `hypotheses` counts them.
const CELL_STEPS: f64 = 2.4;
/// The best places of the scan are looked at more closely: this many times the square root of the places, headings and
/// scales scanned.
const CANDIDATES: f64 = 8.0;
/// Of these, one in so many is looked at under all headings and scales between.
const WEIGHED_AGAIN: usize = 8;
/// Places of one heading and scale that one thread takes at a time.
const WEIGHED_TOGETHER: usize = 512;
/// Places handed on, the likeliest first: these, and these when the first leave any doubt.
const HANDED_ON: [usize; 2] = [3, 12];
/// Radius of the coarse search around a place, coarse pixels: a cell and a half on the level of the cells is less.
const AROUND_PX: f64 = 7.0;
/// Between this and 1 / this of a band's ground sample distance its templates serve.
const BAND: f64 = 1.01;

/// The level and the pitch to search on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellLevel {
    /// The level.
    pub zoom: u8,
    /// Its cells that are merged along each axis.
    pub pitch: usize,
}

impl CellLevel {
    /// The coarsest on which a frame whose edge is `edge_m` still has cells enough, or the finest; `None` where even that
    /// has too few.
    pub fn choose(layer: &Layer, near: Geodetic, edge_m: f64) -> Option<Self> {
        let pitches = |zoom: u8| if zoom == layer.base_zoom { 1..=3 } else { 2..=3 };
        let edge_cells = |level: &Self| edge_m / (gsd_at(near, level.zoom).mean_m_per_px() * level.pitch_px());
        let finest = Self { zoom: layer.base_zoom, pitch: 1 };
        (layer.min_zoom..=layer.base_zoom)
            .flat_map(|zoom| pitches(zoom).rev().map(move |pitch| Self { zoom, pitch }))
            .find(|level| edge_cells(level) >= EDGE_CELLS)
            .or_else(|| Some(finest).filter(|level| edge_cells(level) >= LEAST_EDGE_CELLS))
    }

    fn pitch_px(self) -> f64 {
        (self.pitch * CELL_PX) as f64
    }
}

/// A layer's cells and the frame's, ready to be compared.
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
struct Candidate {
    /// The cell under the view's middle, unmerged.
    cell: [i64; 2],
    score: f32,
    hypothesis: Hypothesis,
    /// The frame's size in map pixels there, over that near the area's middle.
    scale: f64,
}

impl Candidate {
    /// Tells headings, scales and latitudes apart.
    fn group(&self) -> [u64; 3] {
        [self.hypothesis.heading_rad, self.hypothesis.height_ratio, self.scale].map(f64::to_bits)
    }
}

impl<'a> WideSearch<'a> {
    /// Reads the layer's cells (kept by the reader) and describes the frame, which must be prepared for the level.
    /// `None` where layer or frame have no cells. Where the level's cells are more than the reader may hold, those around
    /// `area` alone are read.
    ///
    /// # Errors
    /// Where the store cannot be read; [`LocateError::NoRoom`].
    pub fn new(
        store: &Reader,
        layer: &Layer,
        request: &'a FixRequest,
        frame: &Frame<'_>,
        level: CellLevel,
        (near, bounds): (Geodetic, &MercatorBounds),
    ) -> Result<Option<Self>, LocateError> {
        let cells = |pitch: usize| -> Result<Arc<CellMap>, LocateError> {
            let found = store.cells_around(layer, level.zoom, pitch, bounds)?;
            found.ok_or_else(|| LocateError::NoRoom { layer: layer.name.clone(), zoom: level.zoom })
        };
        let (merged, fine) = (cells(level.pitch)?, cells(1)?);
        let near = gsd_at(near, level.zoom);
        let Some(ground) = frame.view(level.zoom, near, 0.0, 1.0, [0.0; 2]) else { return Ok(None) };
        let Some(view) = CellView::new(&structure_of(&ground), &ground.mask, ground.grid.nadir_px) else {
            return Ok(None);
        };
        let (w, h) = frame.camera().frame_size_px();
        let half_diagonal_m = f64::from(w).hypot(f64::from(h)) / 2.0 * frame.camera().gsd_m_per_px();
        let half_diagonal_cells = half_diagonal_m / (near.mean_m_per_px() * level.pitch_px());
        let search = Self { request, level, near, fine, merged, view, half_diagonal_cells };
        Ok((!search.merged.blocks().is_empty()).then_some(search))
    }

    /// The likeliest places of the area, in parts: each to be searched if those before leave any doubt. With them the
    /// places that the whole search stands for, coarse pixels.
    ///
    /// # Errors
    /// [`LocateError::GivenUp`] where nobody `wanted` it any more.
    pub fn places(
        &self,
        area: &SearchArea,
        threads: usize,
        wanted: &dyn Fn() -> bool,
    ) -> Result<(Vec<Vec<Pose>>, f64), LocateError> {
        let hypotheses = hypotheses(self.request, CELL_STEPS * self.half_diagonal_cells).concat();
        let bands = self.bands(area);
        let cells: usize = bands.iter().map(|(_, blocks)| blocks.len() * CELLS * CELLS).sum();
        let most = (CANDIDATES * ((cells * hypotheses.len()) as f64).sqrt()) as usize;
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut compared = 0;
        for (scale, blocks) in bands {
            if !wanted() {
                return Err(LocateError::GivenUp);
            }
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
            let candidate = |p: CellMatch| Candidate {
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
        let mut closer = self.look_closer(candidates, false, threads);
        closer.sort_by(|a, b| b.score.total_cmp(&a.score));
        closer.truncate(most / WEIGHED_AGAIN);
        Ok((self.in_parts(self.look_closer(closer, true, threads)), compared as f64 * per_cell))
    }

    /// The blocks that meet the area by the scale that their latitude gives the frame.
    fn bands(&self, area: &SearchArea) -> Vec<(f64, Vec<[i64; 2]>)> {
        let block_px = self.level.pitch_px() * CELLS as f64;
        let mut bands: BTreeMap<i64, Vec<[i64; 2]>> = BTreeMap::new();
        for &[column, row] in self.merged.blocks() {
            let from = [column as f64 * block_px, row as f64 * block_px];
            let factor = 2f64.powi(i32::from(area.zoom()) - i32::from(self.level.zoom));
            if !area.meets(from.map(|v| v * factor), block_px * factor) {
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

    /// Where the camera is when the view's middle lies on a cell.
    fn pose(&self, cell: [i64; 2], pitch: usize, hypothesis: Hypothesis, scale: f64) -> Pose {
        let Hypothesis { heading_rad, height_ratio } = hypothesis;
        let middle = self.view.middle_px(heading_rad, height_ratio * scale);
        let at = |axis: usize| (cell[axis] as f64 + 0.5) * (pitch * CELL_PX) as f64 - middle[axis];
        Pose { nadir: WorldPixel { x_px: at(0), y_px: at(1) }, zoom: self.level.zoom, heading_rad, height_ratio }
    }

    /// The places on unmerged cells, under headings and scales around those of the scan.
    fn look_closer(&self, mut candidates: Vec<Candidate>, between: bool, threads: usize) -> Vec<Candidate> {
        candidates.sort_by_key(|c| (c.group(), c.cell));
        let groups = candidates.chunk_by(|a, b| a.group() == b.group());
        let groups: Vec<&[Candidate]> = groups.flat_map(|group| group.chunks(WEIGHED_TOGETHER)).collect();
        in_parallel(&groups, threads, &|group| self.look_closer_at(group, between)).concat()
    }

    /// The same for places of one heading and scale.
    fn look_closer_at(&self, candidates: &[Candidate], between: bool) -> Vec<Candidate> {
        let Some(&Candidate { hypothesis, scale, .. }) = candidates.first() else { return Vec::new() };
        let half = self.level.pitch * (SCAN_HALF + 1);
        let hypotheses = if between { self.between(hypothesis) } else { vec![hypothesis] };
        let (made, templates): (Vec<_>, Vec<_>) =
            hypotheses.into_iter().filter_map(|h| Some((h, self.template(h, scale, 1, half)?))).unzip();
        let Some(mut closer) = CellRefiner::new(templates, self.level.pitch, half) else { return Vec::new() };
        let weigh = |candidate: &Candidate| {
            let best = closer.refine(&self.fine, candidate.cell)?;
            Some(Candidate { cell: best.cell, score: best.score, hypothesis: made[best.template], scale })
        };
        candidates.iter().filter_map(weigh).collect()
    }

    /// Headings and scales that lie between the scan's.
    fn between(&self, hypothesis: Hypothesis) -> Vec<Hypothesis> {
        let step = super::hypotheses::step(CELL_STEPS * self.half_diagonal_cells);
        let fine_step = 1.0 / (self.half_diagonal_cells * self.level.pitch as f64);
        let reach = (0.75 * step).min(super::hypotheses::REACH_SIGMAS * self.request.scale_sigma_ratio);
        let ratios = around(reach, fine_step);
        let turns = around(step / 2.0, fine_step);
        let turned = |t: f64, r: f64| Hypothesis {
            heading_rad: hypothesis.heading_rad + t,
            height_ratio: hypothesis.height_ratio * r.exp(),
        };
        turns.iter().flat_map(|&t| ratios.iter().map(move |&r| turned(t, r))).collect()
    }

    /// The best, none beside a better one.
    fn in_parts(&self, mut found: Vec<Candidate>) -> Vec<Vec<Pose>> {
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let apart_px = self.level.pitch_px();
        let mut kept: Vec<Pose> = Vec::new();
        for Candidate { cell, hypothesis, scale, .. } in found {
            let pose = self.pose(cell, 1, hypothesis, scale);
            let near = |k: &Pose| (k.nadir.x_px - pose.nadir.x_px).hypot(k.nadir.y_px - pose.nadir.y_px) < apart_px;
            if !kept.iter().any(near) {
                kept.push(pose);
            }
            if kept.len() == HANDED_ON.iter().sum::<usize>() {
                break;
            }
        }
        let rest = kept.split_off(HANDED_ON[0].min(kept.len()));
        vec![kept, rest]
    }

    /// The coarse search around places found.
    ///
    /// # Errors
    /// As [`coarse_search::search`].
    pub fn search_around(
        &self,
        map: &Map<'_>,
        frame: &Frame<'_>,
        poses: &[Pose],
        zoom: u8,
        threads: usize,
    ) -> Result<CoarseResult, LocateError> {
        let spread = 1.0 / (self.half_diagonal_cells * self.level.pitch as f64);
        let work = |pose: &Pose| {
            let pose = pose.at_zoom(zoom);
            let area = SearchArea::beside(zoom, pose.nadir, AROUND_PX);
            let hypotheses: Vec<Hypothesis> = [0.0, -0.5 * spread, 0.5 * spread]
                .map(|turn| Hypothesis { heading_rad: pose.heading_rad + turn, height_ratio: pose.height_ratio })
                .into();
            coarse_search::search(map, frame, &area, &hypotheses, 1, &|| true)
        };
        let results = in_parallel(poses, threads, &work).into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(results.into_iter().fold(CoarseResult::default(), CoarseResult::with))
    }
}

/// `work` of every item, in their order; who is free takes the next.
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
