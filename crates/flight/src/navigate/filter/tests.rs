//! The filter against drawn flights and single measurements.

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

fn step(turn_rad: f64) -> OdometryStep {
    OdometryStep {
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
        let reading = |truth: &(Enu, f64, f64), rng: &mut ChaCha8Rng| SensorReading {
            heading_rad: truth.1 + compass + SIGMAS.heading_noise_rad * draw(rng),
            height_m: (truth.2 + altimeter + SIGMAS.height_noise_ratio * draw(rng)).exp(),
        };
        let first = Enu { east_m: 5.0 * draw(&mut rng), north_m: 5.0 * draw(&mut rng) };
        let start = LocalFrame::at(place()).geodetic_from_enu(first).unwrap();
        let mut filter = NavigationFilter::new(start, 5.0, reading(&truth, &mut rng), &SIGMAS);
        for _ in 0..steps {
            let s = step(0.05);
            let (sin, cos) = truth.1.sin_cos();
            let height = truth.2.exp();
            let [right, ahead] = s.per_height.map(|v| v * height);
            truth.0.east_m += right * cos + ahead * sin;
            truth.0.north_m += ahead * cos - right * sin;
            truth.1 += s.turn_rad;
            let sigma = s.covariance[(0, 0)].sqrt();
            let measured = OdometryStep {
                per_height: s.per_height.map(|v| v + sigma * draw(&mut rng)),
                turn_rad: s.turn_rad + s.turn_sigma_rad * draw(&mut rng),
                log_climb: s.climb_sigma * draw(&mut rng),
                ..s
            };
            filter.predict_odometry(&measured).unwrap();
            filter.update_sensors(reading(&truth, &mut rng), &SIGMAS).unwrap();
        }
        let found = LocalFrame::at(place()).enu_from_geodetic(filter.position());
        let off = SVector::<f64, 2>::new(found.east_m - truth.0.east_m, found.north_m - truth.0.north_m);
        let EnuCovariance { ee_m2: ee, en_m2: en, nn_m2: nn } = filter.position_covariance();
        let square = (off.transpose() * Matrix2::new(ee, en, en, nn).try_inverse().unwrap() * off)[0];
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

fn fix(position: Geodetic, heading_rad: f64, log_height: f64) -> FixMeasurement {
    FixMeasurement {
        position,
        covariance: EnuCovariance::from_sigma_m(2.0),
        heading: Heading::from_radians(heading_rad),
        heading_sigma_rad: 0.1f64.to_radians(),
        log_height,
        log_height_sigma: 0.001,
        false_probability: 1.5e-4,
    }
}

#[test]
fn a_fix_sets_the_position_and_estimates_the_compass_offset() {
    let reading = SensorReading { heading_rad: 1.0, height_m: 800.0 };
    let mut filter = NavigationFilter::new(place(), 50.0, reading, &SIGMAS);
    let there = LocalFrame::at(place()).geodetic_from_enu(Enu { east_m: 40.0, north_m: -30.0 }).unwrap();
    let residual = filter.update_fix(&fix(there, 0.95, 790f64.ln()), Gate::ONE_IN_A_MILLION).unwrap();
    assert!(residual.is_accepted && residual.nis < 2.0, "{residual:?}");
    // 40 and -30 m, each against 50 m of the start and 2 m of the fix.
    assert!((residual.nis - (40f64.powi(2) + 30f64.powi(2)) / (2500.0 + 4.0)).abs() < 1e-3, "{residual:?}");
    let off = LocalFrame::at(there).enu_from_geodetic(filter.position());
    assert!(off.length_m() < 0.2 && (filter.heading().radians() - 0.95).abs() < 1e-3);
    assert!((filter.height_m() - 790.0).abs() < 1.0);
    // The compass read 0.05 rad too much: shared between offset and noise in proportion to their variances.
    assert!((filter.compass_offset_rad() - 0.04).abs() < 2e-3, "{}", filter.compass_offset_rad());
    let EnuCovariance { ee_m2: ee, nn_m2: nn, .. } = filter.position_covariance();
    assert!(ee >= 4.0 - 1e-9 && nn >= 4.0 - 1e-9 && ee < 4.1);
    let far = LocalFrame::at(there).geodetic_from_enu(Enu { east_m: 500.0, north_m: 0.0 }).unwrap();
    let before = filter.clone();
    let residual = filter.update_fix(&fix(far, 0.95, 790f64.ln()), Gate::ONE_IN_A_MILLION).unwrap();
    assert!(!residual.is_accepted && residual.nis > 1e4, "{residual:?}");
    assert_eq!(
        (filter.position(), filter.state, filter.covariance),
        (before.position(), before.state, before.covariance)
    );
}

#[test]
fn a_singular_innovation_is_an_error_and_changes_nothing() {
    let exact = SensorSigmas {
        heading_offset_rad: 0.0,
        heading_noise_rad: 0.0,
        height_offset_ratio: 0.0,
        height_noise_ratio: 0.0,
    };
    let reading = SensorReading { heading_rad: 1.0, height_m: 800.0 };
    let mut filter = NavigationFilter::new(place(), 0.0, reading, &exact);
    let before = filter.clone();
    let singular = |measurement| FilterError::SingularInnovation { measurement };
    assert_eq!(filter.update_sensors(reading, &exact), Err(singular("sensor reading")));
    let exact_fix = FixMeasurement { covariance: EnuCovariance::from_sigma_m(0.0), ..fix(place(), 1.0, 800f64.ln()) };
    assert_eq!(filter.update_fix(&exact_fix, Gate::OPEN), Err(singular("fix")));
    assert_eq!(
        (filter.position(), filter.state, filter.covariance),
        (before.position(), before.state, before.covariance)
    );
}

#[test]
fn later_compass_readings_correct_the_displacement_reckoned_by_the_first() {
    let sigmas = SensorSigmas { heading_offset_rad: 1e-6, ..SIGMAS };
    let reading = |heading_rad| SensorReading { heading_rad, height_m: 800.0 };
    let mut filter = NavigationFilter::new(place(), 1.0, reading(1.03), &sigmas);
    let ahead = OdometryStep {
        per_height: [0.0, 0.2],
        covariance: Matrix2::identity() * 1e-9,
        turn_sigma_rad: 1e-6,
        ..step(0.0)
    };
    for _ in 0..20 {
        filter.predict_odometry(&ahead).unwrap();
    }
    let (sin, cos) = 1f64.sin_cos();
    let truth = LocalFrame::at(place()).geodetic_from_enu(Enu { east_m: 3200.0 * sin, north_m: 3200.0 * cos }).unwrap();
    let off_m = |filter: &NavigationFilter| LocalFrame::at(truth).enu_from_geodetic(filter.position()).length_m();
    assert!((off_m(&filter) - 96.0).abs() < 1.0);
    for _ in 0..50 {
        filter.update_sensors(reading(1.0), &sigmas).unwrap();
    }
    // One reading of 51 was 0.03 rad off, over 3200 m.
    assert!(off_m(&filter) < 3.0, "{} m", off_m(&filter));
}

#[test]
fn dead_reckoning_resets_the_heading_but_not_the_compass_offset() {
    let reading = SensorReading { heading_rad: 1.0, height_m: 800.0 };
    let mut filter = NavigationFilter::new(place(), 50.0, reading, &SIGMAS);
    for _ in 0..20 {
        filter.update_sensors(reading, &SIGMAS).unwrap();
        filter.update_fix(&fix(place(), 0.95, 800f64.ln()), Gate::OPEN).unwrap();
    }
    let moved = Enu { east_m: 100.0, north_m: 0.0 };
    filter
        .predict_dead_reckoning(
            moved,
            30.0,
            SensorReading { heading_rad: 2.0, ..reading },
            Manoeuvre::default(),
            &SIGMAS,
        )
        .unwrap();
    assert!((filter.heading().radians() - 1.95).abs() < 0.01 && filter.heading_sigma_rad() < 0.025);
    let ee = filter.position_covariance().ee_m2;
    assert!((ee - 904.0).abs() < 1.0, "{ee}");
}
