//! `soft_refine`: a coarse peak refined by the soft vote of its windows, for views of which no window shows its place alone.

use super::camera_pose::CameraPose;
use super::coarse_peaks::CoarsePeak;
use super::held_vote::{BESIDE_PX, ENTRY_VOTER_PX, PLACES, held_vote};
use super::map::Map;
use super::observation::Observation;
use super::parts::{Part, Parts};
use super::place_estimate::{pose_with_tilt, tilt_sigma_rad};
use super::prepare::PreparedFrame;
use super::refined_place::{RefinedPlace, Vote};
use super::tilt_freedom::TiltFreedom;
use super::window_pass::{MAX_GROWTH, MAX_TURN_RAD, Pass};
use overfly_core::camera::View;
use overfly_core::registration::soft_vote::{SoftVote, SoftVoteOptions};
use overfly_core::registration::window_fit::{WindowFitOptions, fit_windows_about};
use overfly_store::StoreError;

/// Edge of a window that measures there: larger ones have sharper peaks.
const ENTRY_WINDOW_PX: usize = 10;
/// Edge at the finer levels, as a share of the hard vote's windows, and its bounds.
const FINER_WINDOW_SHARE: f64 = 2.0 / 3.0;
const FINER_WINDOWS_PX: (usize, usize) = (12, 24);
/// Growth and turn that a level finer than the first leaves open.
const FINER_CHANGE: f64 = 0.03;
/// A finer level is believed where it says at least this much by itself ...
const FINER_LOG10_FALSE_ALARMS: f64 = -3.0;
/// ... and at least so many windows agree.
const FINER_INLIERS: usize = 5;
/// Most rounds in which the tilt is measured and the vote held anew.
const TILT_ROUNDS: usize = 3;
/// Where a vote says no more than this, it is not held anew under the tilt that it elected.
const WORTH_ANOTHER_LOG10_FALSE_ALARMS: f64 = 1.0;
/// Where the first vote says no more than this, the place is not refined.
const HOPELESS_LOG10_FALSE_ALARMS: f64 = 0.0;

/// The inputs of a refinement.
pub struct SoftRefinement<'a> {
    /// The stated view, whose attitude bounds the tilt.
    pub view: &'a View,
    /// The parts of the method that are used.
    pub parts: Parts,
    /// The map of the layer.
    pub map: &'a Map<'a>,
    /// The frame.
    pub prepared: &'a PreparedFrame<'a>,
    /// The coarse peak.
    pub peak: CoarsePeak,
}

impl SoftRefinement<'_> {
    /// Refines the peak as far as finer levels still have evidence. `None` where the first vote is no evidence.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn run(&self) -> Result<Option<RefinedPlace>, StoreError> {
        let finest = self.prepared.levels.finest;
        let first = (self.peak.pose.zoom + 1).min(finest);
        let Some(entry) = self.elected(first, self.peak.pose, true)? else { return Ok(None) };
        let mut best = self.tilted(entry)?;
        if best.log10_window_false_alarms > HOPELESS_LOG10_FALSE_ALARMS {
            return Ok(None);
        }
        for zoom in first + 1..=finest {
            let Some(finer) = self.elected(zoom, best.pose, false)? else { break };
            let is_evidence = finer.log10_window_false_alarms <= FINER_LOG10_FALSE_ALARMS;
            if !is_evidence || finer.fit.inliers.len() < FINER_INLIERS {
                break;
            }
            // The place of the finer level, with the evidence of the level that has more.
            let log10_window_false_alarms = finer.log10_window_false_alarms.min(best.log10_window_false_alarms);
            best = RefinedPlace { log10_window_false_alarms, ..finer };
        }
        Ok(Some(best))
    }

    /// The place with the tilt that its windows show, as long as the vote then says more.
    fn tilted(&self, mut place: RefinedPlace) -> Result<RefinedPlace, StoreError> {
        let rounds = if self.parts.has(Part::Tilt) { TILT_ROUNDS } else { 0 };
        for _ in 0..rounds {
            let Some(pose) = pose_with_tilt(&place, self.view, self.prepared.frame.camera()) else { break };
            let again = self.elected(pose.zoom, pose, true)?;
            let better = again.filter(|again| again.log10_window_false_alarms < place.log10_window_false_alarms);
            let Some(better) = better else { break };
            place = better;
        }
        Ok(place)
    }

    /// The place near a pose that the vote at one level elects; `None` where it elects none.
    fn elected(&self, zoom: u8, pose: CameraPose, is_first: bool) -> Result<Option<RefinedPlace>, StoreError> {
        let Some(mut found) = self.held(zoom, pose, is_first)? else { return Ok(None) };
        if found.vote.tilt_rad != [0.0; 2] && found.vote.log10_nfa(PLACES) <= WORTH_ANOTHER_LOG10_FALSE_ALARMS {
            // The windows again, as the elected camera sees them.
            let again = self.held(zoom, found.elected_pose(), is_first)?;
            let is_better = |again: &HeldVote| again.vote.log10_nfa(PLACES) < found.vote.log10_nfa(PLACES);
            if let Some(again) = again.filter(is_better) {
                found = again;
            }
        }
        let HeldVote { start, pass, observation, vote, options } = found;
        let size_px = observation.window_size_px;
        let surfaces = observation.square_surfaces(size_px, pass.radius_px);
        let matches: Vec<_> = surfaces.iter().filter_map(|surface| surface.matched(pass.radius_px)).collect();
        let SoftVoteOptions { max_growth, max_turn_rad, .. } = options;
        let options = WindowFitOptions { tolerance_px: pass.tolerance_px, max_growth, max_turn_rad };
        let nadir_px = observation.view.grid.nadir_px;
        let Some(fit) = fit_windows_about(&vote.map_from_view, &matches, nadir_px, &options) else { return Ok(None) };
        Ok(Some(RefinedPlace {
            pose: start.corrected(&fit.map_from_view),
            vote: Vote::Soft,
            window_size_px: size_px,
            log10_window_false_alarms: vote.log10_nfa(PLACES),
            fit,
            last_pass: (pass, start),
            matches,
            grid: observation.view.grid,
            relief: observation.relief,
            peak: self.peak,
        }))
    }

    /// The vote near a pose at one level; the first level's also elects the tilt that the attitude leaves open. `None` where no windows
    /// vote.
    fn held(&self, zoom: u8, pose: CameraPose, is_first: bool) -> Result<Option<HeldVote>, StoreError> {
        let start = pose.at_zoom(zoom);
        let pass = Pass::entry(zoom, true);
        let margin_px = pass.radius_px + BESIDE_PX as usize;
        let Some(observation) = Observation::new(self.map, &self.prepared.frame, &start, margin_px)? else {
            return Ok(None);
        };
        let finer_px = (observation.window_size_px as f64 * FINER_WINDOW_SHARE) as usize;
        let finer_px = finer_px.clamp(FINER_WINDOWS_PX.0, FINER_WINDOWS_PX.1);
        let entry_px = if self.parts.has(Part::SmallWindows) { ENTRY_VOTER_PX } else { ENTRY_WINDOW_PX };
        let (voter_px, size_px) = if is_first { (entry_px, ENTRY_WINDOW_PX) } else { (finer_px, finer_px) };
        let observation = Observation { window_size_px: size_px, ..observation };
        let [max_growth, max_turn_rad] = if is_first { [MAX_GROWTH, MAX_TURN_RAD] } else { [FINER_CHANGE; 2] };
        let options =
            SoftVoteOptions { radius_px: pass.radius_px, max_shift_px: pass.radius_px, max_growth, max_turn_rad };
        let tilt =
            tilt_sigma_rad(self.view, observation.relief.is_some()).filter(|_| is_first && self.parts.has(Part::Tilt));
        let tilt = tilt.map(|sigma_rad| TiltFreedom { pose: start, camera: self.prepared.frame.camera(), sigma_rad });
        let vote = held_vote(&observation, voter_px, tilt.as_ref(), self.parts, &options);
        Ok(vote.map(|vote| HeldVote { start, pass, observation, vote, options }))
    }
}

/// A vote with what it was held on.
struct HeldVote {
    /// The pose that the observation was rendered through.
    start: CameraPose,
    pass: Pass,
    observation: Observation,
    vote: SoftVote,
    options: SoftVoteOptions,
}

impl HeldVote {
    fn elected_pose(&self) -> CameraPose {
        let [pitch_rad, roll_rad] = self.start.tilt_rad;
        let tilt_rad = [pitch_rad + self.vote.tilt_rad[0], roll_rad + self.vote.tilt_rad[1]];
        CameraPose { tilt_rad, ..self.start.corrected(&self.vote.map_from_view) }
    }
}
