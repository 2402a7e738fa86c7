//! What of a corridor no layer shows: its share, and where along the route.

use super::coverage::{CorridorCoverage, CoverageStep};
use serde::Serialize;

/// A cross-section counts as left out where every layer shows less than this share of it.
const LEAST_COVERED: f64 = 0.5;

/// A stretch of a route along which the map shows less than half of the corridor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoverageGap {
    /// Which route: 0 is the planned one, the others are its alternates.
    pub route: usize,
    /// Where it begins, metres from that route's start.
    pub from_m: f64,
    /// Where it ends.
    pub to_m: f64,
}

/// Returns the share of a corridor's area that has imagery, in [0, 1]: of each cross-section what the layer shows that shows most.
pub fn covered_share(coverage: &[CorridorCoverage]) -> f64 {
    let (mut covered_m2, mut area_m2) = (0.0, 0.0);
    for (step, covered) in best(coverage) {
        let step_m2 = step.half_width_m * step.step_m;
        covered_m2 += covered * step_m2;
        area_m2 += step_m2;
    }
    if area_m2 > 0.0 { covered_m2 / area_m2 } else { 0.0 }
}

/// Returns the stretches along which the map shows less than half of the corridor, each from its first cross-section to its last.
pub fn coverage_gaps(coverage: &[CorridorCoverage]) -> Vec<CoverageGap> {
    let mut gaps: Vec<CoverageGap> = Vec::new();
    let mut open = false;
    for (step, covered) in best(coverage) {
        let is_gap = covered < LEAST_COVERED;
        match gaps.last_mut().filter(|gap| open && gap.route == step.route) {
            Some(gap) if is_gap => gap.to_m = step.way_m,
            _ if is_gap => gaps.push(CoverageGap { route: step.route, from_m: step.way_m, to_m: step.way_m }),
            _ => {}
        }
        open = is_gap;
    }
    gaps
}

/// Each cross-section with the share of it that the best layer shows.
fn best(coverage: &[CorridorCoverage]) -> impl Iterator<Item = (&CoverageStep, f64)> {
    let steps = coverage.first().map_or(&[][..], |c| &c.steps);
    steps.iter().enumerate().map(|(index, step)| {
        let shown = coverage.iter().filter_map(|c| c.steps.get(index)).map(|s| s.covered);
        (step, shown.fold(0.0, f64::max))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(covered: &[(usize, f64, f64)]) -> CorridorCoverage {
        let step = |(index, &(route, half_width_m, covered)): (usize, &(usize, f64, f64))| CoverageStep {
            layer: "a".into(),
            route,
            way_m: 500.0 * index as f64,
            latitude_deg: 0.0,
            longitude_deg: 0.0,
            half_width_m,
            step_m: 500.0,
            covered,
        };
        let steps: Vec<_> = covered.iter().enumerate().map(step).collect();
        CorridorCoverage { layer: "a".into(), mean: 0.0, least: 0.0, poor_share: 0.0, steps }
    }

    #[test]
    fn the_share_is_of_the_area_and_of_the_layer_that_shows_most() {
        let wide = layer(&[(0, 100.0, 1.0), (0, 300.0, 0.0)]);
        assert_eq!(covered_share(std::slice::from_ref(&wide)), 0.25);
        let other = layer(&[(0, 100.0, 0.0), (0, 300.0, 0.5)]);
        assert_eq!(covered_share(&[wide, other]), 0.625);
        assert_eq!(covered_share(&[]), 0.0);
    }

    #[test]
    fn gaps_end_with_the_route() {
        let steps = [(0, 1.0, 1.0), (0, 1.0, 0.4), (0, 1.0, 0.0), (0, 1.0, 0.9), (0, 1.0, 0.1), (1, 1.0, 0.2)];
        let gap = |route, from_m, to_m| CoverageGap { route, from_m, to_m };
        assert_eq!(
            coverage_gaps(&[layer(&steps)]),
            [gap(0, 500.0, 1000.0), gap(0, 2000.0, 2000.0), gap(1, 2500.0, 2500.0)]
        );
    }
}
