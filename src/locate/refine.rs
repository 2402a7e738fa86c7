//! Refinement: from a coarse place through ever finer levels by local windows, to a similarity with its evidence.

use super::map::{Map, PixelWindow};
use super::pose::{Frame, Pose, structure_of};
use crate::feature::Structure;
use crate::registration::evidence::{self, Agreement};
use crate::registration::similarity::{self, Fit, FitOptions};
use crate::registration::windows::{WindowMatch, WindowOptions, match_windows};
use crate::store::StoreError;
use crate::tile::{WorldPixel, gsd_at};

/// A place looked at closely.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The corrected pose, in the finest level's pixels.
    pub pose: Pose,
    /// The last correction: its covariance and windows.
    pub fit: Fit,
    /// Windows that held structure in the last pass.
    pub windows: usize,
    /// log10 of the number of false alarms.
    pub log10_false_alarms: f64,
}

/// One pass over the windows of one level.
#[derive(Debug, Clone, Copy)]
struct Pass {
    zoom: u8,
    radius_px: usize,
    tolerance_px: f64,
}

/// Search radius where a level is entered: covers the coarse level's step in place, heading and scale.
const ENTRY_RADIUS_PX: usize = 8;
/// Search radius of the last pass, where only chance would lead far.
const LAST_RADIUS_PX: usize = 5;
const ENTRY_TOLERANCE_PX: f64 = 2.0;
const LAST_TOLERANCE_PX: f64 = 1.25;
/// Bounds on one pass's growth and turn (radians).
const MAX_GROWTH: f64 = 0.12;
const MAX_TURN_RAD: f64 = 0.14;
/// Passes over the finest level.
const FINEST_PASSES: usize = 2;

/// Refines `start` down to `finest`. `frame` must be prepared for every level between. `None` where the windows do
/// not agree on anything.
///
/// # Errors
/// Where the store cannot give a tile.
pub fn refine(
    map: &mut Map<'_>,
    frame: &Frame<'_>,
    start: Pose,
    finest: u8,
    places: f64,
) -> Result<Option<Refined>, StoreError> {
    let mut pose = start;
    let mut refined = None;
    for pass in passes(start.zoom, finest) {
        pose = pose.at_zoom(pass.zoom);
        let Some(matches) = look(map, frame, &pose, &pass)? else { return Ok(None) };
        let options =
            FitOptions { tolerance_px: pass.tolerance_px, max_growth: MAX_GROWTH, max_turn_rad: MAX_TURN_RAD };
        let Some(fit) = similarity::fit(&matches.windows, matches.pivot_px, &options) else { return Ok(None) };
        if fit.inliers.len() < 3 {
            return Ok(None);
        }
        let p = fit.parameters;
        pose = pose.corrected([p[0], p[1]], p[2], p[3]);
        refined = Some(assess(pose, fit, &matches.windows, &pass, places));
    }
    Ok(refined)
}

/// Levels from the one below the coarse search to the finest, which is passed over again.
fn passes(coarse: u8, finest: u8) -> Vec<Pass> {
    let first = (coarse + 1).min(finest);
    let entry = |zoom| Pass { zoom, radius_px: ENTRY_RADIUS_PX, tolerance_px: ENTRY_TOLERANCE_PX };
    let last = Pass { zoom: finest, radius_px: LAST_RADIUS_PX, tolerance_px: LAST_TOLERANCE_PX };
    (first..=finest).map(entry).chain(std::iter::repeat_n(last, FINEST_PASSES)).collect()
}

struct Looked {
    windows: Vec<WindowMatch>,
    pivot_px: [f64; 2],
}

fn look(map: &mut Map<'_>, frame: &Frame<'_>, pose: &Pose, pass: &Pass) -> Result<Option<Looked>, StoreError> {
    let Ok(place) = pose.nadir.to_geodetic(pass.zoom) else { return Ok(None) };
    let gsd = gsd_at(place, pass.zoom);
    let WorldPixel { x_px, y_px } = pose.nadir;
    let fraction = [x_px - x_px.floor(), y_px - y_px.floor()];
    let Some(view) = frame.view(pass.zoom, gsd, pose.heading_rad, pose.height_ratio, fraction) else {
        return Ok(None);
    };
    let pivot_px = view.grid.nadir_px;
    let radius = pass.radius_px as i64;
    // The view's nadir and the pose's differ by whole pixels.
    let left = (x_px - pivot_px[0]).round() as i64 - radius;
    let top = (y_px - pivot_px[1]).round() as i64 - radius;
    let window = PixelWindow {
        zoom: pass.zoom,
        left,
        top,
        width_px: view.grid.width_px + 2 * pass.radius_px,
        height_px: view.grid.height_px + 2 * pass.radius_px,
    };
    let (gray, mask) = map.window(&window)?;
    let (seen, ground) = (structure_of(&view), Structure::of(&gray, &mask));
    let size_px = window_size(frame, gsd.mean_m_per_px() / pose.height_ratio);
    let options = WindowOptions { size_px, stride_px: size_px, radius_px: pass.radius_px };
    let windows = match_windows(&seen, &ground, [radius as isize; 2], &options);
    Ok(Some(Looked { windows, pivot_px }))
}

/// A fifth of the frame's edge, a multiple of 8 from 16 to 48 px.
fn window_size(frame: &Frame<'_>, gsd_m_per_px: f64) -> usize {
    let (w, h) = frame.camera().frame_size_px();
    let edge_px = (f64::from(w) * f64::from(h)).sqrt() * frame.camera().gsd_m_per_px() / gsd_m_per_px;
    ((edge_px / 5.0 / 8.0).round() as usize * 8).clamp(16, 48)
}

fn assess(pose: Pose, fit: Fit, windows: &[WindowMatch], pass: &Pass, places: f64) -> Refined {
    let agreement = Agreement {
        windows: windows.len(),
        agreeing: fit.inliers.len(),
        chance: evidence::chance_of_one(pass.tolerance_px, pass.radius_px),
        places,
    };
    Refined {
        pose,
        windows: windows.len(),
        log10_false_alarms: evidence::log10_false_alarms(&agreement),
        fit,
    }
}
