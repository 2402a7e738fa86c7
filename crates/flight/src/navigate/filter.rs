//! `NavigationFilter`: the extended Kalman filter (EKF) that couples visual odometry, compass, altimeter and fixes.
//!
//! State vector: position (east, north), heading, logarithm of the height, compass offset, altimeter offset.
//!
//! - Predict: [`NavigationFilter::predict_odometry`], [`NavigationFilter::predict_dead_reckoning`].
//! - Update: [`NavigationFilter::update_sensors`], [`NavigationFilter::update_fix`].
//!
//! Dead reckoning errs through heading and scale more than through single steps, and these errors are common to all steps.
//! So both offsets are states, and the covariance grows as the errors do.

use super::error::FilterError;
use super::flight_limits::Manoeuvre;
use super::measurements::{FixMeasurement, OdometryStep, SensorReading, SensorSigmas};
use nalgebra::{Matrix2, SMatrix, SVector, SymmetricEigen};
use overfly_core::geodesy::{
    BodyFrame, BodyOffset, Enu, EnuCovariance, GeodesyError, Geodetic, Heading, LocalFrame, wrap_turn_rad,
};

type State = SVector<f64, 6>;
type StateCovariance = SMatrix<f64, 6, 6>;

/// Indices into the state vector. East and north are offsets from `origin`, metres, and zero between steps; the offsets are
/// the sensor's reading minus the true value.
const EAST: usize = 0;
const NORTH: usize = 1;
const HEADING: usize = 2;
const LOG_HEIGHT: usize = 3;
const COMPASS: usize = 4;
const ALTIMETER: usize = 5;

/// No fix is trusted with heading and scale better than this: map and camera model err too.
const LEAST_TURN_SIGMA_RAD: f64 = 0.002;
const LEAST_SCALE_SIGMA: f64 = 0.002;

/// Where the first image has no reading: the height that the filter begins at, metres, and one standard deviation of heading and
/// of the logarithm of the height.
const USUAL_HEIGHT_M: f64 = 500.0;
const UNKNOWN_HEADING_SIGMA_RAD: f64 = 2.0;
const UNKNOWN_LOG_HEIGHT_SIGMA: f64 = 1.5;
/// The gate on a sensor's reading, in standard deviations of its innovation.
const SENSOR_GATE_SIGMAS: f64 = 5.0;

/// The bound on the normalised innovation squared (NIS) up to which a measurement is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Largest accepted NIS: a quantile of chi-square with as many degrees of freedom as are gated.
    pub max_nis: f64,
}

impl Gate {
    /// The quantile of chi-square with two degrees of freedom that a true innovation exceeds once in a million.
    pub const ONE_IN_A_MILLION: Self = Self { max_nis: 27.6 };
    /// Accepts every measurement.
    pub const OPEN: Self = Self { max_nis: f64::INFINITY };
}

/// The outcome of a measurement update: innovation, its covariance, and whether it passed the gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Measured minus predicted, in the measurement's own units.
    pub innovation: [f64; 2],
    /// Innovation covariance, H P H^T + R.
    pub covariance: [[f64; 2]; 2],
    /// Normalised innovation squared: chi-square of two degrees of freedom where state and measurement are consistent.
    pub nis: f64,
    /// Whether the NIS is within the gate. A rejected measurement leaves the filter unchanged.
    pub is_accepted: bool,
}

/// An extended Kalman filter over position, heading, height and the offsets of compass and altimeter.
///
/// # Example
/// ```
/// use nalgebra::Matrix2;
/// use overfly_core::geodesy::{Geodetic, LocalFrame};
/// use overfly_flight::navigate::{NavigationFilter, OdometryStep, SensorReading, SensorSigmas};
///
/// let sigmas = SensorSigmas {
///     heading_offset_rad: 0.05,
///     heading_noise_rad: 0.05,
///     height_offset_ratio: 0.03,
///     height_noise_ratio: 0.03,
/// };
/// let start = Geodetic::from_degrees(47.0, 8.0).unwrap();
/// let reading = SensorReading { heading_rad: 0.0, height_m: 500.0 };
/// let mut filter = NavigationFilter::new(start, 10.0, reading, &sigmas);
///
/// // Heading north at 500 m, 0.2 m ahead per metre of height: 100 m north.
/// let step = OdometryStep {
///     per_height: [0.0, 0.2],
///     covariance: Matrix2::identity() * 1e-6,
///     turn_rad: 0.0,
///     turn_sigma_rad: 1e-3,
///     log_climb: 0.0,
///     climb_sigma: 1e-3,
/// };
/// filter.predict_odometry(&step).unwrap();
/// let residual = filter.update_sensors(reading, &sigmas).unwrap();
/// assert!(residual.is_accepted && residual.nis < 1e-9);
/// let moved = LocalFrame::at(start).enu_from_geodetic(filter.position());
/// assert!((moved.north_m - 100.0).abs() < 1e-3 && moved.east_m.abs() < 1e-3);
/// ```
///
/// # References
/// Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation* (2001): EKF, section 10.3; NIS,
/// section 5.4; Joseph form, equation 5.2.3-18.
#[derive(Debug, Clone)]
pub struct NavigationFilter {
    origin: Geodetic,
    state: State,
    covariance: StateCovariance,
}

impl NavigationFilter {
    /// Returns the filter at the start of a flight: a position with its standard deviation per axis, and the first reading.
    /// Without a heading or a height it begins at north and at a usual height, and its covariance allows every other.
    pub fn new(position: Geodetic, sigma_m: f64, reading: SensorReading, sigmas: &SensorSigmas) -> Self {
        let mut state = State::zeros();
        state[LOG_HEIGHT] = USUAL_HEIGHT_M.ln();
        let mut covariance = StateCovariance::zeros();
        covariance[(HEADING, HEADING)] = UNKNOWN_HEADING_SIGMA_RAD.powi(2);
        covariance[(LOG_HEIGHT, LOG_HEIGHT)] = UNKNOWN_LOG_HEIGHT_SIGMA.powi(2);
        covariance[(EAST, EAST)] = sigma_m.powi(2);
        covariance[(NORTH, NORTH)] = sigma_m.powi(2);
        covariance[(COMPASS, COMPASS)] = sigmas.heading_offset_rad.powi(2);
        covariance[(ALTIMETER, ALTIMETER)] = sigmas.height_offset_ratio.powi(2);
        let mut filter = Self { origin: position, state, covariance };
        filter.reset_attitude(reading, sigmas);
        filter
    }

    /// The point straight below the camera.
    pub fn position(&self) -> Geodetic {
        self.origin
    }

    /// Covariance of the position.
    pub fn position_covariance(&self) -> EnuCovariance {
        let p = &self.covariance;
        EnuCovariance { ee_m2: p[(EAST, EAST)], en_m2: p[(EAST, NORTH)], nn_m2: p[(NORTH, NORTH)] }
    }

    /// Heading.
    pub fn heading(&self) -> Heading {
        Heading::from_radians(self.state[HEADING])
    }

    /// One standard deviation of the heading, radians.
    pub fn heading_sigma_rad(&self) -> f64 {
        self.covariance[(HEADING, HEADING)].max(0.0).sqrt()
    }

    /// Height above ground, metres.
    pub fn height_m(&self) -> f64 {
        self.state[LOG_HEIGHT].exp()
    }

    /// One standard deviation of the height, as a ratio of the height.
    pub fn height_sigma_ratio(&self) -> f64 {
        self.covariance[(LOG_HEIGHT, LOG_HEIGHT)].max(0.0).sqrt()
    }

    /// Compass offset: reading minus true heading, radians clockwise.
    pub fn compass_offset_rad(&self) -> f64 {
        self.state[COMPASS]
    }

    /// True height over the altimeter's reading.
    pub fn height_scale(&self) -> f64 {
        (-self.state[ALTIMETER]).exp()
    }

    /// One standard deviation of [`NavigationFilter::height_scale`], as a ratio.
    pub fn height_scale_sigma_ratio(&self) -> f64 {
        self.covariance[(ALTIMETER, ALTIMETER)].max(0.0).sqrt()
    }

    /// Predicts the state at the next image from a visual odometry step.
    ///
    /// # Errors
    /// [`FilterError::Position`] where the step leaves the local frame, thousands of kilometres away.
    pub fn predict_odometry(&mut self, step: &OdometryStep) -> Result<(), FilterError> {
        let (sin, cos) = self.state[HEADING].sin_cos();
        let height = self.height_m();
        let [right_m, ahead_m] = step.per_height.map(|v| v * height);
        let Enu { east_m: east, north_m: north } =
            BodyFrame::from_heading_rad(self.state[HEADING]).enu_from_body(BodyOffset { right_m, ahead_m });
        let mut jacobian = StateCovariance::identity();
        // Turning clockwise takes east to south: d(east) = north d(heading), d(north) = -east d(heading).
        jacobian[(EAST, HEADING)] = north;
        jacobian[(NORTH, HEADING)] = -east;
        jacobian[(EAST, LOG_HEIGHT)] = east;
        jacobian[(NORTH, LOG_HEIGHT)] = north;
        let turn = Matrix2::new(cos, sin, -sin, cos) * height;
        let added = turn * step.covariance * turn.transpose();
        let mut noise = StateCovariance::zeros();
        noise.fixed_view_mut::<2, 2>(0, 0).copy_from(&added);
        noise[(HEADING, HEADING)] = step.turn_sigma_rad.powi(2);
        noise[(LOG_HEIGHT, LOG_HEIGHT)] = step.climb_sigma.powi(2);
        self.covariance = jacobian * self.covariance * jacobian.transpose() + noise;
        self.state[HEADING] += step.turn_rad;
        self.state[LOG_HEIGHT] += step.log_climb;
        Ok(self.move_origin(east, north)?)
    }

    /// The reading without what contradicts the filter: a heading or a height outside the gate of five standard deviations, even if
    /// the aircraft has turned and climbed as far as it can since.
    pub fn gated(&self, reading: SensorReading, sigmas: &SensorSigmas, most: Manoeuvre) -> SensorReading {
        let reading = reading.plausible();
        let deviations = self.sensor_deviations(sigmas);
        let [turn, climb] = self.sensor_innovation(reading);
        // Not a number fails both.
        let keep = |value: f64, off: f64, sigma: f64, slack: f64| {
            if off.abs() <= SENSOR_GATE_SIGMAS * sigma + slack { value } else { f64::NAN }
        };
        SensorReading {
            heading_rad: keep(reading.heading_rad, turn, deviations[0], most.turn_rad),
            height_m: keep(reading.height_m, climb, deviations[1], most.log_climb),
        }
    }

    /// Reading minus prediction: heading, radians, and logarithm of the height.
    fn sensor_innovation(&self, reading: SensorReading) -> [f64; 2] {
        [
            wrap_turn_rad(reading.heading_rad - self.state[HEADING] - self.state[COMPASS]),
            reading.height_m.ln() - self.state[LOG_HEIGHT] - self.state[ALTIMETER],
        ]
    }

    /// One standard deviation of the innovations of compass and altimeter.
    fn sensor_deviations(&self, sigmas: &SensorSigmas) -> [f64; 2] {
        let noise = [sigmas.heading_noise_rad, sigmas.height_noise_ratio];
        let p = &self.covariance;
        let pairs = [(HEADING, COMPASS), (LOG_HEIGHT, ALTIMETER)];
        [0, 1].map(|i| {
            let (own, offset) = pairs[i];
            (p[(own, own)] + 2.0 * p[(own, offset)] + p[(offset, offset)] + noise[i].powi(2)).max(0.0).sqrt()
        })
    }

    /// Predicts the state at the next image from a displacement by the last known velocity, for want of odometry. Heading and
    /// height are reset to the sensors' readings minus their estimated offsets. Where there is no reading they stay, and
    /// `unseen` is one standard deviation of the turn and climb since the last image.
    ///
    /// # Errors
    /// As [`NavigationFilter::predict_odometry`].
    pub fn predict_dead_reckoning(
        &mut self,
        displacement: Enu,
        sigma_m: f64,
        reading: SensorReading,
        unseen: Manoeuvre,
        sigmas: &SensorSigmas,
    ) -> Result<(), FilterError> {
        self.covariance[(EAST, EAST)] += sigma_m.powi(2);
        self.covariance[(NORTH, NORTH)] += sigma_m.powi(2);
        if !reading.heading_rad.is_finite() {
            self.covariance[(HEADING, HEADING)] += unseen.turn_rad.powi(2);
        }
        if !reading.height_m.is_finite() {
            self.covariance[(LOG_HEIGHT, LOG_HEIGHT)] += unseen.log_climb.powi(2);
        }
        self.reset_attitude(reading, sigmas);
        Ok(self.move_origin(displacement.east_m, displacement.north_m)?)
    }

    /// Adds a place to what the covariance of the position holds: by one standard deviation in its direction.
    pub fn widen_position(&mut self, off: Enu) {
        let by = [off.east_m, off.north_m];
        for (i, j) in [(EAST, EAST), (EAST, NORTH), (NORTH, EAST), (NORTH, NORTH)] {
            self.covariance[(i, j)] += by[i] * by[j];
        }
    }

    /// Sets heading and height to the readings minus the estimated offsets, where there are readings.
    fn reset_attitude(&mut self, reading: SensorReading, sigmas: &SensorSigmas) {
        let mut jacobian = StateCovariance::identity();
        let mut noise = StateCovariance::zeros();
        let readings = [
            (HEADING, COMPASS, reading.heading_rad, sigmas.heading_noise_rad),
            (LOG_HEIGHT, ALTIMETER, reading.height_m.ln(), sigmas.height_noise_ratio),
        ];
        for (own, offset, read, sigma) in readings.into_iter().filter(|(_, _, read, _)| read.is_finite()) {
            self.state[own] = read - self.state[offset];
            jacobian[(own, own)] = 0.0;
            jacobian[(own, offset)] = -1.0;
            noise[(own, own)] = sigma.powi(2);
        }
        self.covariance = jacobian * self.covariance * jacobian.transpose() + noise;
    }

    /// Updates the state with a reading of compass and altimeter. A reading outside the gate of five standard deviations, and a
    /// missing one, change nothing. The position is corrected too, as far as it was reckoned by a heading and a height that
    /// turn out to be wrong. The residual's components are heading (radians) and logarithm of the height, 0 where unused.
    ///
    /// # Errors
    /// [`FilterError::SingularInnovation`] where state and sensors are stated to be exact; else as
    /// [`NavigationFilter::predict_odometry`].
    pub fn update_sensors(&mut self, reading: SensorReading, sigmas: &SensorSigmas) -> Result<Residual, FilterError> {
        const SINGULAR: FilterError = FilterError::SingularInnovation { measurement: "sensor reading" };
        let off = self.sensor_innovation(self.gated(reading, sigmas, Manoeuvre::default()));
        let mut h = SMatrix::<f64, 2, 6>::zeros();
        let mut innovation = SVector::<f64, 2>::zeros();
        // A row of zeros and no innovation: the reading changes nothing.
        for (i, own, offset) in [(0, HEADING, COMPASS), (1, LOG_HEIGHT, ALTIMETER)] {
            if off[i].is_finite() {
                (h[(i, own)], h[(i, offset)], innovation[i]) = (1.0, 1.0, off[i]);
            }
        }
        let noise = Matrix2::new(sigmas.heading_noise_rad.powi(2), 0.0, 0.0, sigmas.height_noise_ratio.powi(2));
        let covariance = h * self.covariance * h.transpose() + noise;
        let residual = residual(innovation, covariance, Gate::OPEN).ok_or(SINGULAR)?;
        self.update(&h, &innovation, &noise).ok_or(SINGULAR)?;
        let (east, north) = (self.state[EAST], self.state[NORTH]);
        self.move_origin(east, north)?;
        Ok(Residual { is_accepted: off.iter().all(|v| v.is_finite()), ..residual })
    }

    /// The position innovation (east, north, metres) of a fix that was made of this very image, and whether it passes the gate.
    ///
    /// # Errors
    /// [`FilterError::SingularInnovation`].
    pub fn fix_residual(&self, fix: &FixMeasurement, gate: Gate) -> Result<Residual, FilterError> {
        let off = LocalFrame::at(self.origin).enu_from_geodetic(fix.position);
        let covariance = self.covariance.fixed_view::<2, 2>(0, 0) + fix.covariance.to_matrix();
        let innovation = SVector::<f64, 2>::new(off.east_m, off.north_m);
        residual(innovation, covariance, gate).ok_or(FilterError::SingularInnovation { measurement: "fix" })
    }

    /// Updates the state with a fix that was made of this very image, where its position passes the gate. Errors of the map
    /// are common to all fixes, so the position is never claimed to be better than the fix.
    ///
    /// # Errors
    /// [`FilterError::SingularInnovation`]; else as [`NavigationFilter::predict_odometry`].
    pub fn update_fix(&mut self, fix: &FixMeasurement, gate: Gate) -> Result<Residual, FilterError> {
        let residual = self.fix_residual(fix, gate)?;
        if !residual.is_accepted {
            return Ok(residual);
        }
        let turn = fix.heading.radians() - self.state[HEADING];
        let [east_m, north_m] = residual.innovation;
        let innovation =
            SVector::<f64, 4>::new(east_m, north_m, wrap_turn_rad(turn), fix.log_height - self.state[LOG_HEIGHT]);
        let h = SMatrix::<f64, 4, 6>::identity();
        let mut noise = SMatrix::<f64, 4, 4>::zeros();
        let fix_covariance = fix.covariance.to_matrix();
        noise.fixed_view_mut::<2, 2>(0, 0).copy_from(&fix_covariance);
        noise[(2, 2)] = fix.heading_sigma_rad.max(LEAST_TURN_SIGMA_RAD).powi(2);
        noise[(3, 3)] = fix.log_height_sigma.max(LEAST_SCALE_SIGMA).powi(2);
        self.update(&h, &innovation, &noise).ok_or(FilterError::SingularInnovation { measurement: "fix" })?;
        let lacking = positive_part(fix_covariance - self.covariance.fixed_view::<2, 2>(0, 0));
        let raised = self.covariance.fixed_view::<2, 2>(0, 0) + lacking;
        self.covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&raised);
        let (east, north) = (self.state[EAST], self.state[NORTH]);
        self.move_origin(east, north)?;
        Ok(residual)
    }

    /// The measurement update, its covariance in Joseph form; `None` where the innovation covariance is singular.
    fn update<const M: usize>(
        &mut self,
        h: &SMatrix<f64, M, 6>,
        innovation: &SVector<f64, M>,
        noise: &SMatrix<f64, M, M>,
    ) -> Option<()> {
        let innovation_covariance = h * self.covariance * h.transpose() + noise;
        let inverse = innovation_covariance.try_inverse()?;
        let gain = self.covariance * h.transpose() * inverse;
        self.state += gain * innovation;
        // The Joseph form stays symmetric and positive.
        let kept = StateCovariance::identity() - gain * h;
        self.covariance = kept * self.covariance * kept.transpose() + gain * noise * gain.transpose();
        Some(())
    }

    /// Makes the point at an offset the new origin.
    fn move_origin(&mut self, east_m: f64, north_m: f64) -> Result<(), GeodesyError> {
        self.origin = LocalFrame::at(self.origin).geodetic_from_enu(Enu { east_m, north_m })?;
        self.state[EAST] = 0.0;
        self.state[NORTH] = 0.0;
        Ok(())
    }
}

/// The residual of an innovation; `None` where its covariance is singular.
fn residual(innovation: SVector<f64, 2>, covariance: Matrix2<f64>, gate: Gate) -> Option<Residual> {
    let nis = (innovation.transpose() * covariance.try_inverse()? * innovation)[0];
    let rows = [0, 1].map(|i| [covariance[(i, 0)], covariance[(i, 1)]]);
    Some(Residual { innovation: innovation.into(), covariance: rows, nis, is_accepted: nis <= gate.max_nis })
}

/// The part of a symmetric matrix that belongs to positive eigenvalues.
fn positive_part(m: Matrix2<f64>) -> Matrix2<f64> {
    let eigen = SymmetricEigen::new((m + m.transpose()) / 2.0);
    let kept = Matrix2::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
    eigen.eigenvectors * kept * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests;
