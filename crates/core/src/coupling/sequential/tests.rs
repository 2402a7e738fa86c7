//! The sequential mode against brute force: searched minima and roots, numerical derivatives, the printed forms.

use super::super::parameters::drawn::{PLAIN, any, log_uniform};
use super::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// f(n) written down again from (4), (5), (6), (9) and (10), linear drift and no constant.
fn failures_again(p: &CouplingParameters, n: f64, mission_s: f64) -> f64 {
    let side = |edge: f64| edge + p.inaccuracy_m + 2.0 * n * p.unit_drift_m;
    let execution = p.seconds_per_tile * side(p.across_m) * side(p.along_m) / p.across_m / p.along_m;
    (p.speed_mps / p.along_m * execution) * (mission_s / (n * p.relative_s + execution))
}

/// Draws whose aircraft is slower than v_max.
fn flyable(seed: u64, count: usize) -> Vec<CouplingParameters> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::new();
    while found.len() < count {
        let mut p = any(&mut rng);
        let max = Sequential::new(p).unwrap().max_speed_mps();
        p.speed_mps = (max * log_uniform(&mut rng, 1e-3, 0.99)).max(1e-6);
        found.push(p);
    }
    found
}

/// The n of least f by search alone: a fine grid, then a finer one around its best.
fn searched_minimum(f: impl Fn(f64) -> f64, most: f64) -> (f64, f64) {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..12 {
        let at = |k: usize| low + (high - low) * k as f64 / 60.0;
        let best = (0..=60).min_by(|&i, &j| f(at(i)).total_cmp(&f(at(j)))).unwrap();
        (low, high) = (at(best.saturating_sub(1)), at((best + 1).min(60)));
    }
    let n = (low + high) / 2.0;
    (n, f(n))
}

#[test]
fn the_model_is_equations_4_to_11() {
    for mut p in flyable(1, 500) {
        p.search_constant_s = 0.0;
        let mode = Sequential::new(p).unwrap();
        // (11): f = T0 v / b (A n^2 + B n + C) / (A n^2 + B' n + C).
        let (a, b, i, d) = (p.across_m, p.along_m, p.inaccuracy_m, p.unit_drift_m);
        let (ca, cb, cc) = (4.0 * d * d, 2.0 * d * (a + b + 2.0 * i), (a + i) * (b + i));
        let dashed = cb + p.relative_s * a * b / p.seconds_per_tile;
        let most = mode.max_relative_count().unwrap_or(0.0);
        for part in [0.0, 0.3, 0.9] {
            let n = part * most;
            let eleven = 3600.0 * p.speed_mps / b * (ca * n * n + cb * n + cc) / (ca * n * n + dashed * n + cc);
            let f = mode.expected_failures(n, 3600.0).unwrap();
            assert!((f / eleven - 1.0).abs() < 1e-9, "{f} {eleven}");
            assert!((failures_again(&p, n, 3600.0) / eleven - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn at_v_max_a_registration_without_drift_takes_as_long_as_the_flight_over_one_image() {
    for p in flyable(2, 500) {
        let mode = Sequential::new(p).unwrap();
        let v = mode.max_speed_mps();
        assert!((mode.execution_s(0.0).unwrap() * v / p.along_m - 1.0).abs() < 1e-9);
        let at = Sequential::new(CouplingParameters { speed_mps: v, ..p }).unwrap();
        // p = 1 and n_max = 0 there, to rounding.
        assert!((at.execution_s(0.0).unwrap() * at.failures_per_second() - 1.0).abs() < 1e-9);
        assert!(at.max_relative_count().unwrap() * p.unit_drift_m < 1e-6 * p.across_m.max(p.along_m) * 1e3);
        let beyond = Sequential::new(CouplingParameters { speed_mps: v * 1.001, ..p }).unwrap();
        assert_eq!(beyond.max_relative_count().unwrap_err().code(), "speed_above_max");
        assert_eq!(beyond.failure_probability(0.0).unwrap_err().code(), "speed_above_max");
        assert!(beyond.max_mission_s().is_err() && beyond.best_whole_relative_count().is_err());
    }
}

#[test]
fn n_max_is_the_root_that_bisection_finds() {
    for growth in [DriftGrowth::Linear, DriftGrowth::SquareRoot] {
        for mut p in flyable(3, 2000) {
            p.drift_growth = growth;
            let mode = Sequential::new(p).unwrap();
            let limit_s = p.along_m / p.speed_mps;
            let stated = mode.max_relative_count().unwrap();
            let (mut low, mut high) = (0.0, 1.0);
            while high < 1e9 && mode.execution_s(high).unwrap() < limit_s {
                high *= 2.0;
            }
            if high >= 1e9 {
                continue;
            }
            for _ in 0..200 {
                let middle = (low + high) / 2.0;
                if mode.execution_s(middle).unwrap() < limit_s { low = middle } else { high = middle }
            }
            assert!((stated - low).abs() < 1e-6 * low.max(1e-3), "{stated} {low}");
        }
    }
}

#[test]
fn n_max_is_equation_8_as_printed() {
    for mut p in flyable(4, 500) {
        p.search_constant_s = 0.0;
        p.speed_mps = p.speed_mps.min(0.9 * Sequential::new(p).unwrap().max_speed_mps());
        let (a, b, i) = (p.across_m, p.along_m, p.inaccuracy_m);
        let under_root = (a - b).powi(2) + 4.0 * a * b * b / (p.seconds_per_tile * p.speed_mps);
        let printed = (-a - b - 2.0 * i + under_root.sqrt()) / (4.0 * p.unit_drift_m);
        let stated = Sequential::new(p).unwrap().max_relative_count().unwrap();
        assert!((printed - stated).abs() < 1e-9 * (stated + (a + b) / p.unit_drift_m), "{printed} {stated}");
    }
}

#[test]
fn the_slope_is_that_of_differences() {
    for (k, mut p) in flyable(5, 2000).into_iter().enumerate() {
        p.drift_growth = if k % 2 == 0 { DriftGrowth::Linear } else { DriftGrowth::SquareRoot };
        p.failure_probability = if k % 3 == 0 { Some(0.01) } else { None };
        let mode = Sequential::new(p).unwrap();
        let most = mode.max_relative_count().unwrap();
        if !(1e-3..1e8).contains(&most) {
            continue;
        }
        for part in [0.1, 0.5, 0.8] {
            let (n, step) = (part * most, 1e-4 * part * most);
            let f = |n: f64| mode.expected_failures(n, 1000.0).unwrap();
            let numeric = (f(n + step) - f(n - step)) / (2.0 * step);
            let stated = mode.expected_failures_slope(n, 1000.0).unwrap();
            // Third-order remainder and cancellation, against the size of f / n.
            assert!((numeric - stated).abs() < 1e-6 * (stated.abs() + f(n) / n), "{numeric} {stated}");
        }
    }
}

#[test]
fn the_dashed_c_of_equation_12_can_only_be_c() {
    // (12) solved for C', with a numerical derivative on its left-hand side: C comes out, not C + t0 a b / K1 as the dash
    // of B' suggests.
    let p = PLAIN;
    let (a, b, i, d) = (p.across_m, p.along_m, p.inaccuracy_m, p.unit_drift_m);
    let (ca, cb, cc) = (4.0 * d * d, 2.0 * d * (a + b + 2.0 * i), (a + i) * (b + i));
    let dash = p.relative_s * a * b / p.seconds_per_tile;
    let (n, step, mission_s) = (30.0, 1e-3, 1000.0);
    let numeric = (failures_again(&p, n + step, mission_s) - failures_again(&p, n - step, mission_s)) / (2.0 * step);
    let front = p.relative_s * mission_s * p.speed_mps * a / p.seconds_per_tile * (ca * n * n - cc);
    let dashed_c = (front / numeric).sqrt() - ca * n * n - (cb + dash) * n;
    assert!((dashed_c / cc - 1.0).abs() < 1e-3, "{dashed_c} {cc}");
    assert!((dashed_c - (cc + dash)).abs() > 0.3 * cc);
    let twelve = front / (ca * n * n + (cb + dash) * n + cc).powi(2);
    let stated = Sequential::new(p).unwrap().expected_failures_slope(n, mission_s).unwrap();
    assert!((stated / twelve - 1.0).abs() < 1e-12);
}

#[test]
fn the_best_n_is_where_a_search_finds_the_least_f() {
    let mut inside = 0;
    for (k, mut p) in flyable(6, 3000).into_iter().enumerate() {
        if k % 2 == 0 {
            p.search_constant_s = 0.0;
        }
        let mode = Sequential::new(p).unwrap();
        let most = mode.max_relative_count().unwrap();
        if !(1e-2..1e8).contains(&most) {
            continue;
        }
        let (n, least) = searched_minimum(|n| mode.expected_failures(n.min(most), 3600.0).unwrap(), most);
        let stated = mode.best_relative_count().unwrap();
        assert!((mode.least_expected_failures(3600.0).unwrap() / least - 1.0).abs() < 1e-9);
        // A parabola's bottom is known to the root of the rounding of f.
        assert!((n - stated).abs() < 1e-5 * most + 1e-4 * stated, "{n} {stated} of {most}");
        inside += usize::from(stated < most);
        let mission_s = mode.max_mission_s().unwrap();
        assert!((mode.expected_failures(stated, mission_s).unwrap() - 1.0).abs() < 1e-9);
        assert!(
            mission_s
                >= mode.cycle_s(n.min(most)).unwrap() / mode.failure_probability(n.min(most)).unwrap() * 0.999_999
        );
    }
    assert!(inside > 300, "only {inside} draws have their best n below n_max");
}

#[test]
fn root_growth_or_a_measured_probability_puts_the_best_n_at_n_max() {
    for (k, mut p) in flyable(7, 600).into_iter().enumerate() {
        (p.drift_growth, p.failure_probability) = match k % 3 {
            0 => (DriftGrowth::SquareRoot, None),
            1 => (DriftGrowth::Linear, Some(0.02)),
            _ => (DriftGrowth::SquareRoot, Some(0.02)),
        };
        let mode = Sequential::new(p).unwrap();
        let most = mode.max_relative_count().unwrap();
        assert_eq!(mode.best_relative_count().unwrap(), most);
        if (1e-2..1e8).contains(&most) {
            let (n, _) = searched_minimum(|n| mode.expected_failures(n.min(most), 60.0).unwrap(), most);
            assert!(n > 0.999 * most, "{n} of {most}");
        }
    }
}

#[test]
fn the_best_whole_n_beats_all_others() {
    let mut tried = 0;
    for p in flyable(8, 1500) {
        let mode = Sequential::new(p).unwrap();
        let most = mode.max_relative_count().unwrap();
        if most > 2000.0 {
            continue;
        }
        let f = |n: u32| mode.expected_failures(f64::from(n), 1.0).unwrap();
        let best = (0..=most as u32).min_by(|&i, &j| f(i).total_cmp(&f(j))).unwrap();
        let stated = mode.best_whole_relative_count().unwrap();
        assert!(f(stated as u32) <= f(best) * (1.0 + 1e-12), "{stated} {best} of {most}");
        tried += 1;
    }
    assert!(tried > 500, "{tried}");
}

#[test]
fn equations_13_14_and_16_are_exact_without_inaccuracy_and_rosy_with_it() {
    let mut with_inaccuracy = 0;
    for mut p in flyable(9, 3000) {
        p.search_constant_s = 0.0;
        let share = p.inaccuracy_m / p.across_m.min(p.along_m);
        let mode = Sequential::new(p).unwrap();
        if mode.optimal_relative_count() > mode.max_relative_count().unwrap() {
            continue;
        }
        let (exact, printed) = (mode.max_mission_s().unwrap(), mode.max_mission_paper_s());
        let (least, least_printed) =
            (mode.least_expected_failures(900.0).unwrap(), mode.least_expected_failures_paper(900.0));
        assert!(printed >= exact * (1.0 - 1e-9) && printed <= exact * (1.0 + share) * (1.0 + 1e-9));
        assert!(least_printed <= least * (1.0 + 1e-9) && least_printed >= least / (1.0 + share) * (1.0 - 1e-9));
        let n = mode.optimal_relative_count() / mode.optimal_relative_count_paper();
        assert!(n >= 1.0 - 1e-9 && n <= 1.0 + share + 1e-9);
        if p.inaccuracy_m == 0.0 {
            assert!((printed / exact - 1.0).abs() < 1e-9 && (least_printed / least - 1.0).abs() < 1e-9);
        } else if printed > exact * (1.0 + 1e-6) {
            with_inaccuracy += 1;
        }
    }
    assert!(with_inaccuracy > 100, "{with_inaccuracy}");
}

#[test]
fn with_an_inaccuracy_as_large_as_the_image_the_printed_mission_is_much_too_long() {
    // 200 x 200 m, I = 200 m, and relative registrations that dominate the cycle.
    let p = CouplingParameters {
        across_m: 200.0,
        along_m: 200.0,
        inaccuracy_m: 200.0,
        unit_drift_m: 1.0,
        seconds_per_tile: 0.01,
        ..PLAIN
    };
    let mode = Sequential::new(p).unwrap();
    assert!(mode.optimal_relative_count() < mode.max_relative_count().unwrap());
    let ratio = mode.max_mission_paper_s() / mode.max_mission_s().unwrap();
    assert!(ratio > 1.9 && ratio < 2.0, "{ratio}");
    assert!(
        (mode.optimal_relative_count() - 200.0).abs() < 1e-9
            && (mode.optimal_relative_count_paper() - 100.0).abs() < 1e-9
    );
}

#[test]
fn n_max_is_met_exactly_and_not_passed() {
    let mode = Sequential::new(PLAIN).unwrap();
    let most = mode.max_relative_count().unwrap();
    assert!((mode.failure_probability(most).unwrap() - 1.0).abs() < 1e-9);
    match mode.expected_failures(most * 1.001, 1.0) {
        Err(CouplingError::CountAboveMax { max_relative_count, .. }) => assert_eq!(max_relative_count, most),
        other => panic!("{other:?}"),
    }
    assert_eq!(mode.nominal_count(f64::NAN).unwrap_err().code(), "out_of_domain");
    assert!(mode.nominal_count(-1.0).is_err() && mode.expected_failures(1.0, f64::NAN).is_err());
}

#[test]
fn without_drift_there_is_no_limit() {
    for growth in [DriftGrowth::Linear, DriftGrowth::SquareRoot] {
        let p = CouplingParameters { unit_drift_m: 0.0, drift_growth: growth, inaccuracy_m: 0.0, ..PLAIN };
        let mode = Sequential::new(p).unwrap();
        assert_eq!(mode.max_relative_count(), Ok(f64::INFINITY));
        assert_eq!(mode.best_relative_count(), Ok(f64::INFINITY));
        assert_eq!(mode.best_whole_relative_count(), Ok(u64::MAX));
        assert_eq!((mode.max_mission_s(), mode.least_expected_failures(1e5)), (Ok(f64::INFINITY), Ok(0.0)));
        assert_eq!(mode.max_mission_paper_s(), f64::INFINITY);
        assert_eq!(mode.expected_failures_slope(0.0, 1.0).unwrap().signum(), -1.0);
        let expected = p.seconds_per_tile;
        assert!((mode.execution_s(1000.0).unwrap() - expected).abs() < 1e-12);
    }
}

#[test]
fn refuses_parameters_that_are_no_numbers() {
    assert!(Sequential::new(CouplingParameters { speed_mps: f64::NAN, ..PLAIN }).is_err());
}
