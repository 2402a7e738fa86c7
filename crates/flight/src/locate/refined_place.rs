//! `RefinedPlace`: a coarse peak refined to a place, with the windows that agree on it.

use super::camera_pose::CameraPose;
use super::coarse_peaks::CoarsePeak;
use super::window_pass::Pass;
use overfly_core::camera::{GroundGrid, Relief};
use overfly_core::registration::window_fit::WindowFit;
use overfly_core::registration::windows::WindowMatch;
use std::sync::Arc;

/// Coarse peaks that are refined.
pub const REFINED_PEAKS: usize = 5;
/// Places nearer than this at the coarser of their levels are one place, pixels.
const SAME_PLACE_PX: f64 = 6.0;
/// Where the windows of the first pass agree no better than this, the place is not refined. At right places 10^-2 at most was
/// seen, at wrong ones 10^3 at least.
const HOPELESS_LOG10_FALSE_ALARMS: f64 = 2.5;

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
    /// The relief under that view, where it is known.
    pub relief: Option<Arc<Relief>>,
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

    /// Whether both places are one.
    pub fn is_same_place(&self, other: &Self) -> bool {
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
