//! `RefinedPlace`: the third stage of a registration. From a coarse peak through ever finer levels by local windows to a similarity.

use super::camera_pose::CameraPose;
use super::coarse_peaks::{CoarsePeak, CoarsePeaks};
use super::error::LocateError;
use super::map::Map;
use super::observation::Observation;
use super::prepare::PreparedFrame;
use super::search_context::SearchContext;
use super::soft_refine::SoftRefinement;
use overfly_core::camera::GroundGrid;
use overfly_core::registration::a_contrario::{self, ConsensusCounts};
use overfly_core::registration::window_fit::{WindowFit, WindowFitOptions, fit_windows};
use overfly_core::registration::windows::{WindowMatch, WindowOptions};
use overfly_store::StoreError;

/// A coarse peak refined to a place.
#[derive(Debug, Clone)]
pub struct RefinedPlace {
    /// The corrected pose, in pixels of the level of the last pass.
    pub pose: CameraPose,
    /// The correction of the last pass: its covariance and agreeing windows.
    pub fit: WindowFit,
    /// How the windows voted.
    pub vote: Vote,
    /// Edge of the windows of the last pass, pixels.
    pub window_size_px: usize,
    /// log10 of the number of such agreements expected by chance among the places refined.
    pub log10_window_false_alarms: f64,
    /// The last pass, and the pose that it started from.
    pub last_pass: (Pass, CameraPose),
    /// The windows of the last pass that held structure, which `fit.inliers` counts.
    pub matches: Vec<WindowMatch>,
    /// The view of the last pass, in whose pixels the windows lie.
    pub grid: GroundGrid,
    /// The coarse peak that was refined.
    pub peak: CoarsePeak,
}

impl RefinedPlace {
    /// Whether so few windows agreed in the first pass that no further pass was made.
    pub fn is_hopeless(&self) -> bool {
        self.log10_window_false_alarms > HOPELESS_LOG10_FALSE_ALARMS
    }

    /// Windows of the hard vote's edge at this level, `hard_px`, that the structure of the last pass fills.
    pub fn large_windows(&self, hard_px: usize) -> usize {
        (self.matches.len() * self.window_size_px.pow(2)).div_ceil(hard_px.pow(2))
    }

    fn is_same_place(&self, other: &Self) -> bool {
        let zoom = self.pose.zoom.min(other.pose.zoom);
        let (a, b) = (self.pose.at_zoom(zoom).nadir, other.pose.at_zoom(zoom).nadir);
        (a.x_px - b.x_px).hypot(a.y_px - b.y_px) < SAME_PLACE_PX
    }
}

/// How the windows of a place vote for its similarity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vote {
    /// Each for the one place where it fits best.
    Hard,
    /// Each for all places, by how well it fits there: `registration::soft_vote`.
    Soft,
}

/// One pass over the windows of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Zoom of the level.
    pub zoom: u8,
    /// Search radius of a window, pixels.
    pub radius_px: usize,
    /// Step of the search, pixels.
    pub step_px: usize,
    /// Largest residual of an agreeing window, pixels.
    pub tolerance_px: f64,
}

impl Pass {
    /// The last pass, at the finest level.
    pub fn last(finest: u8) -> Self {
        Self { zoom: finest, radius_px: LAST_RADIUS_PX, step_px: 2, tolerance_px: LAST_TOLERANCE_PX }
    }

    /// Matches the windows of an observation.
    pub fn match_windows(&self, observation: &Observation) -> Vec<WindowMatch> {
        let size_px = observation.window_size_px;
        let Self { radius_px, step_px, .. } = *self;
        observation.match_windows(&WindowOptions { size_px, stride_px: size_px, radius_px, step_px })
    }

    /// The similarity that most windows agree on, around the nadir of the observation.
    pub fn fit(&self, windows: &[WindowMatch], observation: &Observation) -> Option<WindowFit> {
        let options =
            WindowFitOptions { tolerance_px: self.tolerance_px, max_growth: MAX_GROWTH, max_turn_rad: MAX_TURN_RAD };
        fit_windows(windows, observation.view.grid.nadir_px, &options)
    }
}

/// The peaks refined so far: a search in steps meets its peaks again.
#[derive(Default)]
pub struct RefinedPeaks(Vec<(CameraPose, Option<RefinedPlace>)>);

/// Coarse peaks that are refined.
pub const REFINED_PEAKS: usize = 5;
/// Where the windows of one place agree by chance less often than this, peaks that are no rivals are skipped.
const SURE_LOG10_FALSE_ALARMS: f64 = -6.0;
/// A peak of at least this share of the highest is a rival, whatever the windows say.
const RIVAL_SHARE: f64 = 0.6;
/// Places nearer than this at the same level are one place, pixels.
const SAME_PLACE_PX: f64 = 6.0;
/// Search radius at the first level: covers the coarse search's steps in position, heading and scale.
pub const ENTRY_RADIUS_PX: usize = 8;
/// Search radius at the following levels, where the position is known to a pixel or two.
pub const FOLLOWING_RADIUS_PX: usize = 4;
/// Search radius of the last pass. Only windows at a wrong place are found far away: the wider the search, the more an agreement
/// proves.
pub const LAST_RADIUS_PX: usize = 8;
pub const ENTRY_TOLERANCE_PX: f64 = 2.0;
const LAST_TOLERANCE_PX: f64 = 1.25;
/// Where the windows of the first pass agree no better than this, the place is not refined. At right places 10^-2 at most was
/// seen, at wrong ones 10^3 at least.
const HOPELESS_LOG10_FALSE_ALARMS: f64 = 2.5;
/// Bounds on growth (ratio) and turn (radians) of one pass.
pub const MAX_GROWTH: f64 = 0.12;
pub const MAX_TURN_RAD: f64 = 0.14;

/// Refines the best coarse peaks to distinct places. `known` holds those that were refined before.
///
/// # Errors
/// [`LocateError::Store`] where a tile cannot be read; [`LocateError::Cancelled`].
pub fn refine_peaks(
    context: &SearchContext<'_>,
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    coarse: &CoarsePeaks,
    known: &mut RefinedPeaks,
) -> Result<Vec<RefinedPlace>, LocateError> {
    let mut found: Vec<RefinedPlace> = Vec::new();
    let highest = coarse.peaks.first().map_or(0.0, |p| p.statistic);
    for peak in coarse.peaks.iter().take(REFINED_PEAKS) {
        context.cancellation.check()?;
        let is_sure = found.iter().any(|r| r.log10_window_false_alarms < SURE_LOG10_FALSE_ALARMS);
        if is_sure && peak.statistic < RIVAL_SHARE * highest {
            break;
        }
        let refined = match known.0.iter().find(|(pose, _)| *pose == peak.pose) {
            Some((_, refined)) => refined.clone(),
            None => {
                let refined = refine_by_both_votes(context, map, prepared, *peak)?;
                known.0.push((peak.pose, refined.clone()));
                refined
            }
        };
        found.extend(refined.filter(|r| !found.iter().any(|other| other.is_same_place(r))));
    }
    Ok(found)
}

/// The vote with the fewest false alarms; the soft one is held only where the hard one leaves a doubt.
fn refine_by_both_votes(
    context: &SearchContext<'_>,
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    peak: CoarsePeak,
) -> Result<Option<RefinedPlace>, StoreError> {
    let hard = refine(map, prepared, peak)?;
    if hard.as_ref().is_some_and(|place| place.log10_window_false_alarms < SURE_LOG10_FALSE_ALARMS) {
        return Ok(hard);
    }
    let soft = SoftRefinement { view: &context.request.view, map, prepared, peak }.run()?;
    let better = |a: RefinedPlace, b: RefinedPlace| {
        if b.log10_window_false_alarms < a.log10_window_false_alarms { b } else { a }
    };
    Ok([hard, soft].into_iter().flatten().reduce(better))
}

/// Refines a peak down to the finest level, or ends after the first pass where too few windows agree. `None` where the windows
/// agree on no similarity.
fn refine(map: &Map<'_>, prepared: &PreparedFrame<'_>, peak: CoarsePeak) -> Result<Option<RefinedPlace>, StoreError> {
    let mut pose = peak.pose;
    let mut refined = None;
    for pass in passes(peak.pose.zoom, prepared.levels.finest) {
        let start = pose.at_zoom(pass.zoom);
        let Some(observation) = Observation::new(map, &prepared.frame, &start, pass.radius_px)? else {
            return Ok(None);
        };
        let windows = pass.match_windows(&observation);
        let Some(fit) = pass.fit(&windows, &observation) else { return Ok(None) };
        if fit.inliers.len() < 3 {
            return Ok(None);
        }
        pose = start.corrected(&fit.map_from_view);
        let place = RefinedPlace {
            pose,
            vote: Vote::Hard,
            window_size_px: observation.window_size_px,
            log10_window_false_alarms: log10_false_alarms(&fit, &windows, &pass),
            fit,
            last_pass: (pass, start),
            matches: windows,
            grid: observation.view.grid,
            peak,
        };
        if refined.is_none() && place.is_hopeless() {
            return Ok(Some(place));
        }
        refined = Some(place);
    }
    Ok(refined)
}

/// The passes from the level below the coarse search to the finest level, where a second pass follows.
fn passes(coarse: u8, finest: u8) -> Vec<Pass> {
    let first = (coarse + 1).min(finest);
    let entry = move |zoom| {
        let radius_px = if zoom == first { ENTRY_RADIUS_PX } else { FOLLOWING_RADIUS_PX };
        Pass { zoom, radius_px, step_px: 1, tolerance_px: ENTRY_TOLERANCE_PX }
    };
    (first..=finest).map(entry).chain([Pass::last(finest)]).collect()
}

fn log10_false_alarms(fit: &WindowFit, windows: &[WindowMatch], pass: &Pass) -> f64 {
    a_contrario::log10_nfa(&ConsensusCounts {
        matches: windows.len(),
        inliers: fit.inliers.len(),
        chance: a_contrario::inlier_chance(pass.tolerance_px, pass.radius_px),
        places: REFINED_PEAKS as f64,
    })
}
