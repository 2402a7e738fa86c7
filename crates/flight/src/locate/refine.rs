//! Refinement: from a coarse place through ever finer levels by local windows, to a similarity with its evidence.

use super::map::{Map, PixelWindow};
use super::pose::{Frame, Pose, structure_of};
use overfly_core::feature::Structure;
use overfly_core::registration::a_contrario::{self, ConsensusCounts};
use overfly_core::registration::peak_z_score::{self, peak_z_score};
use overfly_core::registration::window_fit::{WindowFit, WindowFitOptions, fit_windows};
use overfly_core::registration::windows::{WindowMatch, WindowOptions, match_windows};
use overfly_core::tile::{WorldPixel, gsd_at};
use overfly_store::StoreError;

/// A place looked at closely.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The corrected pose, in the finest level's pixels.
    pub pose: Pose,
    /// The last correction: its covariance and windows.
    pub fit: WindowFit,
    /// Windows that held structure in the last pass.
    pub windows: usize,
    /// log10 of the number of accidental agreements to expect among the places looked at.
    pub log10_accidents: f64,
}

impl Refined {
    /// Whether so little agreed at first sight that nothing was refined.
    pub fn is_hopeless(&self) -> bool {
        self.log10_accidents > HOPELESS_LOG10_ACCIDENTS
    }
}

/// One pass over the windows of one level.
#[derive(Debug, Clone, Copy)]
struct Pass {
    zoom: u8,
    radius_px: usize,
    step_px: usize,
    tolerance_px: f64,
}

/// Search radius at the first level: covers the coarse search's steps in place, heading and scale.
const ENTRY_RADIUS_PX: usize = 8;
/// Search radius at the levels below, where the place is known to a pixel or two.
const FOLLOWING_RADIUS_PX: usize = 4;
/// Search radius of the last pass, where only chance would lead far: the wider, the more an agreement proves.
const LAST_RADIUS_PX: usize = 8;
const ENTRY_TOLERANCE_PX: f64 = 2.0;
const LAST_TOLERANCE_PX: f64 = 1.25;
/// Where the windows of the first pass agree no better than this, there is nothing to refine. Over the right place they
/// were seen at 10^-2 at most, over wrong ones at 10^3 at least.
const HOPELESS_LOG10_ACCIDENTS: f64 = 2.5;
/// Bounds on one pass's growth and turn (radians).
const MAX_GROWTH: f64 = 0.12;
const MAX_TURN_RAD: f64 = 0.14;

/// Refines `start` down to `finest`, or, where nothing agrees at first sight, no further than that. `frame` must be prepared for every level between. `None` where the windows do
/// not agree on anything.
///
/// # Errors
/// Where the store cannot give a tile.
pub fn refine(
    map: &Map<'_>,
    frame: &Frame<'_>,
    start: Pose,
    finest: u8,
    places: f64,
) -> Result<Option<Refined>, StoreError> {
    let mut pose = start;
    let mut refined = None;
    for pass in passes(start.zoom, finest) {
        pose = pose.at_zoom(pass.zoom);
        let Some(looked) = look(map, frame, &pose, pass.radius_px)? else { return Ok(None) };
        let size_px = window_size(frame, looked.gsd_m_per_px / pose.height_ratio);
        let layout = WindowOptions { size_px, stride_px: size_px, radius_px: pass.radius_px, step_px: pass.step_px };
        let windows = match_windows(&looked.view, &looked.ground, [pass.radius_px as isize; 2], &layout);
        let options =
            WindowFitOptions { tolerance_px: pass.tolerance_px, max_growth: MAX_GROWTH, max_turn_rad: MAX_TURN_RAD };
        let Some(fit) = fit_windows(&windows, looked.pivot_px, &options) else { return Ok(None) };
        if fit.inliers.len() < 3 {
            return Ok(None);
        }
        pose = pose.corrected(&fit.map_from_view);
        let found = assess(pose, fit, &windows, &pass, places);
        if refined.is_none() && found.is_hopeless() {
            return Ok(Some(found));
        }
        refined = Some(found);
    }
    Ok(refined)
}

/// How high the whole view stands above its surroundings at a refined place, standard deviations.
///
/// # Errors
/// Where the store cannot give a tile.
pub fn peak_z_score_of(map: &Map<'_>, frame: &Frame<'_>, refined: &Refined) -> Result<f64, StoreError> {
    let looked = look(map, frame, &refined.pose, peak_z_score::REACH_PX)?;
    let found = looked.and_then(|l| peak_z_score(&l.view, &l.ground, [peak_z_score::REACH_PX; 2]));
    Ok(found.unwrap_or(0.0))
}

/// Levels from the one below the coarse search to the finest, which is passed over again.
fn passes(coarse: u8, finest: u8) -> Vec<Pass> {
    let first = (coarse + 1).min(finest);
    let entry = move |zoom| {
        let radius_px = if zoom == first { ENTRY_RADIUS_PX } else { FOLLOWING_RADIUS_PX };
        Pass { zoom, radius_px, step_px: 1, tolerance_px: ENTRY_TOLERANCE_PX }
    };
    let last = Pass { zoom: finest, radius_px: LAST_RADIUS_PX, step_px: 2, tolerance_px: LAST_TOLERANCE_PX };
    (first..=finest).map(entry).chain([last]).collect()
}

/// A view through a pose and the map under it.
struct Looked {
    view: Structure,
    ground: Structure,
    /// The nadir in the view.
    pivot_px: [f64; 2],
    gsd_m_per_px: f64,
}

/// The frame through a pose, and the map that it should lie on with `margin_px` around.
fn look(map: &Map<'_>, frame: &Frame<'_>, pose: &Pose, margin_px: usize) -> Result<Option<Looked>, StoreError> {
    let Ok(place) = pose.nadir.to_geodetic(pose.zoom) else { return Ok(None) };
    let gsd = gsd_at(place, pose.zoom);
    let WorldPixel { x_px, y_px } = pose.nadir;
    let fraction = [x_px - x_px.floor(), y_px - y_px.floor()];
    let Some(view) = frame.view(pose.zoom, gsd, pose.heading_rad, pose.height_ratio, fraction) else {
        return Ok(None);
    };
    let pivot_px = view.grid.nadir_px;
    // The view's nadir and the pose's differ by whole pixels.
    let window = PixelWindow {
        zoom: pose.zoom,
        left: (x_px - pivot_px[0]).round() as i64 - margin_px as i64,
        top: (y_px - pivot_px[1]).round() as i64 - margin_px as i64,
        width_px: view.grid.width_px + 2 * margin_px,
        height_px: view.grid.height_px + 2 * margin_px,
    };
    let ground = map.window(&window)?;
    let gsd_m_per_px = gsd.mean_m_per_px();
    Ok(Some(Looked { view: structure_of(&view), ground, pivot_px, gsd_m_per_px }))
}

/// A sixth of the frame's edge, a multiple of 8 from 16 to 48 px.
fn window_size(frame: &Frame<'_>, gsd_m_per_px: f64) -> usize {
    let (w, h) = frame.camera().frame_size_px();
    let edge_px = (f64::from(w) * f64::from(h)).sqrt() * frame.camera().gsd_m_per_px() / gsd_m_per_px;
    ((edge_px / 6.0 / 8.0).round() as usize * 8).clamp(16, 48)
}

fn assess(pose: Pose, fit: WindowFit, windows: &[WindowMatch], pass: &Pass, places: f64) -> Refined {
    let agreement = ConsensusCounts {
        matches: windows.len(),
        inliers: fit.inliers.len(),
        chance: a_contrario::inlier_chance(pass.tolerance_px, pass.radius_px),
        places,
    };
    Refined { pose, windows: windows.len(), log10_accidents: a_contrario::log10_nfa(&agreement), fit }
}
