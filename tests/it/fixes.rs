//! A fix is right or is none: on the project's own drawn tiles always, on real imagery on demand.

use super::needs::real_data;
use overfly_core::camera::{Attitude, Height, Intrinsics, View};
use overfly_core::geodesy::{EnuCovariance, Geodetic};
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::Parts;
use overfly_flight::locate::{
    Answer, FixRequest, HeadingPrior, LocateError, PositionOf, PositionPrior, Reason, locate,
};
use overfly_lab::trial::bands::{count_band, nees_band};
use overfly_lab::trial::{
    DisturbanceKind, DisturbanceScore, DisturbedOutcome, DisturbedTrial, FixOutcome, FixScore, FixTrial,
    RecordedFlight, TruthPoint,
};
use overfly_store::Reader;
use overfly_testkit::drawn::{built, drawn_store as drawn, project};
use std::path::Path;

fn trial() -> FixTrial {
    FixTrial {
        layer: "ortho".into(),
        prior_error_m: 500.0,
        seed: 1,
        heading_sigma_deg: Some(3.0),
        height_sigma_ratio: 0.03,
        unknown_position: false,
        truth: TruthPoint::Nadir,
        parts: Parts::ALL,
        threads: 2,
    }
}

/// The score of a flight whose attitude is exact.
fn score(trial: &FixTrial, store: &Reader, flight: &Path, right_m: f64) -> (FixScore, Vec<FixOutcome>) {
    let flight = RecordedFlight::read(flight).unwrap().with_attitude_sigma_rad(0.0);
    let outcomes = trial.run(store, &flight, |_| {}).unwrap();
    (FixScore::from_outcomes(&outcomes, right_m, 2), outcomes)
}

fn drawn_frame(number: usize) -> (Gray, FixRequest) {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let frame = &flight.frames[number];
    let gray = read_frame(&frame.path).unwrap();
    let request = FixRequest {
        layer: "ortho".into(),
        position: PositionPrior::Square { centre: frame.true_position.unwrap(), half_width_m: 300.0 },
        heading: Some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: 0.05 }),
        view: frame.view(&flight.camera),
        scale_sigma_ratio: 0.03,
        time_s: Some(frame.time_s),
    };
    (gray, request)
}

#[test]
fn drawn_frames_of_another_year_are_located_and_none_wrongly() {
    let (score, _) = score(&trial(), drawn(), &project("tiles/flight"), 5.0);
    assert_eq!(score.wrong, 0, "{score:?}");
    assert!(score.right >= 34, "{score:?}");
}

/// The stated covariance of a fix contains an error of up to 1 m that shifts a whole frame. Real maps have it; drawn tiles do not: their
/// errors have 0.31 of the stated variance.
const DRAWN_VARIANCE_RATIO: f64 = 0.31;
/// Bands of 99.8 %: one change in 500 that has no influence on errors and covariances leaves a band by chance.
const CONFIDENCE: f64 = 0.998;

#[test]
fn stated_covariances_are_those_of_the_errors() {
    let (score, outcomes) = score(&trial(), drawn(), &project("tiles/flight"), 5.0);
    let (fixes, nees) = (score.fixes as u64, score.nees.unwrap());
    assert!(outcomes.iter().filter_map(FixOutcome::nees).all(f64::is_finite));
    // The sum of the NEES over the variance ratio is chi-square with two degrees of freedom for each fix: 0.36 to 0.97 for 40 fixes.
    let [least, most] = nees_band(fixes, CONFIDENCE).map(|mean| mean * DRAWN_VARIANCE_RATIO);
    assert!((least..=most).contains(&nees.mean), "{least} to {most}: {score:?}");
    assert!((least..=most).contains(&nees.trimmed_mean), "{least} to {most}: {score:?}");
    // An error of that variance leaves its 95 % ellipse (NEES 5.991) with probability exp(-5.991 / 2 / 0.31); the count of such fixes is
    // binomial: at most one of 40.
    let inside = 1.0 - (-5.991 / 2.0 / DRAWN_VARIANCE_RATIO).exp();
    let covered = (score.ellipse95_coverage.unwrap() * fixes as f64).round() as u64;
    assert!(covered >= count_band(fixes, inside, CONFIDENCE)[0], "{score:?}");
    // 1 m of the frame and a tenth of a metre from its windows: 2.448 times their root of the sum of squares, and a tenth more.
    assert!(score.semi_major_95_m.unwrap().median <= 2.7, "{score:?}");
}

#[test]
fn the_number_of_threads_does_not_change_the_answer() {
    let (frame, request) = drawn_frame(3);
    let answers = [1, 2, 5].map(|threads| match locate(drawn(), &frame, &request, threads).unwrap() {
        Answer::Fix(fix) => fix,
        Answer::NoFix(no_fix) => panic!("{no_fix:?}"),
    });
    assert!(answers[0] == answers[1] && answers[1] == answers[2]);
}

#[test]
fn an_unknown_heading_is_found() {
    let (frame, request) = drawn_frame(5);
    let truth =
        RecordedFlight::read(&project("tiles/flight")).unwrap().frames[5].true_heading_rad.unwrap().to_degrees();
    let request = FixRequest { heading: None, ..request };
    let Answer::Fix(fix) = locate(drawn(), &frame, &request, 2).unwrap() else { panic!("no fix") };
    let off = (fix.heading.degrees() - truth + 180.0).rem_euclid(360.0) - 180.0;
    assert!(off.abs() < 1.0, "{off}");
}

#[test]
fn mirrored_frames_are_never_fixes() {
    for number in (0..40).step_by(4) {
        let (frame, request) = drawn_frame(number);
        let width = frame.width_px();
        let values = (0..frame.values().len()).map(|i| frame.at(width - 1 - i % width, i / width)).collect();
        let mirrored = Gray::from_values(width, frame.height_px(), values).unwrap();
        let answer = locate(drawn(), &mirrored, &request, 2).unwrap();
        assert!(matches!(answer, Answer::NoFix(_)), "frame {number}: {answer:?}");
    }
}

#[test]
fn frames_that_show_nothing_are_no_fix() {
    let (frame, request) = drawn_frame(0);
    let (w, h) = (frame.width_px(), frame.height_px());
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as f32
    };
    let static_noise = Gray::from_values(w, h, (0..w * h).map(|_| noise()).collect()).unwrap();
    let strip = Gray::from_values(3000, 2, (0..6000).map(|_| noise()).collect()).unwrap();
    let view = View::Nadir { gsd_m_per_px: 1.0 };
    for gray in [
        Gray::filled(w, h, 0.0),
        Gray::filled(w, h, 255.0),
        static_noise,
        strip,
        Gray::filled(1, 1, 7.0),
        Gray::filled(16, 16, 7.0),
    ] {
        let request = FixRequest { view: view.clone(), ..request.clone() };
        assert!(matches!(locate(drawn(), &gray, &request, 2).unwrap(), Answer::NoFix(_)));
    }
}

#[test]
fn a_frame_larger_than_countries_is_no_fix_at_once() {
    let (frame, request) = drawn_frame(0);
    let view = View::Nadir { gsd_m_per_px: 1e9 };
    let answer = locate(drawn(), &frame, &FixRequest { view, ..request }, 2).unwrap();
    assert!(matches!(&answer, Answer::NoFix(n) if n.reason == Reason::InconsistentScale), "{answer:?}");
}

#[test]
fn a_camera_that_sees_the_horizon_gives_no_fix() {
    let (frame, request) = drawn_frame(0);
    let (width, height) = (frame.width_px() as u32, frame.height_px() as u32);
    let view = View::Posed {
        // 51 degrees from the centre to the upper edge, and 45 degrees of pitch.
        intrinsics: Intrinsics::centred(width, height, 0.4 * f64::from(height)),
        height: Height::AboveGround(500.0),
        attitude: Attitude::exact(45f64.to_radians(), 0.0),
    };
    let answer = locate(drawn(), &frame, &FixRequest { view, ..request }, 2).unwrap();
    assert!(matches!(&answer, Answer::NoFix(n) if n.reason == Reason::HorizonInView), "{answer:?}");
}

#[test]
fn the_nadir_carries_the_attitude_and_the_centre_does_not() {
    let (frame, request) = drawn_frame(3);
    let View::Posed { intrinsics, height: Height::AboveGround(height_agl_m), attitude } = &request.view else {
        panic!("a pose")
    };
    let located = |sigma_deg: f64| {
        let attitude = Attitude { sigma_rad: sigma_deg.to_radians(), ..*attitude };
        let view = View::Posed { intrinsics: intrinsics.clone(), height: Height::AboveGround(*height_agl_m), attitude };
        match locate(drawn(), &frame, &FixRequest { view, ..request.clone() }, 2).unwrap() {
            Answer::Fix(fix) => fix,
            Answer::NoFix(no_fix) => panic!("{no_fix:?}"),
        }
    };
    let (exact, unsure) = (located(0.0), located(5.0));
    let axes = |covariance: EnuCovariance| covariance.ellipse().semi_minor_m;
    // Five degrees at about 520 m.
    assert!(axes(exact.covariance) < 3.0 && (40.0..60.0).contains(&axes(unsure.covariance)), "{unsure:?}");
    assert!(axes(unsure.image_centre_covariance) < 3.0, "{unsure:?}");
    assert_eq!((exact.position_of, unsure.attitude_sigma_rad), (PositionOf::Nadir, Some(5f64.to_radians())));
}

#[test]
fn without_a_height_the_answer_is_the_image_centre() {
    let (frame, request) = drawn_frame(3);
    let view = View::Nadir { gsd_m_per_px: 520.0 / 400.0 };
    let Answer::Fix(fix) =
        locate(drawn(), &frame, &FixRequest { view, scale_sigma_ratio: 0.05, ..request }, 2).unwrap()
    else {
        panic!("no fix")
    };
    assert_eq!((fix.position_of, fix.attitude_sigma_rad), (PositionOf::ImageCentre, None));
    assert_eq!((fix.position, fix.covariance), (fix.image_centre, fix.image_centre_covariance));
}

/// Disturbed frames of the drawn flight.
fn disturbed(kinds: &[DisturbanceKind], frames: usize, threads: usize) -> Vec<DisturbedOutcome> {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let trial = DisturbedTrial { fixes: FixTrial { threads, ..trial() }, kinds: kinds.to_vec(), frames };
    trial.run(drawn(), &flight, || {}).unwrap()
}

#[test]
fn an_unstated_tilt_is_inside_the_ellipse_or_refused() {
    let kinds = [DisturbanceKind::Tilt, DisturbanceKind::Distortion];
    let outcomes = disturbed(&kinds, 24, 2);
    let score = DisturbanceScore::from_outcomes(&outcomes, &kinds, 5.0);
    assert_eq!((score.total.frames, score.total.wrong), (48, 0), "{score:?}");
    assert_eq!((score.total.outside999_nadir, score.total.outside999_centre), (0, 0), "{score:?}");
    // Tilts of up to 5 degrees, four of six, are one standard deviation: they are located.
    assert!(score.by_kind[0].fixes >= 12, "{score:?}");
    let of_20_degrees = outcomes.iter().filter(|o| o.kind == DisturbanceKind::Tilt && o.size == 20.0);
    assert!(of_20_degrees.into_iter().all(|o| matches!(o.answer, Answer::NoFix(_))));
}

#[test]
fn disturbed_frames_are_the_same_whatever_the_threads() {
    let kinds = [DisturbanceKind::Noise, DisturbanceKind::Clouds];
    let [one, three] = [1, 3].map(|threads| disturbed(&kinds, 3, threads));
    assert!(one.iter().zip(&three).all(|(a, b)| a.answer == b.answer && a.size == b.size));
}

#[test]
fn a_prior_off_the_map_is_outside_the_map() {
    let (frame, request) = drawn_frame(0);
    for (latitude_deg, longitude_deg) in [(0.0, 0.0), (48.5, -164.4), (89.0, 15.6), (-48.5, 15.6)] {
        let centre = Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap();
        let position = PositionPrior::Square { centre, half_width_m: 500.0 };
        let answer = locate(drawn(), &frame, &FixRequest { position, ..request.clone() }, 2).unwrap();
        assert!(matches!(&answer, Answer::NoFix(n) if n.reason == Reason::OutsideMap), "{answer:?}");
    }
}

#[test]
fn questions_that_cannot_be_asked_are_refused_by_name() {
    let (frame, request) = drawn_frame(0);
    let refused = |request: &FixRequest| locate(drawn(), &frame, request, 1).unwrap_err();
    let nan = FixRequest { scale_sigma_ratio: f64::NAN, ..request.clone() };
    assert!(matches!(refused(&nan), LocateError::Parameter { name: "height_sigma_ratio", .. }));
    let heading = Some(HeadingPrior { heading_rad: 0.0, sigma_rad: -1.0 });
    let negative = FixRequest { heading, ..request.clone() };
    assert!(matches!(refused(&negative), LocateError::Parameter { name: "heading_sigma_deg", .. }));
    let flat = FixRequest { view: View::Nadir { gsd_m_per_px: 0.0 }, ..request.clone() };
    assert_eq!(refused(&flat).code(), "bad_camera");
    let elsewhere = FixRequest { layer: "nowhere".into(), ..request };
    assert!(matches!(refused(&elsewhere), LocateError::Store(_)));
}

#[test]
#[ignore = "needs naip"]
fn needs_naip_a_real_flight_is_located_over_its_own_year_and_another() {
    let flight = real_data("naip/flight_2018");
    for (year, least_right, most_median_m) in [("20180716", 48, 0.6), ("20160816", 46, 3.0)] {
        let map = real_data(&format!("naip/m_4709963_se_14_1_{year}.tif"));
        let folder = tempfile::tempdir().unwrap();
        let (score, _) = score(&trial(), &built(folder.path(), &map), &flight, 15.0);
        assert_eq!(score.wrong, 0, "{year} {score:?}");
        assert!(score.right >= least_right, "{year} {score:?}");
        let median_m = score.error_m.as_ref().unwrap().median;
        assert!(median_m <= most_median_m, "{year} {score:?}");
    }
}

#[test]
#[ignore = "needs brighton"]
fn needs_brighton_real_photos_that_reach_beyond_their_map_are_located() {
    let (flight, map) = (real_data("brighton"), real_data("brighton/ortho_0.09m.tif"));
    let folder = tempfile::tempdir().unwrap();
    let trial = FixTrial { prior_error_m: 30.0, ..trial() };
    let (score, _) = score(&trial, &built(folder.path(), &map), &flight, 5.0);
    assert_eq!(score.wrong, 0, "{score:?}");
    assert!(score.right >= 14, "{score:?}");
}
