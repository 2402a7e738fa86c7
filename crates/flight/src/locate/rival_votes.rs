//! `RivalVotes`: whether the windows of a view, which tell a place from chance, tell a rival of it from chance too.
//!
//! All windows agree on a copy of the ground as they agree on the place. A rival on which they do not is no copy, only the highest of many
//! places that fit by chance.

use super::camera_pose::CameraPose;
use super::held_vote::{BESIDE_PX, ENTRY_VOTER_PX, held_vote};
use super::map::Map;
use super::observation::Observation;
use super::parts::Parts;
use super::prepare::PreparedFrame;
use super::window_pass::ENTRY_RADIUS_PX;
use overfly_core::registration::soft_vote::SoftVoteOptions;
use overfly_store::StoreError;

/// A rival is chance where its windows say no more than this: log10 of the number of false alarms of a vote at that place alone ...
const CHANCE_LOG10_FALSE_ALARMS: f64 = -1.0;
/// ... and the same windows say at least this of the place.
const TOLD_LOG10_FALSE_ALARMS: f64 = -4.0;
/// What a vote leaves open: pixels, and growth and turn.
const SHIFT_PX: usize = 2;
const CHANGE: f64 = 0.05;

/// The votes at a place and at its rivals.
pub struct RivalVotes<'a> {
    map: &'a Map<'a>,
    prepared: &'a PreparedFrame<'a>,
    place: CameraPose,
    /// What the windows say of the place, once it was asked for.
    of_place: Option<f64>,
}

impl<'a> RivalVotes<'a> {
    /// Votes are held when they are asked for.
    pub fn new(map: &'a Map<'a>, prepared: &'a PreparedFrame<'a>, place: CameraPose) -> Self {
        Self { map, prepared, place, of_place: None }
    }

    /// Whether the windows tell the place from chance and this rival not.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn are_chance(&mut self, rival: &CameraPose) -> Result<bool, StoreError> {
        let of_place = match self.of_place {
            Some(known) => known,
            None => *self.of_place.insert(self.log10_nfa(&self.place)?),
        };
        Ok(of_place <= TOLD_LOG10_FALSE_ALARMS && self.log10_nfa(rival)? >= CHANCE_LOG10_FALSE_ALARMS)
    }

    /// log10 of the number of false alarms of the soft vote near a pose, at the level where it enters; infinite where there is none.
    fn log10_nfa(&self, pose: &CameraPose) -> Result<f64, StoreError> {
        let levels = self.prepared.levels;
        let pose = pose.at_zoom((levels.coarse + 1).min(levels.finest));
        let margin_px = ENTRY_RADIUS_PX + BESIDE_PX as usize;
        let Some(observation) = Observation::new(self.map, &self.prepared.frame, &pose, margin_px)? else {
            return Ok(f64::INFINITY);
        };
        let options = SoftVoteOptions {
            radius_px: ENTRY_RADIUS_PX,
            max_shift_px: SHIFT_PX,
            max_growth: CHANGE,
            max_turn_rad: CHANGE,
        };
        let vote = held_vote(&observation, ENTRY_VOTER_PX, None, Parts::ALL, &options);
        Ok(vote.map_or(f64::INFINITY, |vote| vote.log10_nfa(1.0)))
    }
}
