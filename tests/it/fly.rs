//! A flight in a closed loop: every mode holds its position within its own ellipse, bears troubles, and is replayed alike.

use overfly_core::coupling::Mode;
use overfly_flight::navigate::{ExecutionTimes, NavigateOptions, SensorSigmas};
use overfly_lab::trial::bands::count_band;
use overfly_lab::trial::{Disturbances, FlyOutcome, FlyScore, FlyTrial, RecordedFlight};
use overfly_testkit::drawn::{drawn_store, project};

/// What counts as right on ground of 1 m a pixel.
const RIGHT_M: f64 = 10.0;

fn options(mode: Mode, threads: usize) -> NavigateOptions {
    NavigateOptions {
        layer: "ortho".into(),
        mode,
        relative_count: 5,
        sensors: SensorSigmas {
            heading_offset_rad: 0.05,
            heading_noise_rad: 0.05,
            height_offset_ratio: 0.03,
            height_noise_ratio: 0.03,
        },
        start_sigma_m: 30.0,
        speed_mps: 40.0,
        speed_sigma_mps: 20.0,
        min_turn_radius_m: 300.0,
        execution_times: ExecutionTimes::default(),
        tracks: true,
        threads,
    }
}

fn flown(mode: Mode, disturbances: Disturbances, threads: usize) -> Vec<FlyOutcome> {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let trial = FlyTrial { store: drawn_store(), flight: &flight, disturbances };
    trial.run(&options(mode, threads), |_| {}).unwrap()
}

fn score(mode: Mode, outcomes: &[FlyOutcome]) -> FlyScore {
    FlyScore::from_outcomes(mode, outcomes, &[], RIGHT_M)
}

/// The least share of positions inside their own 95 % ellipses if covariances are true: the lower end of the binomial band. With a
/// confidence of 90 % that is 36 of 40 positions (fewer come once in twenty), with 99 % it is 34.
fn least_coverage(score: &FlyScore, confidence: f64) -> f64 {
    let positions = score.frames as u64;
    count_band(positions, 0.95, confidence)[0] as f64 / positions as f64
}

#[test]
fn every_mode_holds_its_position_and_tells_how_well() {
    for mode in Mode::ALL {
        let score = score(mode, &flown(mode, Disturbances::default(), 2));
        let error = score.position_error_m.unwrap();
        assert!(error.p95 < 6.0 && error.max < RIGHT_M && score.wrong == 0, "{score:?}");
        assert!(score.ellipse95_coverage.unwrap() >= least_coverage(&score, 0.90), "{score:?}");
        assert_eq!(score.relative_count == 0, mode == Mode::Combined);
        assert_eq!(score.absolute_count < 20, mode == Mode::Sequential);
    }
}

#[test]
fn every_mode_comes_back_from_troubles() {
    let troubles = [
        ("black images", Disturbances { blackout: Some((12, 8)), ..Default::default() }),
        ("a wrong start", Disturbances { start_error_m: 600.0, ..Default::default() }),
        ("clouds", Disturbances { cloud_share: 0.3, seed: 6, ..Default::default() }),
        ("a wrong compass", Disturbances { heading_bias_rad: 10f64.to_radians(), ..Default::default() }),
    ];
    for (name, disturbances) in troubles {
        for mode in Mode::ALL {
            let score = score(mode, &flown(mode, disturbances.clone(), 2));
            assert_eq!(score.wrong, 0, "{name}: {score:?}");
            assert!(score.recovered_after_frames.is_some_and(|n| n <= 10), "{name}: {score:?}");
        }
    }
}

#[test]
fn a_replay_is_the_same_whatever_the_threads() {
    let told = |outcomes: &[FlyOutcome]| -> Vec<String> {
        outcomes.iter().map(|o| format!("{:?} {:?}", o.position.position, o.position.covariance)).collect()
    };
    let clouded = || Disturbances { cloud_share: 0.2, seed: 4, ..Default::default() };
    assert_eq!(told(&flown(Mode::Parallel, clouded(), 1)), told(&flown(Mode::Parallel, clouded(), 2)));
}

#[test]
fn a_late_result_is_carried_forward() {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let trial = FlyTrial { store: drawn_store(), flight: &flight, disturbances: Disturbances::default() };
    // Three intervals between images, so that every result is three relative registrations old.
    let execution_times = ExecutionTimes { fixed_s: 10.0, seconds_per_tile: 0.0, ..ExecutionTimes::default() };
    let late = NavigateOptions { execution_times, ..options(Mode::Parallel, 2) };
    let score = score(Mode::Parallel, &trial.run(&late, |_| {}).unwrap());
    let error = score.position_error_m.unwrap();
    assert!(error.p95 < 12.0 && score.wrong == 0 && score.absolute_count < 15, "{score:?}");
    assert!(score.ellipse95_coverage.unwrap() >= least_coverage(&score, 0.99), "{score:?}");
}

#[test]
fn a_late_result_tells_of_a_wrong_start_too() {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let disturbances = Disturbances { start_error_m: 600.0, ..Default::default() };
    let trial = FlyTrial { store: drawn_store(), flight: &flight, disturbances };
    // Between an image and its result one or two others are taken: what contradicts and what confirms are of different images.
    let execution_times = ExecutionTimes { fixed_s: 5.0, seconds_per_tile: 0.0, ..ExecutionTimes::default() };
    let late = NavigateOptions { execution_times, ..options(Mode::Parallel, 2) };
    let outcomes = trial.run(&late, |_| {}).unwrap();
    let error = score(Mode::Parallel, &outcomes[20..]).position_error_m.unwrap();
    assert!(error.max < 12.0, "{error:?}");
}

#[test]
fn dead_reckoning_is_scored_run_by_run() {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let trial = FlyTrial { store: drawn_store(), flight: &flight, disturbances: Disturbances::default() };
    let reckoned = trial.reckon(&options(Mode::RelativeOnly, 1), |_| {}).unwrap();
    let score = FlyScore::from_outcomes(Mode::RelativeOnly, &reckoned[0], &reckoned, RIGHT_M);
    let [run] = &score.dead_reckoning_runs[..] else { panic!("one run: {score:?}") };
    assert!(run.path_m > 4000.0 && run.end_error_share < 0.02 && score.absolute_count == 0, "{score:?}");
    assert!(score.ellipse95_coverage.unwrap() >= least_coverage(&score, 0.99), "{score:?}");
}
