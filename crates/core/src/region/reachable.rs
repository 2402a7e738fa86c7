//! The ground that an image can show after a flight of stated length with a least turn radius, as one outline.

use super::bearings::Bearings;
use super::polygon::Vertex;
use super::simplify::enclose;
use super::turns::{BOUNDING, LONG, TurningFlight};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Beyond this radius a flight within a region's reach bends by less than 50 micrometres: it is taken for this one.
const STRAIGHT_M: f64 = 1e15;

/// How far the cover may stand off the ground that it covers, in parts of the width of the band that is reached; but no
/// finer than this part of the length, which bounds the work.
const SLACK: f64 = 0.006;
const LEAST_SLACK: f64 = 3e-5;

/// Vertices of the outline, and the share of area that having no more may cost.
const VERTICES: usize = 128;
const BUDGET: f64 = 0.004;

/// Outline of all ground that an image can show at the end of a flight, counterclockwise, right and ahead of the
/// start in metres; the start is known to within half of `inaccuracy_m` to each side. Never too small; seen from the
/// start everything between the nearest and the farthest of a bearing counts, and what such ground encloses.
///
/// Why nothing is missing: move an image that can be reached away from the start, without turning it. Where it stops to
/// be reachable it stands on the boundary of the reachable set, so at the end of a path of [`BOUNDING`], which the
/// cover holds; likewise towards the start. Both hold the same bearing, so all between them is inside.
/// A turn of more than a circle is a circle and the set of a flight shorter by it.
pub(super) fn reachable_outline(flight: TurningFlight, inaccuracy_m: f64) -> Vec<Vertex> {
    let flight = TurningFlight { radius_m: flight.radius_m.min(STRAIGHT_M), ..flight };
    let TurningFlight { length_m, radius_m, across_m, along_m } = flight;
    // Rounding: a few parts in 1e15 of the lengths that are added, more where a side points almost at the start.
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
            // Three turns of no more than a circle each are never longer than this.
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

/// About on which bearing the set ends: that of a turn all the way, and the image there. Sets how finely bearings are
/// stepped; what is covered does not depend on it.
fn last_bearing_rad(length_m: f64, radius_m: f64, reach_m: f64) -> f64 {
    let turn_rad = length_m / radius_m;
    if turn_rad >= PI || length_m <= reach_m {
        return PI;
    }
    turn_rad / 2.0 + 1.1 * (reach_m / (2.0 * radius_m * (turn_rad / 2.0).sin())).min(1.0).asin()
}

/// About how wide the band of reachable positions is: 0.03 L^3 / R^2 where it is thin (measured), about a third of the
/// length where it is not. Sets how finely curves are followed; what is covered does not depend on it.
fn spread_m(length_m: f64, radius_m: f64) -> f64 {
    (0.03 * length_m * (length_m / radius_m).powi(2)).min(0.3 * length_m)
}

#[cfg(test)]
pub(super) mod tests;
