//! Sequences that lie: frozen and replayed images, sensors and clocks that are wrong, absurd rows, things that stand still. No position
//! is falsely sure, and the flight comes back. The short form of `evaluate sequences`.

use overfly_core::coupling::Mode;
use overfly_flight::navigate::{NavigateOptions, PositionSource};
use overfly_lab::trial::{Disturbances, FlyOutcome, FlyTrial, RecordedFlight, SequenceFault, SourceScores};
use overfly_testkit::drawn::{drawn_store, project};

/// What counts as right on ground of 1 m a pixel.
const RIGHT_M: f64 = 10.0;

fn flight() -> RecordedFlight {
    RecordedFlight::read(&project("tiles/flight")).unwrap()
}

fn flown(flight: &RecordedFlight, fault: Option<SequenceFault>, seed: u64) -> Vec<FlyOutcome> {
    let disturbances = Disturbances { fault, seed, ..Disturbances::default() };
    let trial = FlyTrial { store: drawn_store(), flight, disturbances };
    let options = NavigateOptions { mode: Mode::Auto, threads: 2, ..NavigateOptions::default() };
    trial.run(&options, |_| {}).unwrap()
}

/// Flies with the faults: every position that is not called lost has the truth in its own 99.9 % ellipse, and the last one is
/// right.
fn holds(faults: &[SequenceFault]) {
    let flight = flight();
    for &fault in faults {
        let outcomes = flown(&flight, Some(fault), 1);
        let scores = SourceScores::count(&outcomes);
        let told: Vec<String> = outcomes
            .iter()
            .map(|o| format!("{} {} {:.0} m", o.image, o.position.source.word(), o.error.length_m()))
            .collect();
        assert_eq!((scores.absolute.outside, scores.propagated.outside), (0, 0), "{fault:?}: {told:?}");
        let last = outcomes.last().unwrap();
        let is_back = last.position.source != PositionSource::Lost && last.error.length_m() <= RIGHT_M;
        assert!(is_back, "{fault:?}: {told:?}");
    }
}

#[test]
fn frozen_images_are_no_measurement() {
    use SequenceFault::{Frozen, FrozenNoisy, FrozenShort, HalfFrozen};
    holds(&[FrozenShort, Frozen, FrozenNoisy, HalfFrozen]);
}

#[test]
fn replayed_images_move_nothing() {
    use SequenceFault::{Replayed, ReplayedElsewhere, ReplayedNoisy};
    holds(&[Replayed, ReplayedNoisy, ReplayedElsewhere]);
}

#[test]
fn images_in_another_order_move_nothing() {
    use SequenceFault::{Dropped, PlayedBackwards, Reversed, Swapped};
    holds(&[Reversed, PlayedBackwards, Swapped, Dropped]);
}

#[test]
fn a_compass_that_lies_moves_nothing() {
    use SequenceFault::{CompassDrift, CompassNoise, CompassReversed, CompassStuck};
    holds(&[CompassReversed, CompassDrift, CompassNoise, CompassStuck]);
}

#[test]
fn an_altimeter_that_lies_moves_nothing() {
    use SequenceFault::{AltimeterHigh, AltimeterLow, AltimeterStuck};
    holds(&[AltimeterHigh, AltimeterLow, AltimeterStuck]);
}

#[test]
fn a_clock_that_lies_moves_nothing() {
    use SequenceFault::{ClockSet, TimeBack, TimeJump, TimeLate, TimeRepeated};
    holds(&[TimeJump, TimeLate, TimeBack, TimeRepeated, ClockSet]);
}

#[test]
fn an_absurd_row_does_not_end_a_flight() {
    use SequenceFault::{HeightNegative, HeightZero, NoNumbers};
    holds(&[HeightZero, HeightNegative, NoNumbers]);
}

#[test]
fn what_stands_still_in_every_image_is_not_matched() {
    use SequenceFault::{Dust, Overlay, Wing};
    holds(&[Overlay, Dust, Wing]);
}

/// The camera is mounted 2 degrees off, and the attitude is stated to 2 degrees: one error for all images, which no number of fixes
/// reduces.
#[test]
fn a_constant_error_of_the_attitude_stays_in_the_ellipse() {
    let mut flight = flight();
    for frame in &mut flight.frames {
        frame.attitude.pitch_rad = frame.attitude.pitch_rad.map(|pitch_rad| pitch_rad + 2f64.to_radians());
        frame.attitude.sigma_rad = 2f64.to_radians();
    }
    let outcomes = flown(&flight, None, 1);
    let nees: Vec<f64> = outcomes.iter().map(|o| o.position.covariance.squared_mahalanobis(o.error)).collect();
    let mean = nees.iter().sum::<f64>() / nees.len() as f64;
    // 2 degrees of 2 degrees stated: 1, and what registration adds.
    assert!((0.5..2.0).contains(&mean) && nees.iter().all(|v| *v < 13.8), "{mean}: {nees:?}");
    // 2 degrees at 520 m are 18 m.
    let mut errors_m: Vec<f64> = outcomes.iter().map(|o| o.error.length_m()).collect();
    errors_m.sort_by(f64::total_cmp);
    assert!((14.0..22.0).contains(&errors_m[errors_m.len() / 2]), "{errors_m:?}");
    assert_eq!(SourceScores::count(&outcomes).lost.positions, 0);
}
