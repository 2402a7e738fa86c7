//! `locate`: one absolute registration, and the decision whether it is a fix.

use super::answer::{Answer, Fix, NoFix, Point, Reason};
use super::area::{SearchArea, extent_m};
use super::coarse_search::{self, CoarseResult};
use super::hypotheses::hypotheses;
use super::levels::Levels;
use super::map::Map;
use super::pose::Frame;
use super::request::{FixRequest, LocateError, PositionPrior};
use super::steps::{Steps, Width};
use super::verdict::{Candidate, Judge, Verdict};
use super::wide::{CellLevel, WideSearch};
use overfly_core::camera::Camera;
use overfly_core::coupling::nominal_count_sequential;
use overfly_core::geodesy::{BodyFrame, Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use overfly_core::tile::{TileId, WorldPixel, gsd_at};
use overfly_store::{Footprint, Layer, Reader};
use std::time::Instant;

/// A frame whose shorter side has fewer pixels than this on the coarse level shows nothing to match.
const LEAST_SIDE_PX: f64 = 12.0;
/// How far a frame may reach from the nadir at the coarse level, where its edge has about 50 to 100 pixels: a view tilted
/// by 45 degrees reaches 500. What is drawn of it grows with the square.
const MOST_REACH_PX: f64 = 1000.0;
/// Windows beside each other see the same edges, so fewer of them are independent than there are: variances from their
/// residuals are this much too small. Measured where frame and map are of one date and nothing else is in the way.
const NEIGHBOURS_AGREE: f64 = 1.4;
/// What changes between two dates (shadows, leaves, walls seen from another side) scatters the windows, but also shifts
/// all of them together, which no residual shows: one sigma per axis, as a multiple of the scatter. Measured on drawn
/// ground under another sun, whose truth is exact.
const COMMON_SHARE: f64 = 2.0;
/// Such a shift comes of the heights of things, so it has a bound that does not grow with the pixel, metres.
const COMMON_M: f64 = 1.0;
/// The least that is promised of an accepted fix, however much speaks for it: none of 20,000 negatives accepted proves no rate
/// below 3 in 20,000 (`overfly evaluate negatives`).
const LEAST_FALSE_FIX_PROBABILITY: f64 = 1.5e-4;

/// Locates a frame. `threads` bounds the parallelism; it does not change the answer.
///
/// # Errors
/// Only where the question or the store is at fault: "no fix" is an answer.
pub fn locate(store: &Reader, frame: &Gray, request: &FixRequest, threads: usize) -> Result<Answer, LocateError> {
    locate_while(store, frame, request, threads, &|| true)
}

/// As [`locate`], for as long as `wanted` says so: it is asked between pieces of work of about a second.
///
/// # Errors
/// As [`locate`], and [`LocateError::GivenUp`].
pub fn locate_while(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    wanted: &dyn Fn() -> bool,
) -> Result<Answer, LocateError> {
    let start = Instant::now();
    request.check()?;
    let layer = store.layer(&request.layer)?;
    let camera = Camera::new(&request.view, frame.width_px() as u32, frame.height_px() as u32)?;
    let mut search = Search {
        store,
        layer,
        request,
        wanted,
        start,
        nominal_count: 0.0,
        tiles_searched: 0,
        score: None,
        log10_false_alarms: None,
    };
    search.nominal_count = search.nominal_count_of(&camera);
    search.run(&mut Frame::new(frame, camera), threads)
}

/// One search and what is known of it so far.
struct Search<'a> {
    store: &'a Reader,
    layer: &'a Layer,
    request: &'a FixRequest,
    wanted: &'a dyn Fn() -> bool,
    start: Instant,
    nominal_count: f64,
    tiles_searched: usize,
    score: Option<f64>,
    log10_false_alarms: Option<f64>,
}

impl Search<'_> {
    fn run(&mut self, frame: &mut Frame<'_>, threads: usize) -> Result<Answer, LocateError> {
        let Some(near) = self.middle() else {
            return Ok(self.no_fix(Reason::OutsideMap, "the position is beyond the tile matrix".into()));
        };
        let levels = Levels::choose(frame.camera(), self.layer, near);
        let gsd = gsd_at(near, levels.coarse);
        let (w, h) = frame.camera().frame_size_px();
        let side_px = f64::from(w.min(h)) * frame.camera().gsd_m_per_px() / gsd.mean_m_per_px();
        if side_px < LEAST_SIDE_PX {
            let detail = format!("the frame is {side_px:.1} px of the map wide, {LEAST_SIDE_PX} needed");
            return Ok(self.no_fix(Reason::TooLittleStructure, detail));
        }
        let Some(reach_px) = reach_px(frame.camera(), gsd.mean_m_per_px()) else {
            return Ok(self.no_fix(Reason::InconsistentScale, "the camera sees the horizon".into()));
        };
        if reach_px > MOST_REACH_PX {
            let detail = format!(
                "the frame would reach {reach_px:.0} px of the map's coarsest level from the point below the camera, at most {MOST_REACH_PX}; is its scale right?"
            );
            return Ok(self.no_fix(Reason::InconsistentScale, detail));
        }
        let area = SearchArea::new(&self.request.position, self.layer, levels.coarse)
            .and_then(|area| area.near_layer(self.layer, reach_px));
        let Some(area) = area else {
            return Ok(self.no_fix(Reason::OutsideMap, "the search region lies outside the layer".into()));
        };
        self.tiles_searched = self.count_tiles(&area, reach_px)?;
        if self.tiles_searched == 0 {
            return Ok(self.no_fix(Reason::OutsideMap, "no tile of the layer meets the search region".into()));
        }
        let parts = hypotheses(self.request, reach_px);
        let width = Width::of(&area, reach_px, parts.iter().map(Vec::len).sum());
        let cell_level = width.is_wide().then(|| CellLevel::choose(self.layer, near, edge_m(frame.camera()))).flatten();
        let mut zooms: Vec<u8> = levels.all().chain(cell_level.map(|level| level.zoom)).collect();
        zooms.sort_unstable_by(|a, b| b.cmp(a));
        zooms.dedup();
        frame.prepare(zooms.into_iter().map(|zoom| (zoom, gsd_at(near, zoom))));
        let wide = match cell_level {
            Some(level) => WideSearch::new(
                self.store,
                self.layer,
                self.request,
                frame,
                level,
                (near, &area.mercator_bounds(reach_px)),
            )?,
            None => None,
        };
        let steps = match &wide {
            Some(wide) => Steps::around(wide, &area, width.hypotheses, threads, self.wanted)?,
            None => Steps::Everywhere(width.check(parts)?),
        };
        self.search(frame, levels, &area, &steps, threads)
    }

    /// The likeliest headings, scales and places first; the rest only where these leave any doubt.
    fn search(
        &mut self,
        frame: &Frame<'_>,
        levels: Levels,
        area: &SearchArea,
        steps: &Steps<'_>,
        threads: usize,
    ) -> Result<Answer, LocateError> {
        let map = Map::new(self.store, self.layer);
        let judge = Judge { map: &map, frame, request: self.request, finest: levels.finest, wanted: self.wanted };
        let mut coarse = CoarseResult::default();
        let mut verdict = None;
        for step in 0..steps.len() {
            if !(self.wanted)() {
                return Err(LocateError::GivenUp);
            }
            coarse = match steps {
                Steps::Everywhere(parts) => {
                    coarse.with(coarse_search::search(&map, frame, area, &parts[step], threads, self.wanted)?)
                }
                Steps::Around { wide, parts, places } => {
                    let found = wide.search_around(&map, frame, &parts[step], levels.coarse, threads)?;
                    CoarseResult { places: *places, ..coarse.with(found) }
                }
            };
            let found = verdict.insert(judge.weigh(&coarse)?);
            if found.is_sure() {
                break;
            }
        }
        let Some(Verdict { outcome, score, log10_false_alarms }) = verdict else {
            return Ok(self.no_fix(Reason::TooLittleStructure, "no heading nor scale is left open".into()));
        };
        (self.score, self.log10_false_alarms) = (score, log10_false_alarms);
        match outcome {
            Ok(best) => self.fix(frame, &best),
            Err((reason, detail)) => Ok(self.no_fix(reason, detail)),
        }
    }

    fn fix(&self, frame: &Frame<'_>, candidate: &Candidate) -> Result<Answer, LocateError> {
        let best = &candidate.refined;
        let pose = best.pose;
        let Ok(nadir) = pose.nadir.to_geodetic(pose.zoom) else {
            return Ok(self.no_fix(Reason::OutsideMap, "the best place is beyond the tile matrix".into()));
        };
        let gsd = gsd_at(nadir, pose.zoom);
        let camera = frame.camera().at_height_ratio(pose.height_ratio);
        let footprint = self.footprint_at(nadir)?;
        let map_error_m = footprint.as_ref().map_or(0.0, |f| f.horizontal_error_m);
        let c = best.fit.covariance * NEIGHBOURS_AGREE;
        let (ge, gn) = (gsd.east_m_per_px, gsd.north_m_per_px);
        let common_m = (COMMON_SHARE * best.fit.rms_px * gsd.mean_m_per_px()).min(COMMON_M);
        let common_m2 = map_error_m.powi(2) + common_m.powi(2);
        let covariance_m2 = [
            [c[(0, 0)] * ge * ge + common_m2, -c[(0, 1)] * ge * gn],
            [-c[(0, 1)] * ge * gn, c[(1, 1)] * gn * gn + common_m2],
        ];
        Ok(Answer::Fix(Fix {
            latitude_deg: nadir.latitude_deg(),
            longitude_deg: nadir.longitude_deg(),
            heading_deg: pose.heading_rad.to_degrees().rem_euclid(360.0),
            heading_sigma_deg: c[(3, 3)].sqrt().to_degrees(),
            gsd_m_per_px: camera.gsd_m_per_px(),
            scale_sigma_ratio: c[(2, 2)].sqrt(),
            covariance_m2,
            score: self.score.unwrap_or(0.0),
            false_fix_probability: 10f64.powf(candidate.log10_false_alarms).clamp(LEAST_FALSE_FIX_PROBABILITY, 1.0),
            log10_false_alarms: self.log10_false_alarms,
            image_centre: image_centre(&camera, nadir, pose.heading_rad),
            inliers: best.fit.inliers.len(),
            tiles_searched: self.tiles_searched,
            nominal_count: self.nominal_count,
            map_epoch: footprint.and_then(|f| f.acquired),
            time_s: self.request.time_s,
            elapsed_ms: self.elapsed_ms(),
        }))
    }

    fn no_fix(&self, reason: Reason, detail: String) -> Answer {
        Answer::NoFix(NoFix {
            reason,
            detail,
            score: self.score,
            log10_false_alarms: self.log10_false_alarms,
            tiles_searched: self.tiles_searched,
            nominal_count: self.nominal_count,
            time_s: self.request.time_s,
            elapsed_ms: self.elapsed_ms(),
        })
    }

    fn elapsed_ms(&self) -> f64 {
        self.start.elapsed().as_micros() as f64 / 1e3
    }

    fn footprint_at(&self, point: Geodetic) -> Result<Option<Footprint>, LocateError> {
        let Ok(tile) = TileId::containing(point, self.layer.base_zoom) else { return Ok(None) };
        Ok(self.store.footprint(self.layer, tile)?)
    }

    /// The middle of what the prior leaves open.
    fn middle(&self) -> Option<Geodetic> {
        let point = match self.request.position {
            PositionPrior::Gaussian { centre, .. } | PositionPrior::Square { centre, .. } => centre,
            PositionPrior::WholeLayer => self.layer.bounds_deg.middle().ok()?,
        };
        WorldPixel::from_geodetic(point, 0).ok().map(|_| point)
    }

    /// The paper's count (equation 3) for the area left open, its two edges taken as twice the drift.
    fn nominal_count_of(&self, camera: &Camera) -> f64 {
        let (w, h) = camera.frame_size_px();
        let (across_m, along_m) = (f64::from(w) * camera.gsd_m_per_px(), f64::from(h) * camera.gsd_m_per_px());
        let [east_m, north_m] = extent_m(&self.request.position, self.layer);
        nominal_count_sequential(across_m, along_m, 0.0, (east_m * north_m).sqrt() / 2.0)
    }

    /// Base tiles that meet the area or a frame within it.
    fn count_tiles(&self, area: &SearchArea, reach_px: f64) -> Result<usize, LocateError> {
        if self.request.position == PositionPrior::WholeLayer {
            return Ok(self.layer.base_tiles as usize);
        }
        let bounds = area.mercator_bounds(reach_px);
        Ok(self.store.footprints_in(self.layer, self.layer.base_zoom, &bounds)?.len())
    }
}

/// Square root of the ground that a frame shows, metres.
fn edge_m(camera: &Camera) -> f64 {
    let (w, h) = camera.frame_size_px();
    (f64::from(w) * f64::from(h)).sqrt() * camera.gsd_m_per_px()
}

/// Farthest a frame's corner lies from its nadir or from its middle, coarse pixels.
fn reach_px(camera: &Camera, gsd_m_per_px: f64) -> Option<f64> {
    let farthest_m = camera.footprint_in_body()?.iter().map(|corner| corner.length_m()).fold(0.0, f64::max);
    Some(farthest_m / gsd_m_per_px)
}

fn image_centre(camera: &Camera, nadir: Geodetic, heading_rad: f64) -> Point {
    let centre = camera.image_centre_in_body().unwrap_or_default();
    let enu = BodyFrame::from_heading_rad(heading_rad).enu_from_body(centre);
    let point = LocalFrame::at(nadir).geodetic_from_enu(enu).unwrap_or(nadir);
    Point { latitude_deg: point.latitude_deg(), longitude_deg: point.longitude_deg() }
}
