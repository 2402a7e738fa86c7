//! Searches in which every fix would be false: none is accepted, and the trials hang on their seed alone.

use overfly_lab::trial::{NegativeKind, NegativeOutcome, NegativeScore, NegativeTrial, RecordedFlight};
use overfly_testkit::drawn::{drawn_store, project};

fn trial(threads: usize) -> NegativeTrial {
    NegativeTrial {
        layer: "ortho".into(),
        trials: 48,
        seed: 3,
        prior_error_m: 300.0,
        regions: vec![1.0, 4.0],
        kinds: NegativeKind::ALL.into_iter().filter(|k| !k.is_repeating()).collect(),
        unknown_heading_share: 0.1,
        heading_sigma_deg: 3.0,
        height_sigma_ratio: 0.03,
        right_m: 3.0,
        threads,
    }
}

fn run(threads: usize) -> Vec<NegativeOutcome> {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    trial(threads).run(drawn_store(), &flight, None, |_| {}).unwrap()
}

/// Everything but the time it took.
fn told(outcomes: &[NegativeOutcome]) -> Vec<String> {
    let line = |o: &NegativeOutcome| {
        let place = o.search.as_ref().map(|s| (s.prior, s.searched_ratio));
        format!("{} {:?} {} {} {place:?} {:?}", o.number, o.kind, o.region, o.image, o.log10_false_alarms())
    };
    outcomes.iter().map(line).collect()
}

#[test]
fn negatives_are_not_accepted_whatever_the_number_of_threads() {
    let outcomes = run(2);
    let score = NegativeScore::from_outcomes(&outcomes, 2);
    assert_eq!((score.trials + score.skipped, score.accepted), (48, 0), "{score:?}");
    assert!(score.trials >= 45 && score.by_kind.len() == 16, "{score:?}");
    assert!(score.false_rate_upper95 < 0.07);
    // What was found is stated though it was refused: that is what the probability is calibrated on.
    let stated = |o: &&NegativeOutcome| o.log10_false_alarms().is_some();
    assert!(outcomes.iter().filter(stated).count() > 20, "{:?}", told(&outcomes));
    let surest = outcomes.iter().filter(|o| !o.kind.shows_its_ground()).filter_map(NegativeOutcome::log10_false_alarms);
    assert!(surest.fold(0.0, f64::min) > -3.0, "{:?}", told(&outcomes));
    assert_eq!(told(&run(1)), told(&outcomes));
}

#[test]
fn elsewhere_is_searched_where_the_frame_is_not() {
    let kinds = vec![NegativeKind::Elsewhere];
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let trial = NegativeTrial { trials: 8, kinds, regions: vec![1.0, 100.0], ..trial(2) };
    let outcomes = trial.run(drawn_store(), &flight, None, |_| {}).unwrap();
    for o in &outcomes {
        // No square of 6 km finds room away from a frame on a map of 2.5 km.
        assert_eq!(o.search.is_some(), o.region == 1.0);
        let Some(search) = &o.search else { continue };
        let truth = flight.frames.iter().find(|f| f.image == o.image).unwrap().true_position.unwrap();
        let off = overfly_core::geodesy::LocalFrame::at(truth).enu_from_geodetic(search.prior);
        assert!(off.east_m.abs().max(off.north_m.abs()) > 300.0 + 200.0, "{off:?}");
        assert!(search.searched_ratio > 0.2 && search.searched_ratio < 1.1, "{}", search.searched_ratio);
    }
}

#[test]
fn repeating_ground_is_drawn_alike_whatever_the_number_of_threads() {
    let kinds: Vec<_> = NegativeKind::ALL.into_iter().filter(|k| k.is_repeating()).collect();
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let run = |threads| {
        let trial = NegativeTrial { trials: 18, kinds: kinds.clone(), ..trial(threads) };
        trial.run(drawn_store(), &flight, None, |_| {}).unwrap()
    };
    let outcomes = run(2);
    assert_eq!(told(&run(1)), told(&outcomes));
    let score = NegativeScore::from_outcomes(&outcomes, 2);
    assert_eq!((score.trials, score.by_kind.len()), (18, 12), "{score:?}");
    assert!(outcomes.iter().all(|o| o.pattern.is_some_and(|p| p.period_m > 3.0)));
    // A fix is right at the frame's place, and nowhere else; a frame without a place has no right fix.
    assert_eq!(outcomes.iter().filter(|o| o.place.is_none()).count(), 3);
    for o in &outcomes {
        let is_near = o.error_m().is_some_and(|error_m| error_m <= 3.0);
        assert_eq!(o.is_right(), is_near, "{} {:?}", o.number, o.error_m());
    }
}
