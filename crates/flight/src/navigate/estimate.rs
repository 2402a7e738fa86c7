//! `Estimate`: what is known of the aircraft at one image: position, heading, height, and what compass and altimeter are
//! wrong by, with one covariance over all six.
//!
//! Dead reckoning errs by its heading and its scale more than by its steps: those errors belong to all steps alike. So they are
//! states of their own, and the covariance grows as the errors do.

use crate::locate::Fix;
use nalgebra::{Matrix2, SMatrix, SVector, SymmetricEigen};
use overfly_core::geodesy::{Enu, GeodesyError, Geodetic, LocalFrame};
use std::f64::consts::{PI, TAU};

type State = SVector<f64, 6>;
type Covariance = SMatrix<f64, 6, 6>;

/// Places in the state: offset from `origin` (zero between steps), heading, logarithm of the height, offsets of compass and
/// altimeter (what they say less what is).
const EAST: usize = 0;
const NORTH: usize = 1;
const HEADING: usize = 2;
const LOG_HEIGHT: usize = 3;
const COMPASS: usize = 4;
const ALTIMETER: usize = 5;

/// What sensors say at one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// By the compass, radians clockwise from true north.
    pub heading_rad: f64,
    /// By the altimeter, metres above ground.
    pub height_m: f64,
}

/// How far sensors are trusted, one standard deviation each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorSigmas {
    /// What the compass is wrong by throughout, radians.
    pub heading_offset_rad: f64,
    /// What it is wrong by anew at each image, radians.
    pub heading_noise_rad: f64,
    /// What the altimeter (and the focal length) are wrong by throughout, as a ratio.
    pub height_offset_ratio: f64,
    /// What it is wrong by anew at each image, as a ratio.
    pub height_noise_ratio: f64,
}

/// A displacement over ground between two images, in the first one's own axes and for a height of one metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Right and ahead of the first image, per metre of height.
    pub per_height: [f64; 2],
    /// Its covariance.
    pub covariance: Matrix2<f64>,
    /// Clockwise turn from the first image to the second, radians.
    pub turn_rad: f64,
    /// One standard deviation of it.
    pub turn_sigma_rad: f64,
    /// Logarithm of the second height over the first.
    pub log_climb: f64,
    /// One standard deviation of it.
    pub climb_sigma: f64,
}

/// Position, heading and height at one image.
#[derive(Debug, Clone)]
pub struct Estimate {
    origin: Geodetic,
    state: State,
    covariance: Covariance,
}

impl Estimate {
    /// At the start: a position with its error per axis, and what the sensors say.
    pub fn start(position: Geodetic, sigma_m: f64, sensed: Sensed, sigmas: &SensorSigmas) -> Self {
        let mut state = State::zeros();
        state[HEADING] = sensed.heading_rad;
        state[LOG_HEIGHT] = sensed.height_m.ln();
        let mut covariance = Covariance::zeros();
        covariance[(EAST, EAST)] = sigma_m.powi(2);
        covariance[(NORTH, NORTH)] = sigma_m.powi(2);
        covariance[(COMPASS, COMPASS)] = sigmas.heading_offset_rad.powi(2);
        covariance[(ALTIMETER, ALTIMETER)] = sigmas.height_offset_ratio.powi(2);
        let mut estimate = Self { origin: position, state, covariance };
        estimate.forget_heading(sensed, sigmas);
        estimate
    }

    /// The point straight below the camera.
    pub fn position(&self) -> Geodetic {
        self.origin
    }

    /// Covariance of the position, m^2: [[ee, en], [en, nn]].
    pub fn position_covariance_m2(&self) -> [[f64; 2]; 2] {
        let p = &self.covariance;
        [[p[(EAST, EAST)], p[(EAST, NORTH)]], [p[(NORTH, EAST)], p[(NORTH, NORTH)]]]
    }

    /// Radians clockwise from true north in [0, 2 pi).
    pub fn heading_rad(&self) -> f64 {
        self.state[HEADING].rem_euclid(TAU)
    }

    /// One standard deviation of the heading, radians.
    pub fn heading_sigma_rad(&self) -> f64 {
        self.covariance[(HEADING, HEADING)].max(0.0).sqrt()
    }

    /// Metres above ground.
    pub fn height_m(&self) -> f64 {
        self.state[LOG_HEIGHT].exp()
    }

    /// One standard deviation of the height, as a ratio of it.
    pub fn height_sigma_ratio(&self) -> f64 {
        self.covariance[(LOG_HEIGHT, LOG_HEIGHT)].max(0.0).sqrt()
    }

    /// What the compass says too much, radians clockwise.
    pub fn compass_offset_rad(&self) -> f64 {
        self.state[COMPASS]
    }

    /// True height over what the altimeter says.
    pub fn height_scale(&self) -> f64 {
        (-self.state[ALTIMETER]).exp()
    }

    /// One standard deviation of [`Estimate::height_scale`], as a ratio.
    pub fn height_scale_sigma_ratio(&self) -> f64 {
        self.covariance[(ALTIMETER, ALTIMETER)].max(0.0).sqrt()
    }

    /// Moves on by a registered step.
    ///
    /// # Errors
    /// Where the position leaves the ellipsoid's local frame, which no flight does.
    pub fn advance(&mut self, step: &Step) -> Result<(), GeodesyError> {
        let (sin, cos) = self.state[HEADING].sin_cos();
        let height = self.height_m();
        let [right, ahead] = step.per_height.map(|v| v * height);
        let (east, north) = (right * cos + ahead * sin, ahead * cos - right * sin);
        let mut jacobian = Covariance::identity();
        // Turning clockwise takes east to south: d(east) = north d(heading), d(north) = -east d(heading).
        jacobian[(EAST, HEADING)] = north;
        jacobian[(NORTH, HEADING)] = -east;
        jacobian[(EAST, LOG_HEIGHT)] = east;
        jacobian[(NORTH, LOG_HEIGHT)] = north;
        let turn = Matrix2::new(cos, sin, -sin, cos) * height;
        let added = turn * step.covariance * turn.transpose();
        let mut noise = Covariance::zeros();
        noise.fixed_view_mut::<2, 2>(0, 0).copy_from(&added);
        noise[(HEADING, HEADING)] = step.turn_sigma_rad.powi(2);
        noise[(LOG_HEIGHT, LOG_HEIGHT)] = step.climb_sigma.powi(2);
        self.covariance = jacobian * self.covariance * jacobian.transpose() + noise;
        self.state[HEADING] += step.turn_rad;
        self.state[LOG_HEIGHT] += step.log_climb;
        self.shift(east, north)
    }

    /// Moves on by a velocity, where no registration says better; heading and height are the sensors' from then on.
    ///
    /// # Errors
    /// As [`Estimate::advance`].
    pub fn drift(
        &mut self,
        moved: Enu,
        sigma_m: f64,
        sensed: Sensed,
        sigmas: &SensorSigmas,
    ) -> Result<(), GeodesyError> {
        self.covariance[(EAST, EAST)] += sigma_m.powi(2);
        self.covariance[(NORTH, NORTH)] += sigma_m.powi(2);
        self.forget_heading(sensed, sigmas);
        self.shift(moved.east_m, moved.north_m)
    }

    /// Heading and height from the sensors alone, less their offsets as far as these are known.
    fn forget_heading(&mut self, sensed: Sensed, sigmas: &SensorSigmas) {
        self.state[HEADING] = sensed.heading_rad - self.state[COMPASS];
        self.state[LOG_HEIGHT] = sensed.height_m.ln() - self.state[ALTIMETER];
        let mut jacobian = Covariance::identity();
        for (own, offset) in [(HEADING, COMPASS), (LOG_HEIGHT, ALTIMETER)] {
            jacobian[(own, own)] = 0.0;
            jacobian[(own, offset)] = -1.0;
        }
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        self.covariance[(HEADING, HEADING)] += sigmas.heading_noise_rad.powi(2);
        self.covariance[(LOG_HEIGHT, LOG_HEIGHT)] += sigmas.height_noise_ratio.powi(2);
    }

    /// Weighs in what the sensors say: of a heading that was wrong the position on its way is wrong too, and is corrected with it.
    ///
    /// # Errors
    /// As [`Estimate::advance`].
    pub fn sense(&mut self, sensed: Sensed, sigmas: &SensorSigmas) -> Result<(), GeodesyError> {
        let mut h = SMatrix::<f64, 2, 6>::zeros();
        h[(0, HEADING)] = 1.0;
        h[(0, COMPASS)] = 1.0;
        h[(1, LOG_HEIGHT)] = 1.0;
        h[(1, ALTIMETER)] = 1.0;
        let turn = sensed.heading_rad - self.state[HEADING] - self.state[COMPASS];
        let innovation = SVector::<f64, 2>::new(
            (turn + PI).rem_euclid(TAU) - PI,
            sensed.height_m.ln() - self.state[LOG_HEIGHT] - self.state[ALTIMETER],
        );
        let noise = Matrix2::new(sigmas.heading_noise_rad.powi(2), 0.0, 0.0, sigmas.height_noise_ratio.powi(2));
        self.update(&h, &innovation, &noise);
        let (east, north) = (self.state[EAST], self.state[NORTH]);
        self.shift(east, north)
    }

    /// Squared Mahalanobis distance of a fix from what is expected here: chi-square of two degrees where both are true.
    pub fn innovation(&self, fix: &Fix) -> Option<f64> {
        let at = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).ok()?;
        let off = LocalFrame::at(self.origin).enu_from_geodetic(at);
        let [[ee, en], [ne, nn]] = self.position_covariance_m2();
        let [[fee, fen], [fne, fnn]] = fix.covariance_m2;
        let sum = Matrix2::new(ee + fee, en + fen, ne + fne, nn + fnn);
        let off = SVector::<f64, 2>::new(off.east_m, off.north_m);
        Some((off.transpose() * sum.try_inverse()? * off)[0])
    }

    /// Weighs in a fix made of this very image; `log_height` is what it says of the height. Maps err alike from fix to fix, so the
    /// position is never claimed to be better than the fix.
    ///
    /// # Errors
    /// Where the fix is no place.
    pub fn correct(&mut self, fix: &Fix, log_height: f64) -> Result<(), GeodesyError> {
        let at = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg)?;
        let off = LocalFrame::at(self.origin).enu_from_geodetic(at);
        let turn = fix.heading_deg.to_radians() - self.state[HEADING];
        let innovation = SVector::<f64, 4>::new(
            off.east_m,
            off.north_m,
            (turn + PI).rem_euclid(TAU) - PI,
            log_height - self.state[LOG_HEIGHT],
        );
        let h = SMatrix::<f64, 4, 6>::identity();
        let mut noise = SMatrix::<f64, 4, 4>::zeros();
        let [[ee, en], [ne, nn]] = fix.covariance_m2;
        let of_fix = Matrix2::new(ee, en, ne, nn);
        noise.fixed_view_mut::<2, 2>(0, 0).copy_from(&of_fix);
        noise[(2, 2)] = fix.heading_sigma_deg.to_radians().max(LEAST_TURN_SIGMA_RAD).powi(2);
        noise[(3, 3)] = fix.scale_sigma_ratio.max(LEAST_SCALE_SIGMA).powi(2);
        self.update(&h, &innovation, &noise);
        let lacking = positive_part(of_fix - self.covariance.fixed_view::<2, 2>(0, 0));
        let raised = self.covariance.fixed_view::<2, 2>(0, 0) + lacking;
        self.covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&raised);
        let (east, north) = (self.state[EAST], self.state[NORTH]);
        self.shift(east, north)
    }

    fn update<const M: usize>(
        &mut self,
        h: &SMatrix<f64, M, 6>,
        innovation: &SVector<f64, M>,
        noise: &SMatrix<f64, M, M>,
    ) {
        let spread = h * self.covariance * h.transpose() + noise;
        let Some(inverse) = spread.try_inverse() else { return };
        let gain = self.covariance * h.transpose() * inverse;
        self.state += gain * innovation;
        // Joseph's form stays symmetric and positive.
        let kept = Covariance::identity() - gain * h;
        self.covariance = kept * self.covariance * kept.transpose() + gain * noise * gain.transpose();
    }

    /// Makes the place at an offset the new origin.
    fn shift(&mut self, east_m: f64, north_m: f64) -> Result<(), GeodesyError> {
        self.origin = LocalFrame::at(self.origin).geodetic_from_enu(Enu { east_m, north_m })?;
        self.state[EAST] = 0.0;
        self.state[NORTH] = 0.0;
        Ok(())
    }
}

/// No fix is trusted with heading and scale better than this: map and camera model err too.
const LEAST_TURN_SIGMA_RAD: f64 = 0.002;
const LEAST_SCALE_SIGMA: f64 = 0.002;

/// The part of a symmetric matrix that belongs to positive eigenvalues.
fn positive_part(m: Matrix2<f64>) -> Matrix2<f64> {
    let eigen = SymmetricEigen::new((m + m.transpose()) / 2.0);
    let kept = Matrix2::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
    eigen.eigenvectors * kept * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const SIGMAS: SensorSigmas = SensorSigmas {
        heading_offset_rad: 0.04,
        heading_noise_rad: 0.02,
        height_offset_ratio: 0.02,
        height_noise_ratio: 0.01,
    };

    fn place() -> Geodetic {
        Geodetic::from_degrees(47.0, -99.1).unwrap()
    }

    /// Two independent uniform numbers of unit variance, near enough to normal when summed over a flight.
    fn draw(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    fn step(turn_rad: f64) -> Step {
        Step {
            per_height: [0.01, 0.2],
            covariance: Matrix2::identity() * 1e-7,
            turn_rad,
            turn_sigma_rad: 1e-3,
            log_climb: 0.0,
            climb_sigma: 1e-3,
        }
    }

    /// The share of drawn flights whose position error lies in the 95 % ellipse after `steps` steps of dead reckoning.
    fn coverage(steps: usize) -> f64 {
        let mut inside = 0;
        let trials = 600;
        for seed in 0..trials {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (heading, height) = (1.0, 800.0);
            let compass = SIGMAS.heading_offset_rad * draw(&mut rng);
            let altimeter = SIGMAS.height_offset_ratio * draw(&mut rng);
            let mut truth = (Enu::default(), heading, f64::ln(height));
            let sensed = |truth: &(Enu, f64, f64), rng: &mut ChaCha8Rng| Sensed {
                heading_rad: truth.1 + compass + SIGMAS.heading_noise_rad * draw(rng),
                height_m: (truth.2 + altimeter + SIGMAS.height_noise_ratio * draw(rng)).exp(),
            };
            let first = Enu { east_m: 5.0 * draw(&mut rng), north_m: 5.0 * draw(&mut rng) };
            let start = LocalFrame::at(place()).geodetic_from_enu(first).unwrap();
            let mut estimate = Estimate::start(start, 5.0, sensed(&truth, &mut rng), &SIGMAS);
            for _ in 0..steps {
                let s = step(0.05);
                let (sin, cos) = truth.1.sin_cos();
                let height = truth.2.exp();
                let [right, ahead] = s.per_height.map(|v| v * height);
                truth.0.east_m += right * cos + ahead * sin;
                truth.0.north_m += ahead * cos - right * sin;
                truth.1 += s.turn_rad;
                let sigma = s.covariance[(0, 0)].sqrt();
                let measured = Step {
                    per_height: s.per_height.map(|v| v + sigma * draw(&mut rng)),
                    turn_rad: s.turn_rad + s.turn_sigma_rad * draw(&mut rng),
                    log_climb: s.climb_sigma * draw(&mut rng),
                    ..s
                };
                estimate.advance(&measured).unwrap();
                estimate.sense(sensed(&truth, &mut rng), &SIGMAS).unwrap();
            }
            let found = LocalFrame::at(place()).enu_from_geodetic(estimate.position());
            let off = SVector::<f64, 2>::new(found.east_m - truth.0.east_m, found.north_m - truth.0.north_m);
            let [[ee, en], [ne, nn]] = estimate.position_covariance_m2();
            let square = (off.transpose() * Matrix2::new(ee, en, ne, nn).try_inverse().unwrap() * off)[0];
            inside += usize::from(square < 5.991);
        }
        inside as f64 / trials as f64
    }

    #[test]
    fn dead_reckoning_errs_as_its_covariance_says() {
        for steps in [1, 10, 60] {
            let share = coverage(steps);
            // 600 trials: 0.95 +- 0.009, and the linearisation's error.
            assert!((0.915..0.985).contains(&share), "{steps} steps: {share}");
        }
    }

    fn fix(at: Geodetic, heading_deg: f64) -> Fix {
        Fix {
            latitude_deg: at.latitude_deg(),
            longitude_deg: at.longitude_deg(),
            heading_deg,
            heading_sigma_deg: 0.1,
            gsd_m_per_px: 1.0,
            scale_sigma_ratio: 0.001,
            covariance_m2: [[4.0, 0.0], [0.0, 4.0]],
            score: 10.0,
            false_fix_probability: 1e-4,
            log10_false_alarms: Some(-30.0),
            image_centre: crate::locate::Point { latitude_deg: at.latitude_deg(), longitude_deg: at.longitude_deg() },
            inliers: 20,
            tiles_searched: 4,
            nominal_count: 1.0,
            map_epoch: None,
            time_s: None,
            elapsed_ms: 1.0,
        }
    }

    #[test]
    fn a_fix_sets_the_position_and_tells_what_the_compass_is_wrong_by() {
        let sensed = Sensed { heading_rad: 1.0, height_m: 800.0 };
        let mut estimate = Estimate::start(place(), 50.0, sensed, &SIGMAS);
        let there = LocalFrame::at(place()).geodetic_from_enu(Enu { east_m: 40.0, north_m: -30.0 }).unwrap();
        let fix = fix(there, 0.95f64.to_degrees());
        assert!(estimate.innovation(&fix).unwrap() < 2.0);
        estimate.correct(&fix, 790f64.ln()).unwrap();
        let off = LocalFrame::at(there).enu_from_geodetic(estimate.position());
        assert!(off.length_m() < 0.2 && (estimate.heading_rad() - 0.95).abs() < 1e-3);
        assert!((estimate.height_m() - 790.0).abs() < 1.0);
        // 0.05 too much, shared out between offset and noise as their variances are.
        assert!((estimate.compass_offset_rad() - 0.04).abs() < 2e-3, "{}", estimate.compass_offset_rad());
        let [[ee, _], [_, nn]] = estimate.position_covariance_m2();
        assert!(ee >= 4.0 - 1e-9 && nn >= 4.0 - 1e-9 && ee < 4.1);
        let far = LocalFrame::at(there).geodetic_from_enu(Enu { east_m: 500.0, north_m: 0.0 }).unwrap();
        assert!(estimate.innovation(&self::fix(far, 54.0)).unwrap() > 1e4);
    }

    #[test]
    fn a_compass_that_tells_the_heading_corrects_the_way_flown_by_it() {
        let sigmas = SensorSigmas { heading_offset_rad: 1e-6, ..SIGMAS };
        let sensed = |heading_rad| Sensed { heading_rad, height_m: 800.0 };
        let mut estimate = Estimate::start(place(), 1.0, sensed(1.03), &sigmas);
        let ahead =
            Step { per_height: [0.0, 0.2], covariance: Matrix2::identity() * 1e-9, turn_sigma_rad: 1e-6, ..step(0.0) };
        for _ in 0..20 {
            estimate.advance(&ahead).unwrap();
        }
        let (sin, cos) = 1f64.sin_cos();
        let truth =
            LocalFrame::at(place()).geodetic_from_enu(Enu { east_m: 3200.0 * sin, north_m: 3200.0 * cos }).unwrap();
        let off_m = |estimate: &Estimate| LocalFrame::at(truth).enu_from_geodetic(estimate.position()).length_m();
        assert!((off_m(&estimate) - 96.0).abs() < 1.0);
        for _ in 0..50 {
            estimate.sense(sensed(1.0), &sigmas).unwrap();
        }
        // One word of 51 was 0.03 off, over 3200 m.
        assert!(off_m(&estimate) < 3.0, "{} m", off_m(&estimate));
    }

    #[test]
    fn a_gap_forgets_the_heading_but_not_the_compass_offset() {
        let sensed = Sensed { heading_rad: 1.0, height_m: 800.0 };
        let mut estimate = Estimate::start(place(), 50.0, sensed, &SIGMAS);
        for _ in 0..20 {
            estimate.sense(sensed, &SIGMAS).unwrap();
            estimate.correct(&fix(place(), 0.95f64.to_degrees()), 800f64.ln()).unwrap();
        }
        let moved = Enu { east_m: 100.0, north_m: 0.0 };
        estimate.drift(moved, 30.0, Sensed { heading_rad: 2.0, ..sensed }, &SIGMAS).unwrap();
        assert!((estimate.heading_rad() - 1.95).abs() < 0.01 && estimate.heading_sigma_rad() < 0.025);
        let [[ee, _], _] = estimate.position_covariance_m2();
        assert!((ee - 904.0).abs() < 1.0, "{ee}");
    }
}
