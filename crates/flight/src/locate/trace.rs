//! `Trace`: how a registration came to its answer: levels, peaks, places, windows and decision.
//!
//! Peaks, places and decision are the values of the search itself. The coarse surface and the windows are too large to keep on the
//! way; they are computed again by the functions of the search, from the poses that the search used.

use super::answer::Reason;
use super::camera_pose::CameraPose;
use super::coarse_peaks::{CoarsePeak, CoarsePeaks};
use super::coarse_search::surface_of;
use super::hypotheses::Hypothesis;
use super::levels::{CellLevel, Levels};
use super::map::Map;
use super::observation::Observation;
use super::pixel_window::PixelWindow;
use super::prepare::PreparedFrame;
use super::refined_place::RefinedPlace;
use super::search_context::SearchContext;
use super::verify::Verdict;
use super::window_pass::Pass;
use overfly_core::camera::Camera;
use overfly_core::registration::windows::WindowMatch;
use overfly_core::tile::{WorldPixel, gsd_at};
use overfly_store::StoreError;

/// The traced surface reaches at most this far around its peak, pixels.
const SURFACE_HALF_PX: i64 = 256;

/// A trace of one registration. Empty where the registration ended before its search.
#[derive(Default)]
pub struct Trace {
    /// The levels of coarse search and refinement.
    pub levels: Option<Levels>,
    /// The level of the wide search, where one was made. Then the coarse search covers only the surroundings of the places that
    /// the wide search found.
    pub cell_level: Option<CellLevel>,
    /// The peaks of the coarse search, best first.
    pub peaks: Vec<TracedPeak>,
    /// The refined places, best first.
    pub places: Vec<TracedPlace>,
    /// The coarse surface around the peak of the best place.
    pub surface: Option<TracedSurface>,
    /// The windows of the best place, or, where no place was found, at the centre of the area under the stated heading.
    pub windows: Option<TracedWindows>,
    /// The decision.
    pub decision: Option<Decision>,
}

/// A peak of the coarse search.
#[derive(Debug, Clone, Copy)]
pub struct TracedPeak {
    /// The pose of the peak, at the coarse level.
    pub pose: CameraPose,
    /// Height of the peak in standard deviations of the surface.
    pub z_score: f64,
}

/// A refined place.
#[derive(Debug, Clone, Copy)]
pub struct TracedPlace {
    /// The pose of the place.
    pub pose: CameraPose,
    /// Windows that held structure in the last pass.
    pub windows: usize,
    /// Windows that agree on one similarity.
    pub inliers: usize,
    /// log10 of the number of such agreements of windows expected by chance.
    pub log10_window_false_alarms: f64,
    /// z-score of the whole view's correlation peak; `None` where the place was not verified.
    pub peak_z_score: Option<f64>,
    /// log10 of the number of false alarms expected from all evidence; `None` where the place was not verified.
    pub log10_false_alarms: Option<f64>,
}

/// The coarse surface under the heading and scale of one peak.
#[derive(Debug, Clone)]
pub struct TracedSurface {
    /// The places, in pixels of the coarse level.
    pub window: PixelWindow,
    /// The heading and scale.
    pub hypothesis: Hypothesis,
    /// Ground sample distance, metres per pixel.
    pub gsd_m_per_px: f64,
    /// z-score at every place, row by row; `None` outside the area and where too little is compared.
    pub z_scores: Vec<Option<f32>>,
}

/// A frame through a pose, the map under it, and how their windows match.
pub struct TracedWindows {
    /// The pose through which the frame was seen.
    pub pose: CameraPose,
    /// The camera at the height of that pose.
    pub camera: Camera,
    /// The view and the map.
    pub observation: Observation,
    /// Every window that held structure.
    pub windows: Vec<WindowMatch>,
    /// Indices of the windows that agree on one similarity.
    pub inliers: Vec<usize>,
    /// Whether the pose is that of a place found, or only the stated one.
    pub is_found: bool,
}

/// The decision of a registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// The first place is the fix.
    Accepted,
    /// There is no fix.
    Refused(Reason),
}

impl Trace {
    /// Returns the trace of a search.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub(super) fn new(
        context: &SearchContext<'_>,
        prepared: &PreparedFrame<'_>,
        coarse: &CoarsePeaks,
        verdict: Option<&Verdict>,
        is_wide: bool,
    ) -> Result<Self, StoreError> {
        let map = Map::new(context);
        let best = verdict.and_then(|v| v.places.first().map(|p| &p.refined).or(v.unverified.first()));
        let peak = best.map(|place| place.peak).or(coarse.peaks.first().copied());
        let surface = match peak {
            Some(peak) => surface(&map, prepared, coarse, peak)?,
            None => None,
        };
        Ok(Self {
            levels: Some(prepared.levels),
            cell_level: prepared.cell_level.filter(|_| is_wide),
            peaks: coarse
                .peaks
                .iter()
                .map(|p| TracedPeak { pose: p.pose, z_score: coarse.z_score(p.statistic) })
                .collect(),
            places: verdict.map(places).unwrap_or_default(),
            surface,
            windows: windows(context, &map, prepared, best)?,
            decision: verdict.map(|v| v.refusal.as_ref().map_or(Decision::Accepted, |r| Decision::Refused(r.reason))),
        })
    }
}

fn places(verdict: &Verdict) -> Vec<TracedPlace> {
    let place = |refined: &RefinedPlace, peak_z_score, log10_false_alarms| TracedPlace {
        pose: refined.pose,
        windows: refined.matches.len(),
        inliers: refined.fit.inliers.len(),
        log10_window_false_alarms: refined.log10_window_false_alarms,
        peak_z_score,
        log10_false_alarms,
    };
    let verified = verdict.places.iter().map(|p| place(&p.refined, Some(p.peak_z_score), Some(p.log10_false_alarms)));
    verified.chain(verdict.unverified.iter().map(|refined| place(refined, None, None))).collect()
}

/// The surface around a peak, under the peak's own heading and scale.
fn surface(
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    coarse: &CoarsePeaks,
    peak: CoarsePeak,
) -> Result<Option<TracedSurface>, StoreError> {
    let CameraPose { nadir, zoom, heading_rad, height_ratio, .. } = peak.pose;
    let hypothesis = Hypothesis { heading_rad, height_ratio };
    let Some(window) = prepared.area.window_around(nadir, SURFACE_HALF_PX) else { return Ok(None) };
    let Some(values) = surface_of(map, &prepared.frame, &prepared.area, &window, hypothesis)? else { return Ok(None) };
    let z_score = |(i, value): (usize, f32)| {
        let (x, y) = ((i % window.width_px) as i64, (i / window.width_px) as i64);
        let is_compared = value != 0.0 && prepared.area.contains_pixel(window.left + x, window.top + y);
        is_compared.then(|| coarse.z_score(f64::from(value)) as f32)
    };
    let z_scores = values.into_iter().enumerate().map(z_score).collect();
    let gsd_m_per_px = gsd_at(prepared.centre, zoom).mean_m_per_px();
    Ok(Some(TracedSurface { window, hypothesis, gsd_m_per_px, z_scores }))
}

/// The last pass over the windows of a place; without a place, of the centre of the area under the stated heading.
fn windows(
    context: &SearchContext<'_>,
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    place: Option<&RefinedPlace>,
) -> Result<Option<TracedWindows>, StoreError> {
    let (pass, pose) = match place {
        Some(place) => place.last_pass,
        None => {
            let zoom = prepared.levels.finest;
            let Ok(nadir) = WorldPixel::from_geodetic(prepared.centre, zoom) else { return Ok(None) };
            let heading_rad = context.request.heading.map_or(0.0, |h| h.heading_rad);
            (Pass::last(zoom), Hypothesis { heading_rad, height_ratio: 1.0 }.pose(nadir, zoom))
        }
    };
    let Some(mut observation) = Observation::new(map, &prepared.frame, &pose, pass.radius_px)? else { return Ok(None) };
    let (windows, inliers) = match place {
        Some(place) => {
            observation.window_size_px = place.window_size_px;
            (place.matches.clone(), place.fit.inliers.clone())
        }
        None => {
            let windows = pass.match_windows(&observation);
            let inliers = pass.fit(&windows, &observation).map(|fit| fit.inliers).unwrap_or_default();
            (windows, inliers)
        }
    };
    let stated = prepared.frame.camera();
    let camera = pose.camera(stated).unwrap_or_else(|| stated.at_height_ratio(pose.height_ratio));
    Ok(Some(TracedWindows { pose, camera, observation, windows, inliers, is_found: place.is_some() }))
}
