//! The headings and scales to try, from what the sensors leave open.

use super::coarse_search::Hypothesis;
use super::{FixRequest, HeadingPrior};
use std::f64::consts::{PI, TAU};

/// How many standard deviations of heading and scale are searched.
const REACH_SIGMAS: f64 = 3.0;
/// A step may move the frame's edge by this many coarse pixels.
const STEP_PX: f64 = 2.4;

/// All combinations for a frame whose half diagonal has `half_diagonal_px` coarse pixels, the stated ones first.
pub fn hypotheses(request: &FixRequest, half_diagonal_px: f64) -> Vec<Hypothesis> {
    let step = STEP_PX / half_diagonal_px.max(STEP_PX);
    let ratios = around(REACH_SIGMAS * request.scale_sigma_ratio, 1.5 * step);
    let headings: Vec<f64> = match request.heading {
        Some(HeadingPrior { heading_rad, sigma_rad }) if REACH_SIGMAS * sigma_rad < PI => {
            around(REACH_SIGMAS * sigma_rad, step).into_iter().map(|d| heading_rad + d).collect()
        }
        _ => {
            let count = (TAU / step).ceil();
            (0..count as usize).map(|i| i as f64 * TAU / count).collect()
        }
    };
    ratios
        .iter()
        .flat_map(|&r| headings.iter().map(move |&heading_rad| Hypothesis { heading_rad, height_ratio: r.exp() }))
        .collect()
}

/// Zero, then pairs outwards, at most `step` apart, so that nothing within `reach` is farther than half a step.
fn around(reach: f64, step: f64) -> Vec<f64> {
    let pairs = ((reach - step / 2.0) / step).ceil().max(0.0);
    let width = if pairs > 0.0 { (reach / (pairs + 0.5)).min(step) } else { 0.0 };
    let mut offsets = vec![0.0];
    for i in 1..=pairs as usize {
        offsets.extend([i as f64 * width, -(i as f64) * width]);
    }
    offsets
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn leaves_nothing_within_reach_farther_than_half_a_step(reach in 0.0..1.0f64, step in 0.01..0.5f64, at in -1.0..1.0f64) {
            let offsets = around(reach, step);
            let nearest = offsets.iter().map(|o| (o - at * reach).abs()).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= step / 2.0 + 1e-12);
        }
    }
}
