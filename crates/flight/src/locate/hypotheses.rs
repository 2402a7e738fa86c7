//! The headings and scales to try, from the stated heading and scale and their uncertainty.

use super::camera_pose::CameraPose;
use super::request::{FixRequest, HeadingPrior};
use overfly_core::tile::WorldPixel;
use std::f64::consts::{PI, TAU};

/// Headings and scales within this many standard deviations are searched.
pub const REACH_SIGMAS: f64 = 3.0;
/// A step of heading or scale moves the frame's edge by at most this many coarse pixels.
const STEP_PX: f64 = 2.4;
/// Headings within this many standard deviations of a stated heading are tried first.
const LIKELY_SIGMAS: f64 = 1.5;

/// A heading and a scale to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Heading, radians clockwise from true north.
    pub heading_rad: f64,
    /// True height over the stated height.
    pub height_ratio: f64,
}

impl Hypothesis {
    /// North and the stated scale.
    pub(super) const STATED: Self = Self { heading_rad: 0.0, height_ratio: 1.0 };

    /// The pose under this hypothesis whose nadir is a pixel of a level.
    pub(super) fn pose(self, nadir: WorldPixel, zoom: u8) -> CameraPose {
        let Self { heading_rad, height_ratio } = self;
        CameraPose { nadir, zoom, heading_rad, height_ratio, tilt_rad: [0.0; 2] }
    }
}

/// The step of heading in radians for a frame whose half diagonal has `half_diagonal_px` coarse pixels.
pub fn step(half_diagonal_px: f64) -> f64 {
    STEP_PX / half_diagonal_px.max(STEP_PX)
}

/// All combinations of heading and scale for a frame whose half diagonal has `half_diagonal_px` coarse pixels, in two parts: first
/// the likely ones (stated scale, headings near the stated heading or, where it is unknown, all), then the rest.
pub fn hypotheses(request: &FixRequest, half_diagonal_px: f64) -> [Vec<Hypothesis>; 2] {
    let step = step(half_diagonal_px);
    let ratios = around(REACH_SIGMAS * request.scale_sigma_ratio, 1.5 * step);
    let (headings, likely) = match request.heading {
        Some(HeadingPrior { heading_rad, sigma_rad }) if REACH_SIGMAS * sigma_rad < PI => {
            let offsets = around(REACH_SIGMAS * sigma_rad, step);
            let likely = offsets.iter().filter(|d| d.abs() <= LIKELY_SIGMAS * sigma_rad).count();
            (offsets.into_iter().map(|d| heading_rad + d).collect(), likely)
        }
        _ => {
            let count = (TAU / step).ceil();
            let headings: Vec<f64> = (0..count as usize).map(|i| i as f64 * TAU / count).collect();
            (headings, usize::MAX)
        }
    };
    let mut parts = [Vec::new(), Vec::new()];
    for (i, r) in ratios.iter().enumerate() {
        for (j, &heading_rad) in headings.iter().enumerate() {
            let part = usize::from(i > 0 || j >= likely);
            parts[part].push(Hypothesis { heading_rad, height_ratio: r.exp() });
        }
    }
    parts
}

/// Zero, then pairs outwards, at most `step` apart: nothing within `reach` is farther than half a step from one of them.
pub fn around(reach: f64, step: f64) -> Vec<f64> {
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
