//! `hard_refine`: a coarse peak refined by the hard vote of its windows, each of which is found at one place.

use super::coarse_peaks::CoarsePeak;
use super::map::Map;
use super::observation::Observation;
use super::prepare::PreparedFrame;
use super::refined_place::{REFINED_PEAKS, RefinedPlace, Vote};
use super::window_pass::Pass;
use overfly_core::registration::a_contrario::{self, ConsensusCounts};
use overfly_core::registration::window_fit::WindowFit;
use overfly_core::registration::windows::WindowMatch;
use overfly_store::StoreError;

/// Refines a peak down to the finest level, or ends after the first pass where too few windows agree. `None` where the windows
/// agree on no similarity.
///
/// # Errors
/// Where a tile cannot be read.
pub fn hard_refine(
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    peak: CoarsePeak,
) -> Result<Option<RefinedPlace>, StoreError> {
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
            relief: observation.relief,
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
    (first..=finest).map(|zoom| Pass::entry(zoom, zoom == first)).chain([Pass::last(finest)]).collect()
}

fn log10_false_alarms(fit: &WindowFit, windows: &[WindowMatch], pass: &Pass) -> f64 {
    a_contrario::log10_nfa(&ConsensusCounts {
        matches: windows.len(),
        inliers: fit.inliers.len(),
        chance: a_contrario::inlier_chance(pass.tolerance_px, pass.radius_px),
        places: REFINED_PEAKS as f64,
    })
}
