//! `FlightScale`: one factor for all heights of a flight, and the error of dead reckoning with it.
//!
//! A wrong focal length and a wrong altimeter stretch every step by the same factor. This factor removes both errors.

use super::outcome::FlyOutcome;
use overfly_core::geodesy::{Enu, LocalFrame};
use serde::Serialize;

/// The source of the factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ScaleSource {
    /// The fixes of the flight.
    Fixes,
    /// The true track, by least squares: the best that one factor can do, for flights without fixes.
    Truth,
}

/// Ratio of the true height to the altimeter's, one for the flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FlightScale {
    /// The factor.
    pub ratio: f64,
    /// One standard deviation of the factor, as a ratio; absent if the factor comes from the truth.
    pub sigma_ratio: Option<f64>,
    /// The source of the factor.
    pub from: ScaleSource,
}

impl FlightScale {
    /// Takes the factor from the last position of a flight with fixes; otherwise estimates it from truth and dead
    /// reckoning, run by run. `None` without fixes and without a way.
    pub fn estimate(outcomes: &[FlyOutcome], reckoned: &[Vec<FlyOutcome>]) -> Option<Self> {
        let fixed = outcomes.last().map(|o| &o.position).filter(|p| p.fix_age_s.is_some());
        if let Some(last) = fixed {
            let sigma_ratio = Some(last.height_scale_sigma_ratio);
            return Some(Self { ratio: last.height_scale, sigma_ratio, from: ScaleSource::Fixes });
        }
        let (mut product, mut square) = (0.0, 0.0);
        for (truth, found) in reckoned.iter().flat_map(|run| run.iter().map(|o| ways(&run[0], o))) {
            product += truth.east_m * found.east_m + truth.north_m * found.north_m;
            square += found.east_m.powi(2) + found.north_m.powi(2);
        }
        (square > 0.0).then(|| Self { ratio: product / square, sigma_ratio: None, from: ScaleSource::Truth })
    }

    /// Error at the end of a run whose steps are all scaled, metres.
    pub fn end_error_m(&self, run: &[FlyOutcome]) -> f64 {
        let [Some(first), Some(last)] = [run.first(), run.last()] else { return 0.0 };
        let (truth, found) = ways(first, last);
        (self.ratio * found.east_m - truth.east_m).hypot(self.ratio * found.north_m - truth.north_m)
    }
}

/// The true displacement and the found one since a run began.
fn ways(first: &FlyOutcome, now: &FlyOutcome) -> (Enu, Enu) {
    let since = |from, to| LocalFrame::at(from).enu_from_geodetic(to);
    (since(first.truth, now.truth), since(first.position.position, now.position.position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::{EnuCovariance, Geodetic};
    use overfly_flight::navigate::{Position, PositionSource};

    /// A flight to the east in steps of 100 m, which dead reckoning takes for `reckoned_m` each.
    fn run(reckoned_m: f64, height_scale: f64, fix_age_s: Option<f64>) -> Vec<FlyOutcome> {
        let start = Geodetic::from_degrees(47.0, -99.0).unwrap();
        let at = |east_m| LocalFrame::at(start).geodetic_from_enu(Enu { east_m, north_m: 0.0 }).unwrap();
        let outcome = |i: u32| {
            let (position, truth) = (at(f64::from(i) * reckoned_m), at(f64::from(i) * 100.0));
            let known = Position {
                time_s: f64::from(i),
                source: PositionSource::Propagated,
                position,
                heading_rad: 0.0,
                heading_sigma_rad: 0.01,
                covariance: EnuCovariance::from_sigma_m(1.0),
                errors: Default::default(),
                height_scale,
                height_scale_sigma_ratio: 0.002,
                fix_age_s,
                tiles_searched: 0,
                nominal_count: 0.0,
                relative_count: 0,
                absolute_count: 0,
                fix: None,
            };
            let error = LocalFrame::at(truth).enu_from_geodetic(position);
            FlyOutcome { image: i.to_string(), position: known, truth, error, fix_error_m: None, is_hidden: false }
        };
        (0..6).map(outcome).collect()
    }

    #[test]
    fn truth_tells_the_factor_where_no_fix_does() {
        let reckoned = [run(98.0, 1.0, None), run(102.0, 1.0, None)];
        let scale = FlightScale::estimate(&reckoned[0], &reckoned).unwrap();
        // Least squares over both: 100 (98 + 102) / (98^2 + 102^2).
        assert!((scale.ratio - 20_000.0 / 20_008.0).abs() < 1e-6 && scale.from == ScaleSource::Truth, "{scale:?}");
        assert!((scale.end_error_m(&reckoned[0]) - 10.2).abs() < 0.1);
        assert_eq!(FlightScale::estimate(&[], &[]), None);
    }

    #[test]
    fn fixes_tell_it_before_truth() {
        let scale = FlightScale::estimate(&run(100.0, 1.03, Some(4.0)), &[run(98.0, 1.0, None)]).unwrap();
        assert_eq!((scale.ratio, scale.sigma_ratio, scale.from), (1.03, Some(0.002), ScaleSource::Fixes));
    }
}
