//! Relative registration on real consecutive photos: registered, and in agreement with the sensors.

use overfly_lab::trial::{LegScore, LegSensorSigmas, RecordedFlight, run_legs};
use std::path::Path;

/// All legs of a flight beside the repository; `None`, loudly, where it is not there.
fn score(name: &str) -> Option<LegScore> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !folder.join("flight.csv").exists() {
        eprintln!("SKIPPED: no flight in {}", folder.display());
        return None;
    }
    let flight = RecordedFlight::read(&folder).unwrap();
    // Drones' receivers: 1 to 3 m; the heights are above take-off, the focal length is nominal.
    let sensors = LegSensorSigmas { position_m: 2.0, heading_rad: 3f64.to_radians(), height_ratio: 0.03 };
    let legs = run_legs(&flight, &sensors, |_| ()).unwrap();
    for leg in legs.iter().filter(|leg| leg.measured.is_none_or(|m| !m.agrees)) {
        eprintln!("{leg:?}");
    }
    Some(LegScore::from_legs(&legs))
}

#[test]
fn trees_over_a_slope_are_registered_and_agree_with_the_sensors() {
    if let Some(score) = score("brighton") {
        assert_eq!((score.legs, score.registered, score.agreeing), (17, 17, 17));
    }
}

#[test]
fn high_rises_and_a_descent_are_registered_and_agree_with_the_sensors() {
    if let Some(score) = score("chia") {
        assert_eq!((score.legs, score.registered, score.agreeing), (8, 8, 8));
    }
}
