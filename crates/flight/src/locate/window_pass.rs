//! `Pass`: one pass over the windows of one level.

use super::observation::Observation;
use overfly_core::registration::window_fit::{WindowFit, WindowFitOptions, fit_windows};
use overfly_core::registration::windows::{WindowMatch, WindowOptions};

/// Search radius at the first level: covers the coarse search's steps in position, heading and scale.
pub const ENTRY_RADIUS_PX: usize = 8;
/// Search radius at the following levels, where the position is known to a pixel or two.
const FOLLOWING_RADIUS_PX: usize = 4;
/// Search radius of the last pass. Only windows at a wrong place are found far away: the wider the search, the more an agreement
/// proves.
const LAST_RADIUS_PX: usize = 8;
const ENTRY_TOLERANCE_PX: f64 = 2.0;
const LAST_TOLERANCE_PX: f64 = 1.25;
/// Bound on the growth of one pass, a ratio.
pub const MAX_GROWTH: f64 = 0.12;
/// Bound on the turn of one pass, radians.
pub const MAX_TURN_RAD: f64 = 0.14;

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
    /// A pass that enters a level from the one before; the first covers what the coarse search leaves open.
    pub fn entry(zoom: u8, is_first: bool) -> Self {
        let radius_px = if is_first { ENTRY_RADIUS_PX } else { FOLLOWING_RADIUS_PX };
        Self { zoom, radius_px, step_px: 1, tolerance_px: ENTRY_TOLERANCE_PX }
    }

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
