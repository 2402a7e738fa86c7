//! `FilterTrack`: `navigate::NavigationFilter` on a simulated flight, and whether its covariance is true.
//!
//! The filter and its updates are the ones that navigate real flights; sensor readings, odometry and fixes are drawn.

use super::flight_tally::{CHECKPOINTS, TrackTally};
use super::route::TruePose;
use super::scenario::{CovarianceModel, DrawnDrift, ErrorModel, Scenario};
use nalgebra::Matrix2;
use overfly_core::geodesy::{BodyFrame, Enu, EnuCovariance, Heading, LocalFrame};
use overfly_flight::navigate::{
    FilterError, FixMeasurement, Gate, NavigationFilter, OdometryStep, SensorReading, SensorSigmas, TimeUpdate,
};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A filter and the truth beside it.
pub struct FilterTrack<'a> {
    model: &'a CovarianceModel,
    errors: &'a ErrorModel,
    sensors: SensorSigmas,
    rng: ChaCha8Rng,
    filter: NavigationFilter,
    pose: TruePose,
    /// Constant errors of compass and altimeter.
    offsets: [f64; 2],
    /// Common error of all fixes, metres.
    map_error_m: [f64; 2],
    /// Error of each relative registration since the last fix, per axis, if they repeat it, metres.
    each_m: [f64; 2],
    /// The filter at the image whose search runs, and the time updates since.
    pending: Option<(NavigationFilter, Vec<TimeUpdate>)>,
    mission_s: f64,
    sampled_s: f64,
    tally: TrackTally,
}

impl<'a> FilterTrack<'a> {
    /// Starts the filter at the first image.
    ///
    /// # Errors
    /// If a position leaves the local frame.
    pub fn start(
        model: &'a CovarianceModel,
        scenario: &'a Scenario,
        pose: TruePose,
        mission_s: f64,
        mut rng: ChaCha8Rng,
    ) -> Result<Self, FilterError> {
        let sensors = SensorSigmas {
            heading_offset_rad: model.heading_offset_deg.to_radians(),
            heading_noise_rad: model.heading_noise_deg.to_radians(),
            height_offset_ratio: model.height_offset_ratio,
            height_noise_ratio: model.height_noise_ratio,
        };
        let offsets = [sensors.heading_offset_rad * normal(&mut rng), sensors.height_offset_ratio * normal(&mut rng)];
        let map_error_m = [(); 2].map(|()| model.fix_sigma_m * model.fix_common_share.sqrt() * normal(&mut rng));
        let reading = reading(model, &sensors, &pose, offsets, &mut rng);
        let [east_m, north_m] = [(); 2].map(|()| model.start_sigma_m * normal(&mut rng));
        let at = LocalFrame::at(pose.position).geodetic_from_enu(Enu { east_m, north_m })?;
        let filter = NavigationFilter::new(at, model.start_sigma_m * model.stated_ratio, reading, &sensors);
        let sampled_s = mission_s * rng.random::<f64>();
        let errors = &scenario.errors;
        let each_m = repeated(errors, &mut rng);
        let tally = TrackTally::default();
        Ok(Self {
            model,
            errors,
            sensors,
            rng,
            filter,
            pose,
            offsets,
            map_error_m,
            each_m,
            pending: None,
            mission_s,
            sampled_s,
            tally,
        })
    }

    /// Takes in the next image, registered against the last.
    ///
    /// # Errors
    /// Like [`FilterTrack::start`].
    pub fn step(&mut self, pose: TruePose, time_s: f64) -> Result<(), FilterError> {
        let (step, height_m) = (self.registered(&pose), self.model.height_m);
        let sigma = self.step_sigma_m() * self.model.stated_ratio / height_m;
        let step = OdometryStep { covariance: Matrix2::identity() * sigma * sigma, ..step };
        self.pose = pose;
        let reading = reading(self.model, &self.sensors, &pose, self.offsets, &mut self.rng);
        let update = TimeUpdate::Odometry { step, reading };
        update.apply(&mut self.filter, &self.sensors)?;
        if let Some((_, since)) = &mut self.pending {
            since.push(update);
        }
        self.look(time_s);
        Ok(())
    }

    /// The relative registration of an image against the last one.
    fn registered(&mut self, pose: &TruePose) -> OdometryStep {
        let moved = LocalFrame::at(self.pose.position).enu_from_geodetic(pose.position);
        let moved = BodyFrame::from(self.pose.heading).body_from_enu(moved);
        let moved_m = [moved.right_m, moved.ahead_m];
        let error_m = match self.errors.drift {
            DrawnDrift::Bias => self.each_m,
            DrawnDrift::Independent => [(); 2].map(|()| self.step_sigma_m() * normal(&mut self.rng)),
        };
        let (turn_sigma_rad, climb_sigma) = (self.model.turn_noise_deg.to_radians(), self.model.climb_noise_ratio);
        OdometryStep {
            per_height: [0, 1].map(|k| (moved_m[k] + error_m[k]) / self.model.height_m),
            covariance: Matrix2::zeros(),
            // True north turns under the aircraft; images do not see that.
            turn_rad: pose.plane_heading_rad - self.pose.plane_heading_rad + turn_sigma_rad * normal(&mut self.rng),
            turn_sigma_rad: turn_sigma_rad * self.model.stated_ratio,
            log_climb: climb_sigma * normal(&mut self.rng),
            climb_sigma: climb_sigma * self.model.stated_ratio,
        }
    }

    /// One standard deviation per axis of one relative registration, metres.
    fn step_sigma_m(&self) -> f64 {
        match self.errors.drift {
            // Standard deviation of a uniform distribution of width 2 D_U.
            DrawnDrift::Bias => self.errors.unit_drift_m / 3f64.sqrt(),
            DrawnDrift::Independent => self.errors.unit_drift_m / self.errors.drift_sigmas,
        }
    }

    /// Begins a search of the last image.
    pub fn begin(&mut self) {
        self.pending = Some((self.filter.clone(), Vec::new()));
    }

    /// The search has ended: a fix updates the filter at its own image, and the time updates since are applied again.
    ///
    /// # Errors
    /// Like [`FilterTrack::start`].
    pub fn deliver(&mut self, image: &TruePose, is_fix: bool) -> Result<(), FilterError> {
        let Some((mut updated, since)) = self.pending.take().filter(|_| is_fix) else { return Ok(()) };
        let scale = self.model.fix_scale_ratio * normal(&mut self.rng);
        let fix = self.fix(image, self.model.height_m.ln() + scale)?;
        updated.update_fix(&fix, Gate::OPEN)?;
        since.iter().try_for_each(|update| update.apply(&mut updated, &self.sensors))?;
        self.filter = updated;
        self.each_m = repeated(self.errors, &mut self.rng);
        Ok(())
    }

    fn fix(&mut self, image: &TruePose, log_height: f64) -> Result<FixMeasurement, FilterError> {
        let own_m = self.model.fix_sigma_m * (1.0 - self.model.fix_common_share).sqrt();
        let [east_m, north_m] = self.map_error_m.map(|map_m| map_m + own_m * normal(&mut self.rng));
        let at = LocalFrame::at(image.position).geodetic_from_enu(Enu { east_m, north_m })?;
        let variance_m2 = (self.model.fix_sigma_m * self.model.stated_ratio).powi(2);
        let heading_deg = image.heading.degrees() + self.model.fix_heading_deg * normal(&mut self.rng);
        Ok(FixMeasurement {
            position: at,
            covariance: EnuCovariance { ee_m2: variance_m2, en_m2: 0.0, nn_m2: variance_m2 },
            heading: Heading::from_degrees(heading_deg),
            heading_sigma_rad: (self.model.fix_heading_deg * self.model.stated_ratio).to_radians(),
            log_height,
            log_height_sigma: self.model.fix_scale_ratio * self.model.stated_ratio,
            // All fixes of a simulation are right.
            false_probability: 0.0,
        })
    }

    /// Compares the filter with the truth.
    fn look(&mut self, time_s: f64) {
        let off = LocalFrame::at(self.pose.position).enu_from_geodetic(self.filter.position());
        let nees = self.filter.position_covariance().squared_mahalanobis(off);
        let is_covered = TrackTally::holds(nees);
        self.tally.images += 1;
        self.tally.covered += u64::from(is_covered);
        if time_s >= self.sampled_s && self.tally.nees.is_none() {
            self.tally.nees = Some(nees);
            self.tally.error_m = Some(off.length_m());
        }
        let passed = (time_s / self.mission_s * CHECKPOINTS as f64 + 1e-9).floor();
        if (1.0..=CHECKPOINTS as f64).contains(&passed) {
            self.tally.checkpoints[passed as usize - 1].get_or_insert(is_covered);
        }
    }

    /// The counts.
    pub fn into_tally(self) -> TrackTally {
        self.tally
    }
}

/// The readings of compass and altimeter.
fn reading(
    model: &CovarianceModel,
    sensors: &SensorSigmas,
    pose: &TruePose,
    offsets: [f64; 2],
    rng: &mut ChaCha8Rng,
) -> SensorReading {
    let [compass_rad, altimeter] = offsets;
    SensorReading {
        heading_rad: pose.heading.radians() + compass_rad + sensors.heading_noise_rad * normal(rng),
        height_m: model.height_m * (altimeter + sensors.height_noise_ratio * normal(rng)).exp(),
    }
}

/// Draws the error that every relative registration repeats until the next fix.
fn repeated(errors: &ErrorModel, rng: &mut ChaCha8Rng) -> [f64; 2] {
    [(); 2].map(|()| errors.unit_drift_m * (2.0 * rng.random::<f64>() - 1.0))
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
