//! Relative registration on real consecutive photos: registered, and in agreement with the sensors.

use super::needs::real_data;
use overfly_lab::trial::{LegScore, LegSensorSigmas, RecordedFlight, run_legs};

/// All legs of a flight of the real imagery.
fn score(name: &str) -> LegScore {
    let flight = RecordedFlight::read(&real_data(name)).unwrap();
    // Drones' receivers: 1 to 3 m; the heights are above take-off, the focal length is nominal.
    let sensors = LegSensorSigmas { position_m: 2.0, heading_rad: 3f64.to_radians(), height_ratio: 0.03 };
    let legs = run_legs(&flight, &sensors, |_| ()).unwrap();
    for leg in legs.iter().filter(|leg| leg.measured.is_none_or(|m| !m.agrees)) {
        eprintln!("{leg:?}");
    }
    LegScore::from_legs(&legs)
}

#[test]
#[ignore = "needs brighton"]
fn needs_brighton_trees_over_a_slope_are_registered_and_agree_with_the_sensors() {
    let score = score("brighton");
    assert_eq!((score.legs, score.registered, score.agreeing), (17, 17, 17));
}

#[test]
#[ignore = "needs chia"]
fn needs_chia_high_rises_and_a_descent_are_registered_and_agree_with_the_sensors() {
    let score = score("chia");
    assert_eq!((score.legs, score.registered, score.agreeing), (8, 8, 8));
}
