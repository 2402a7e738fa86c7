//! `SimulatedSearch`: the extent and the duration of an absolute registration on a simulated flight, and the reason
//! of its failure.

use super::case::ScenarioCase;
use super::drift::SimulatedDrift;
use super::flight_tally::FailureCause;
use super::map::SimulatedMap;
use super::route::TruePose;
use super::scenario::FailureLaw;
use overfly_core::coupling::Mode;
use overfly_core::coupling::{Combined, region_edges_m};
use overfly_core::geodesy::{BodyFrame, BodyOffset, GeodesyError, LocalFrame};
use overfly_core::region::{ImageOnGround, Uncertainty};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The extent of a search.
pub struct SimulatedSearch {
    /// The map that the search reads, in images.
    pub nominal_count: f64,
    /// t_exe, seconds.
    pub execution_s: f64,
}

/// The part of a flight's state on which a search depends.
pub struct SearchState<'a> {
    /// The scenario and mode that is flown.
    pub case: &'a ScenarioCase<'a>,
    /// The generator of errors and failures.
    pub rng: ChaCha8Rng,
    /// The virtual clock, seconds.
    pub now_s: f64,
    /// When the image of the last fix was taken, seconds.
    pub fixed_s: f64,
    /// The error of the position now.
    pub drift: SimulatedDrift,
    /// The position of the last fix, if it matters.
    pub fixed_at: Option<TruePose>,
}

impl SearchState<'_> {
    /// The extent and the duration of a search at a pose.
    pub fn search(&self, pose: Option<&TruePose>) -> Result<SimulatedSearch, GeodesyError> {
        let (scenario, execution) = (self.case.scenario, &self.case.scenario.execution);
        let (aircraft, errors) = (&scenario.aircraft, &scenario.errors);
        let image_m2 = aircraft.across_m * aircraft.along_m;
        let nominal_count = match (self.case.map, pose) {
            (SimulatedMap::Stored(map), Some(pose)) => {
                let (centre, uncertainty) = self.region(pose)?;
                let image = ImageOnGround {
                    across_m: aircraft.across_m,
                    along_m: aircraft.along_m,
                    heading_rad: centre.heading.radians(),
                };
                let tiles = map.tiles_met(centre.position, image, uncertainty).max(1);
                tiles as f64 * map.tile_m * map.tile_m / image_m2
            }
            _ if self.case.mode == Mode::Combined => {
                let since_s = (self.now_s - self.fixed_s).min(1e9 / aircraft.speed_mps.max(1.0));
                let model = Combined::new(scenario.parameters());
                model.and_then(|m| m.nominal_count(since_s)).unwrap_or(f64::INFINITY)
            }
            _ => {
                let drift_m = self.drift.stated_m(errors);
                let (width_m, length_m) =
                    region_edges_m(aircraft.across_m, aircraft.along_m, errors.inaccuracy_m, drift_m);
                width_m * length_m / image_m2
            }
        };
        Ok(SimulatedSearch {
            nominal_count,
            execution_s: execution.constant_s + execution.seconds_per_tile * nominal_count,
        })
    }

    /// The assumed pose of the image, and its uncertainty.
    fn region(&self, pose: &TruePose) -> Result<(TruePose, Uncertainty), GeodesyError> {
        let (aircraft, errors) = (&self.case.scenario.aircraft, &self.case.scenario.errors);
        let inaccuracy_m = errors.inaccuracy_m;
        let [right_m, ahead_m] = self.drift.error_m();
        let off = |from: &TruePose| -> Result<TruePose, GeodesyError> {
            let drifted = BodyFrame::from(from.heading).enu_from_body(BodyOffset { right_m, ahead_m });
            let position = LocalFrame::at(from.position).geodetic_from_enu(drifted)?;
            Ok(TruePose { position, ..*from })
        };
        Ok(match (self.case.mode, &self.fixed_at) {
            (Mode::Combined, Some(fixed)) => {
                let uncertainty = Uncertainty::Combined {
                    inaccuracy_m,
                    speed_mps: aircraft.speed_mps,
                    execution_s: self.now_s - self.fixed_s,
                    min_turn_radius_m: aircraft.min_turn_radius_m,
                };
                (off(fixed)?, uncertainty)
            }
            _ => (off(pose)?, Uncertainty::Sequential { inaccuracy_m, drift_m: self.drift.stated_m(errors) }),
        })
    }

    /// The reason why a search fails, or `None`. The random number is drawn in any case, so that the draws of a
    /// flight stay in step.
    pub fn cause(&mut self, search: &SimulatedSearch, pose: Option<&TruePose>) -> Option<FailureCause> {
        let (aircraft, failures) = (&self.case.scenario.aircraft, &self.case.scenario.failures);
        let draw: f64 = self.rng.random();
        let is_drawn = match (failures.law, failures.probability) {
            // The ground that the next relative registration needs lies anywhere along the image. It is lost when the
            // aircraft has passed it.
            (FailureLaw::Overlap, _) => {
                self.case.mode == Mode::Sequential && draw * aircraft.along_m < aircraft.speed_mps * search.execution_s
            }
            (FailureLaw::Constant, p) => draw < p.unwrap_or(0.0),
            // The search succeeds if no image of map contains a false match.
            (FailureLaw::PerImage, each) => draw > (1.0 - each.unwrap_or(0.0)).powf(search.nominal_count),
        };
        let is_outside = self.case.mode != Mode::Combined && !self.drift.is_within_region(&self.case.scenario.errors);
        let least_covered = self.case.scenario.store.as_ref().map_or(0.0, |s| s.least_covered);
        let shows = match (self.case.map, pose) {
            (SimulatedMap::Stored(map), Some(pose)) => {
                map.shows(pose, aircraft.across_m, aircraft.along_m) >= least_covered
            }
            _ => true,
        };
        match (is_outside, shows, is_drawn) {
            (true, ..) => Some(FailureCause::OutsideRegion),
            (_, false, _) => Some(FailureCause::NoMap),
            (.., true) => Some(FailureCause::Drawn),
            _ => None,
        }
    }

    /// Whether searches take so long that they no longer settle.
    pub fn is_lost(&self, execution_s: f64) -> bool {
        let aircraft = &self.case.scenario.aircraft;
        match (self.case.mode, self.case.scenario.failures.law) {
            (Mode::Sequential, FailureLaw::Overlap) => aircraft.speed_mps * execution_s >= aircraft.along_m,
            (Mode::Sequential, _) => false,
            _ => {
                let limit_s = self.case.prediction.unstable_s;
                self.case.prediction.settles == Some(false) && limit_s.is_none()
                    || limit_s.is_some_and(|limit_s| self.now_s - self.fixed_s > limit_s)
            }
        }
    }
}
