//! `SimulatedFlight`: one simulated flight on a virtual clock: relative registrations, searches, fixes and failures.
//!
//! The flight knows the world and not the models: a search reads the map under its region, the aircraft flies on
//! while it waits, and a registration fails because of its circumstances. The predictions of `coupling` are computed
//! elsewhere.

use super::case::{Draws, ScenarioCase};
use super::drift::SimulatedDrift;
use super::flight_tally::{FailureCause, FlightTally};
use super::map::SimulatedMap;
use super::route::{SimulatedRoute, TruePose};
use super::scenario::{AfterFailure, whole_intervals};
use super::search::SearchState;
use super::track::FilterTrack;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::{Geodetic, LocalFrame};
use overfly_flight::navigate::FilterError;
use rand::Rng;

/// Start of a flight over an endless map.
const NOWHERE_DEG: (f64, f64) = (47.0, 10.0);
/// Half extent of the area of such a flight, metres.
const NOWHERE_HALF_M: f64 = 40_000.0;

/// A flight under way.
pub struct SimulatedFlight<'a> {
    state: SearchState<'a>,
    failed_last: bool,
    tally: FlightTally,
    /// The true route, if it matters.
    route: Option<SimulatedRoute>,
    track: Option<FilterTrack<'a>>,
}

impl<'a> SimulatedFlight<'a> {
    /// Flies one mission.
    ///
    /// # Errors
    /// If a position leaves the local frame, which no route does, or the filter fails.
    pub fn fly(case: &'a ScenarioCase<'a>, run: u32) -> Result<FlightTally, FilterError> {
        let mut flight = Self::start(case, run)?;
        match case.mode {
            Mode::Sequential => flight.sequential()?,
            Mode::Parallel | Mode::Combined => flight.search_after_search()?,
            Mode::RelativeOnly | Mode::Auto => flight.relative(f64::INFINITY)?,
        }
        flight.tally.track = flight.track.map(|track| Box::new(track.into_tally()));
        Ok(flight.tally)
    }

    fn start(case: &'a ScenarioCase<'a>, run: u32) -> Result<Self, FilterError> {
        let mut rng = case.rng(run, Draws::Flight);
        let scenario = case.scenario;
        let tracked = scenario.covariance.as_ref().filter(|c| run < c.runs && case.mode != Mode::Combined);
        let (frame, half_extent_m) = match case.map {
            SimulatedMap::Stored(map) => (map.frame, map.half_extent_m),
            SimulatedMap::Endless => {
                let (latitude_deg, longitude_deg) = NOWHERE_DEG;
                (LocalFrame::at(Geodetic::from_degrees(latitude_deg, longitude_deg)?), [NOWHERE_HALF_M; 2])
            }
        };
        let is_placed = tracked.is_some() || matches!(case.map, SimulatedMap::Stored(_));
        let beyond_m = scenario.store.as_ref().map_or(0.0, |s| s.beyond_m);
        let route = is_placed.then(|| {
            let half_extent_m = half_extent_m.map(|half| (half + beyond_m).max(1.0));
            SimulatedRoute::new(frame, half_extent_m, scenario.aircraft.min_turn_radius_m, case.rng(run, Draws::Route))
        });
        let pose = route.as_ref().map(SimulatedRoute::pose).transpose()?;
        let track = match (tracked, pose) {
            (Some(model), Some(pose)) => {
                Some(FilterTrack::start(model, scenario, pose, case.plan.mission_s, case.rng(run, Draws::Track))?)
            }
            _ => None,
        };
        // In the middle of a flight the last fix is a random part of a cycle old.
        let period_s = case.adjusted.map_or(0.0, |a| case.plan.mission_s / a.absolute_count.max(1e-300));
        let phase_s = rng.random::<f64>() * period_s;
        let now_s = if scenario.without_fix_s.is_some() { 0.0 } else { -phase_s.min(case.plan.mission_s) };
        let drift = SimulatedDrift::after_fix(&scenario.errors, &mut rng);
        Ok(Self {
            state: SearchState { case, rng, now_s, fixed_s: now_s, drift, fixed_at: pose },
            failed_last: false,
            tally: FlightTally::default(),
            route,
            track,
        })
    }

    /// The sequential mode: n relative registrations, a search to wait for, and again.
    fn sequential(&mut self) -> Result<(), FilterError> {
        loop {
            let retries = self.failed_last && self.state.case.scenario.failures.after == AfterFailure::Retry;
            self.relative(if retries { 1.0 } else { self.state.case.plan.relative_count as f64 })?;
            if !self.absolute()? {
                return Ok(());
            }
        }
    }

    /// The other modes: one search after another. In the parallel mode relative registrations continue beside them.
    fn search_after_search(&mut self) -> Result<(), FilterError> {
        let scenario = self.state.case.scenario;
        // The time without a fix is the stated one, or that of settled searches.
        let settled_s = self.state.case.adjusted.map_or(0.0, |a| a.execution_s);
        let since_s = scenario.without_fix_s.unwrap_or(settled_s);
        self.state.fixed_s = self.state.now_s - since_s;
        if self.state.case.mode == Mode::Parallel {
            self.state.drift.grow(&scenario.errors, self.registrations(since_s), &mut self.state.rng);
        }
        while self.absolute()? {}
        Ok(())
    }

    /// Relative registrations in a time: whole ones if images come at intervals.
    fn registrations(&self, elapsed_s: f64) -> f64 {
        let count = elapsed_s / self.state.case.scenario.step_s();
        if self.state.case.scenario.aircraft.image_interval_s > 0.0 { (count + 1e-9).floor() } else { count }
    }

    /// Flies `count` relative registrations, or until the mission ends.
    fn relative(&mut self, count: f64) -> Result<(), FilterError> {
        let step_s = self.state.case.scenario.step_s();
        let end_s = self.state.now_s + count * step_s;
        if count.is_finite() {
            self.state.drift.grow(&self.state.case.scenario.errors, count, &mut self.state.rng);
        }
        self.images_until(end_s.min(self.state.case.plan.mission_s + step_s))?;
        self.state.now_s = end_s;
        Ok(())
    }

    /// Gives the filter all images up to a moment. Without a filter the aircraft flies there at once.
    fn images_until(&mut self, end_s: f64) -> Result<(), FilterError> {
        let (step_s, speed_mps) = (self.state.case.scenario.step_s(), self.state.case.scenario.aircraft.speed_mps);
        let Some(route) = &mut self.route else { return Ok(()) };
        let Some(track) = &mut self.track else {
            route.advance((end_s - self.state.now_s) * speed_mps);
            return Ok(());
        };
        let steps = ((end_s - self.state.now_s) / step_s - 1e-9).ceil().max(0.0) as u64;
        let mut at_s = self.state.now_s;
        for k in 1..=steps {
            let next_s = (self.state.now_s + k as f64 * step_s).min(end_s);
            route.advance((next_s - at_s) * speed_mps);
            at_s = next_s;
            track.step(route.pose()?, at_s)?;
        }
        Ok(())
    }

    /// Searches at this image and takes in the result. Returns whether the mission goes on.
    fn absolute(&mut self) -> Result<bool, FilterError> {
        let scenario = self.state.case.scenario;
        let began_s = self.state.now_s;
        let pose = self.route.as_ref().map(SimulatedRoute::pose).transpose()?;
        let search = self.state.search(pose.as_ref())?;
        self.tally.is_lost |= self.state.is_lost(search.execution_s);
        let end_s = began_s + search.execution_s;
        // NaN stands for times beyond all numbers.
        let is_over = end_s.is_nan() || end_s > self.state.case.plan.mission_s;
        let cause = self.state.cause(&search, pose.as_ref());
        if let Some(track) = &mut self.track {
            track.begin();
        }
        let next_s = began_s + whole_intervals(search.execution_s.min(1e12), scenario.aircraft.image_interval_s);
        self.fly_on(next_s)?;
        if is_over {
            return Ok(false);
        }
        // A search that ended before the mission began belongs to the flight before it.
        if end_s > 0.0 {
            self.tally.count(cause, search.execution_s, search.nominal_count, end_s, self.failed_last);
        }
        self.failed_last = cause.is_some();
        self.take(cause, pose, began_s)?;
        Ok(true)
    }

    /// Flies on while a search runs.
    fn fly_on(&mut self, next_s: f64) -> Result<(), FilterError> {
        let until_s = next_s.min(self.state.case.plan.mission_s + self.state.case.scenario.step_s());
        if self.state.case.mode == Mode::Parallel {
            self.images_until(until_s)?;
        } else if let Some(route) = &mut self.route {
            route.advance((until_s - self.state.now_s).max(0.0) * self.state.case.scenario.aircraft.speed_mps);
        }
        self.state.now_s = next_s;
        Ok(())
    }

    /// Takes in the result of a search of an earlier image.
    fn take(&mut self, cause: Option<FailureCause>, pose: Option<TruePose>, began_s: f64) -> Result<(), FilterError> {
        let (errors, failures) = (&self.state.case.scenario.errors, &self.state.case.scenario.failures);
        let is_false = cause.is_some() && self.state.rng.random::<f64>() < failures.false_share;
        self.tally.false_fixes += u64::from(is_false);
        if let (Some(track), Some(pose)) = (&mut self.track, &pose) {
            track.deliver(pose, cause.is_none())?;
        }
        let is_fixed = cause.is_none() || failures.after == AfterFailure::Afresh;
        if is_fixed {
            self.state.drift = SimulatedDrift::after_fix(errors, &mut self.state.rng);
        } else if is_false {
            let reach_m = errors.inaccuracy_m / 2.0 + self.state.drift.stated_m(errors);
            let wrong_m = [(); 2].map(|()| reach_m * (2.0 * self.state.rng.random::<f64>() - 1.0));
            self.state.drift = SimulatedDrift::after_false_fix(errors, wrong_m, &mut self.state.rng);
        }
        if is_fixed || is_false {
            self.state.fixed_s = began_s;
            self.state.fixed_at = pose;
        }
        if self.state.case.mode == Mode::Parallel {
            let count = self.registrations(self.state.now_s - began_s);
            self.state.drift.grow(errors, count, &mut self.state.rng);
        }
        Ok(())
    }
}
