//! `held_vote`: the soft vote of an observation, weighted by what its windows show together on the ground beside.

use super::observation::Observation;
use super::parts::{Part, Parts};
use super::refined_place::REFINED_PEAKS;
use super::tilt_freedom::TiltFreedom;
use super::window_pass::ENTRY_RADIUS_PX;
use overfly_core::registration::clutter::{Parity, WindowWeights};
use overfly_core::registration::ranked_windows::RankedWindows;
use overfly_core::registration::soft_vote::{SoftVote, SoftVoteOptions, soft_vote};

/// Distance of the search squares in which the variance of the vote is measured, pixels: they touch the one that is searched.
pub const BESIDE_PX: isize = 2 * ENTRY_RADIUS_PX as isize + 1;
/// The middles of these squares.
const BESIDE: [(Parity, [isize; 2]); 8] = {
    const D: isize = BESIDE_PX;
    let corners = [[-D, -D], [D, -D], [-D, D], [D, D]];
    let edges = [[0, -D], [-D, 0], [D, 0], [0, D]];
    let [a, b, c, d] = corners;
    let [e, f, g, h] = edges;
    [
        (Parity::Corner, a),
        (Parity::Corner, b),
        (Parity::Corner, c),
        (Parity::Corner, d),
        (Parity::Edge, e),
        (Parity::Edge, f),
        (Parity::Edge, g),
        (Parity::Edge, h),
    ]
};
/// Votes of which the better is taken: the hard one and the soft one.
const VOTES: f64 = 2.0;
/// Views that vote, and votes on each.
pub const PLACES: f64 = VOTES * REFINED_PEAKS as f64;
/// Edge of a window that votes at the first level: small ones follow leaning houses and relief, and there are more of them.
pub const ENTRY_VOTER_PX: usize = 6;
/// Where windows that were independent would say no more than this, nothing is measured.
const MOST_LOG10_FALSE_ALARMS: f64 = 0.0;

/// The vote of the windows of an edge of `voter_px`, weighted by what they show together on the ground beside; `None` where even windows
/// of equal weight, as independent as they ever are, would say nothing. The vote also elects the tilt where it is free.
pub fn held_vote(
    observation: &Observation,
    voter_px: usize,
    tilt: Option<&TiltFreedom<'_>>,
    parts: Parts,
    options: &SoftVoteOptions,
) -> Option<SoftVote> {
    let nadir_px = observation.view.grid.nadir_px;
    let surfaces = observation.square_surfaces(voter_px, options.radius_px);
    let motion = tilt.and_then(|tilt| tilt.motion(observation, &surfaces));
    let windows = RankedWindows::new(&surfaces);
    let equal = soft_vote(&windows, &WindowWeights::equal(surfaces.len()), motion.as_ref(), nadir_px, options)?;
    if equal.log10_nfa(PLACES) > MOST_LOG10_FALSE_ALARMS {
        return None;
    }
    let beside =
        BESIDE.map(|(parity, offset_px)| (parity, observation.surfaces_beside(voter_px, options.radius_px, offset_px)));
    let weights =
        if parts.has(Part::WindowWeights) { WindowWeights::adapted(&beside) } else { WindowWeights::measured(&beside) };
    soft_vote(&windows, &weights, motion.as_ref(), nadir_px, options)
}
