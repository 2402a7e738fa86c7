//! The outline of the ground that an image can show after a flight of stated length with a smallest turn radius.

use super::bearings::Bearings;
use super::polygon::Vertex;
use super::simplify::enclose;
use super::turns::{BOUNDING, LONG, TurningFlight};
use std::f64::consts::{PI, SQRT_2, TAU};

/// The largest turn radius: a flight within a region's reach bends by less than 50 micrometres at any larger one.
const STRAIGHT_M: f64 = 1e15;

/// Tolerance of the cover, as a part of the width of the reachable band, and its lower limit as a part of the flight's
/// length, which bounds the work.
const SLACK: f64 = 0.006;
const LEAST_SLACK: f64 = 3e-5;

/// Number of vertices of the outline, and the share by which its area may grow to reach that number.
const VERTICES: usize = 128;
const BUDGET: f64 = 0.004;

/// The outline of all ground that an image can show at the end of a flight: counterclockwise, offsets right and ahead of
/// the start, metres. The start is known to within half of `inaccuracy_m` to each side. The outline is never too small. It
/// contains everything between the nearest and the farthest reachable point of each bearing, and all ground that is enclosed.
///
/// No reachable image is missing: move such an image away from the start without turning it. It stops being reachable on
/// the boundary of the reachable set, so at the end of a path of [`BOUNDING`], which the cover contains. The same holds
/// towards the start. Both ends lie on the same bearing, so everything between them is inside. A turn of more than a circle
/// is a circle followed by a flight that is shorter by its length.
pub(super) fn reachable_outline(flight: TurningFlight, inaccuracy_m: f64) -> Vec<Vertex> {
    let flight = TurningFlight { radius_m: flight.radius_m.min(STRAIGHT_M), ..flight };
    let TurningFlight { length_m, radius_m, across_m, along_m } = flight;
    // Rounding adds a few parts in 1e15 of the lengths, and more where a side points almost at the start.
    let border_m = inaccuracy_m / 2.0 + 1e-7 * (length_m + flight.corner_m());
    let band_m = across_m.min(along_m) + inaccuracy_m + spread_m(length_m, radius_m);
    let slack_m = (SLACK * band_m).max(LEAST_SLACK * length_m);
    let (circle_m, reach_m) = (TAU * radius_m, flight.corner_m() + SQRT_2 * border_m + slack_m);
    let mut cover = Bearings::focused(last_bearing_rad(length_m, radius_m, reach_m));
    if length_m >= circle_m {
        // The start itself can be reached again, on a circle as long as the flight.
        cover.fill();
    }
    let mut left = Some(flight);
    while let Some(flight) = left {
        for turns in BOUNDING {
            // Three turns of at most a circle each are never longer than LONG radii.
            if turns[1] == 0.0 || length_m < LONG * radius_m {
                flight.add_to(&mut cover, turns, border_m, slack_m);
            }
        }
        let shorter_m = flight.length_m - circle_m;
        left = (shorter_m > 0.0 && length_m < LONG * radius_m && shorter_m + reach_m >= cover.covered_radius())
            .then_some(TurningFlight { length_m: shorter_m, ..flight });
    }
    enclose(cover.outline(), VERTICES, BUDGET)
}

/// Approximate bearing at which the set ends: the end of a turn all the way, plus the image. It only sets the steps of the
/// bearings; the cover does not depend on it.
fn last_bearing_rad(length_m: f64, radius_m: f64, reach_m: f64) -> f64 {
    let turn_rad = length_m / radius_m;
    if turn_rad >= PI || length_m <= reach_m {
        return PI;
    }
    turn_rad / 2.0 + 1.1 * (reach_m / (2.0 * radius_m * (turn_rad / 2.0).sin())).min(1.0).asin()
}

/// Approximate width of the band of reachable positions: 0.03 L^3 / R^2 where it is thin (measured), else about a third of
/// the length. It only sets the steps along curves; the cover does not depend on it.
fn spread_m(length_m: f64, radius_m: f64) -> f64 {
    (0.03 * length_m * (length_m / radius_m).powi(2)).min(0.3 * length_m)
}

#[cfg(test)]
pub(super) mod tests;
