//! `overfly simulate`: where the paper's assumptions hold, what happens is what it predicts; where they do not, it departs as
//! docs/simulation.md says; and no thread changes anything.

use overfly_core::coupling::Mode;
use overfly_lab::trial::simulation::{
    SimulatedFlights, Simulation, SimulationSummary, Variation, read_simulation, summarize, write_simulation,
};
use overfly_testkit::drawn::{drawn_store, project};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn flown(variations: Vec<Variation>, threads: usize) -> Vec<SimulatedFlights> {
    Simulation { path: "sim.toml".into(), variations, threads }.run(|| {}).unwrap()
}

fn documented(name: &str) -> Vec<Variation> {
    read_simulation(&project(&format!("docs/simulation/{name}.toml"))).unwrap()
}

fn summaries(name: &str) -> Vec<SimulationSummary> {
    summarize(&flown(documented(name), 2)).0
}

fn find<'a>(summaries: &'a [SimulationSummary], variation: &str) -> &'a SimulationSummary {
    summaries.iter().find(|s| s.variation == variation).unwrap_or_else(|| panic!("no {variation}"))
}

fn is_inside(summary: &SimulationSummary, what: &str) -> bool {
    let found = summary.comparisons.iter().find(|c| c.what == what);
    found.unwrap_or_else(|| panic!("{} has no {what}", summary.variation)).inside
}

#[test]
fn where_the_papers_assumptions_hold_its_predictions_do() {
    let flown = flown(documented("paper"), 2);
    let (summaries, family) = summarize(&flown);
    for s in &summaries {
        for c in &s.comparisons {
            assert!(c.inside, "{}, {}: {c:?}", s.variation, s.mode.word());
        }
    }
    assert!(family.comparisons > 40 && family.inside == family.comparisons);
    // (14) and (16) as printed are among them, at eight sets of parameters, p from 0.0004 to 0.09, and (11) at others.
    let printed = summaries.iter().filter(|s| s.comparisons.iter().any(|c| c.what == "failures_printed"));
    assert_eq!(printed.count(), 8);
    let probabilities = || summaries.iter().filter_map(|s| s.predicted.failure_probability);
    assert!(probabilities().fold(1.0, f64::min) < 2e-4 && probabilities().fold(0.0, f64::max) > 0.09);
}

#[test]
fn a_prediction_that_is_wrong_by_a_fifth_is_found_out() {
    let flown = flown(documented("paper"), 2);
    for factor in [0.8, 1.2] {
        let mut wrong = flown.clone();
        for f in &mut wrong {
            f.prediction.failures = f.prediction.failures.map(|mean| mean * factor);
            f.prediction.failures_printed = f.prediction.failures_printed.map(|mean| mean * factor);
        }
        for s in summarize(&wrong).0 {
            for c in s.comparisons.iter().filter(|c| c.what.starts_with("failures")) {
                // What is adjusted was not made wrong.
                assert!(!c.inside || c.what == "failures_adjusted", "{} by {factor}: {c:?}", s.variation);
            }
        }
    }
}

#[test]
fn a_fiftieth_is_found_out_where_flights_are_many() {
    let mut variations = documented("paper");
    variations.truncate(1);
    variations[0].scenario.runs = 200_000;
    variations[0].scenario.execution.seconds_per_tile = 0.05;
    let mut flown = flown(variations, 2);
    assert!(is_inside(&summarize(&flown).0[0], "failures"));
    flown[0].prediction.failures = flown[0].prediction.failures.map(|mean| mean * 1.02);
    assert!(!is_inside(&summarize(&flown).0[0], "failures"));
}

#[test]
fn where_they_do_not_hold_it_departs_as_documented() {
    let found = summaries("departures");
    let s = |name: &str| find(&found, name);
    // (14) as printed leaves out I and the constant part of a search; (11) does not.
    for (name, ratio) in [
        ("I = a / 10", 1.10),
        ("I = a / 4", 1.25),
        ("I = a", 1.99),
        ("constant of one image", 1.21),
        ("constant of ten images", 2.15),
    ] {
        assert!(is_inside(s(name), "failures") && !is_inside(s(name), "failures_printed"), "{name}");
        let off = s(name).simulated.failures / s(name).predicted.failures_printed.unwrap();
        assert!((off / ratio - 1.0).abs() < 0.05, "{name}: {off}");
    }
    // Whole images, and positions outside the region: explained by what the model leaves out.
    for name in [
        "an image every 0.2 s",
        "an image every 1 s",
        "independent drift of 3 sigma, root n D_U",
        "independent drift of 2 sigma, root n D_U",
        "repeated drift, root n D_U",
        "parallel, an image every 1 s",
        "combined, an image every 1 s",
    ] {
        assert!(!is_inside(s(name), "failures") && is_inside(s(name), "failures_adjusted"), "{name}");
    }
    assert!(s("repeated drift, root n D_U").simulated.failure_probability.unwrap() > 0.99);
    assert!(is_inside(s("independent drift, n D_U"), "failures"));
    // A growing region: the next failure is likelier, and a slow search is lost as often as computed.
    let grown = &s("a growing region").simulated;
    let after = grown.failure_probability_after_failure.unwrap() / grown.failure_probability.unwrap();
    assert!((1.9..2.8).contains(&after), "{after}");
    let lost = s("a growing region, slow search");
    let stated = lost.adjusted.unwrap().flights_lost;
    assert!(lost.adjusted.unwrap().failures.is_none() && (0.8..0.95).contains(&stated));
    // Four standard deviations of 2000 flights.
    assert!((lost.simulated.flights_lost - stated).abs() < 4.0 * (stated * (1.0 - stated) / 2000.0).sqrt(), "{stated}");
    let retried = s("retries, slow search");
    let off = retried.simulated.failures / retried.adjusted.unwrap().failures.unwrap();
    assert!(!is_inside(retried, "failures") && (off - 1.0).abs() < 0.01, "{off}");
    // A wrong position brings failures in company.
    let wrong = &s("every fifth failure a wrong position").simulated;
    assert!(wrong.dispersion.unwrap() > 2.0 && wrong.outside_region > 0 && wrong.false_fixes > 0);
    // Where p does not come of t_exe, (13) is not the best n: four times as many failures are fewer, or more.
    let failures = |name: &str| s(name).simulated.failures;
    assert!(failures("p of every search, 4 n_opt") < 0.3 * failures("p of every search"));
    assert!(failures("p of every image searched, 4 n_opt") > 1.4 * failures("p of every image searched"));
}

#[test]
fn covariances_are_true_where_errors_are_as_stated_and_found_out_where_not() {
    let mut variations = documented("covariance");
    variations.retain(|v| ["base", "half told"].contains(&v.name.as_str()));
    for v in &mut variations {
        v.scenario.modes = vec![Mode::RelativeOnly, Mode::Sequential];
        (v.scenario.runs, v.scenario.mission_s) = (300, Some(1800.0));
        v.scenario.covariance.as_mut().unwrap().runs = 300;
    }
    let (found, _) = summarize(&flown(variations, 2));
    for s in &found {
        let score = s.covariance.as_ref().unwrap();
        assert_eq!((score.runs, score.coverage_over_time.len()), (300, 24));
        if s.variation == "base" {
            assert!(is_inside(s, "ellipse95_coverage") && is_inside(s, "nees_mean"), "{:?}", s.comparisons);
        } else if s.mode == Mode::Sequential {
            // (In dead reckoning alone the compass's and altimeter's offsets rule, which are told as they are.)
            assert!(!is_inside(s, "ellipse95_coverage") && !is_inside(s, "nees_mean"), "{:?}", s.comparisons);
        }
    }
}

#[test]
fn threads_change_nothing() {
    let mut variations = documented("covariance");
    variations.truncate(2);
    for v in &mut variations {
        (v.scenario.runs, v.scenario.mission_s) = (24, Some(300.0));
        v.scenario.covariance.as_mut().unwrap().runs = 12;
    }
    let written = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::read(write_simulation(folder.path(), &flown(variations.clone(), threads)).unwrap()).unwrap()
    };
    let alone = written(1);
    assert_eq!(alone, written(2));
    assert_eq!(alone, written(5));
    assert_eq!(String::from_utf8(alone).unwrap().lines().count(), 1 + 24 * 5);
}

#[test]
fn over_a_store_tiles_are_counted_and_its_edge_is_felt() {
    let mut variations = documented("store");
    variations.retain(|v| ["base", "beyond the map, growing region"].contains(&v.name.as_str()));
    for v in &mut variations {
        v.scenario.runs = 30;
        v.scenario.store.as_mut().unwrap().path = Some(drawn_store().path().into());
    }
    let (found, _) = summarize(&flown(variations, 2));
    let within = find(&found, "base");
    let (adjusted, simulated) = (within.adjusted.unwrap(), &within.simulated);
    assert_eq!((simulated.no_map, simulated.outside_region), (0, 0));
    // (3) counts 1.8 images' worth, the tiles that meet the region are 7.1 of them.
    let read = simulated.nominal_count.unwrap();
    assert!(read > 3.0 * within.predicted.nominal_count.unwrap());
    assert!((read / adjusted.nominal_count - 1.0).abs() < 0.03, "{read} {adjusted:?}");
    assert!(!is_inside(within, "failures"));
    // 340 failures in 30 flights: four standard deviations are a fifth.
    assert!((simulated.failures / adjusted.failures.unwrap() - 1.0).abs() < 0.22, "{simulated:?}");
    let beyond = &find(&found, "beyond the map, growing region").simulated;
    assert!(beyond.no_map > 10 * beyond.drawn);
    assert!(beyond.failure_probability_after_failure.unwrap() > 1.5 * beyond.failure_probability.unwrap());
}

#[test]
fn the_commented_file_has_every_field() {
    let [base, faster] = &documented("commented")[..] else { panic!("two scenarios") };
    let s = &base.scenario;
    assert!(s.mission_s.is_some() && s.without_fix_s.is_some() && s.failures.probability.is_some());
    assert!(s.sequential.relative_count.is_some());
    let store = s.store.as_ref().unwrap();
    assert!(store.path.as_ref().unwrap().ends_with("docs/simulation/map.gpkg") && store.layer.is_some());
    assert_eq!(faster.scenario.aircraft.speed_mps, 60.0);
    // A field with a default may be missing unseen: all that the program knows are named.
    let text = std::fs::read_to_string(project("docs/simulation/commented.toml")).unwrap();
    let source = std::fs::read_to_string(project("crates/lab/src/trial/simulation/scenario.rs")).unwrap();
    let fields: Vec<&str> = source
        .lines()
        .filter_map(|line| line.strip_prefix("    pub ")?.split_once(": "))
        .map(|(name, _)| name)
        .filter(|name| !name.contains(' '))
        .collect();
    assert!(fields.len() > 40, "{fields:?}");
    for field in fields {
        let named = text.lines().any(|line| line.starts_with(&format!("{field} = ")) || line == format!("[{field}]"));
        assert!(named, "{field}");
    }
}

fn overfly(folder: &Path, words: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

const SMALL: &str = "modes = [\"sequential\", \"parallel\"]\nruns = 40\n[aircraft]\nspeed_mps = 27.8\nacross_m = 600\n\
    along_m = 600\n[errors]\ninaccuracy_m = 0\nunit_drift_m = 1\n[execution]\nrelative_s = 0.15\nseconds_per_tile = 0.05\n";

#[test]
fn the_command_writes_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), SMALL).unwrap();
    let (exit, said, log) = overfly(folder.path(), &["simulate", "s.toml", "--out", "out", "--json"]);
    assert_eq!(exit, Some(0), "{log}");
    let lines: Vec<Value> = said.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let [sequential, parallel, family] = &lines[..] else { panic!("{said}") };
    assert_eq!((&sequential["mode"], &parallel["mode"]), (&"sequential".into(), &"parallel".into()));
    assert_eq!(family["flights"], 80);
    assert!((sequential["predicted"]["failures"].as_f64().unwrap() - 1.0).abs() < 1e-3);
    let comparisons = lines[..2].iter().flat_map(|l| l["comparisons"].as_array().unwrap());
    assert_eq!(family["comparisons"], comparisons.count());
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    // The summary can be recomputed from the table.
    let csv = read("simulation.csv");
    let rows = csv.lines().skip(1).filter(|row| row.starts_with("base,sequential,"));
    let failures: Vec<f64> = rows.map(|row| row.split(',').nth(4).unwrap().parse().unwrap()).collect();
    let mean = failures.iter().sum::<f64>() / failures.len() as f64;
    assert!((mean - sequential["simulated"]["failures"].as_f64().unwrap()).abs() < 1e-12);
    assert!(read("summary.json").contains("confidence_each"));
    let page = read("simulation.html");
    assert!(page.contains("<svg") && page.contains("inside") && !page.contains("src=\"http") && !page.contains("NaN"));
    assert!(read("failures.svg").contains("<svg") && read("survival.svg").contains("<svg"));
}

#[test]
fn what_is_no_simulation_is_refused_by_file_and_field() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("s.toml", SMALL);
    write("nan.toml", &SMALL.replace("27.8", "nan"));
    write("more.toml", &format!("speed_kmh = 3\n{SMALL}"));
    write("slow.toml", &SMALL.replace("0.05", "500"));
    write("still.toml", &SMALL.replace("unit_drift_m = 1", "unit_drift_m = 0"));
    write("long.toml", &format!("mission_s = 1e9\n{}", SMALL.replace("runs = 40", "runs = 1000000")));
    let placed = SMALL.replace("[aircraft]", "[aircraft]\nmin_turn_radius_m = 300");
    write("stored.toml", &format!("{placed}[store]\n"));
    write("nowhere.toml", &format!("{placed}[store]\npath = \"none.gpkg\"\n"));
    let cases: [(&[&str], &str, &str); 11] = [
        (&["none.toml"], "unreadable", "none.toml"),
        (&["nan.toml"], "not_a_simulation", "aircraft.speed_mps"),
        (&["more.toml"], "not_a_simulation", "speed_kmh"),
        (&["slow.toml"], "not_a_simulation", "sequential.relative_count"),
        (&["still.toml"], "not_a_simulation", "sequential.relative_count"),
        (&["long.toml"], "not_a_simulation", "runs"),
        (&["stored.toml"], "not_a_simulation", "--db"),
        (&["nowhere.toml"], "store_not_found", "none.gpkg"),
        (&["s.toml", "--db", "none.gpkg"], "usage", "[store]"),
        (&["s.toml", "--mode", "all"], "usage", "--mode"),
        (&["s.toml", "--flight", "somewhere"], "usage", "--flight"),
    ];
    for (words, code, named) in cases {
        let (exit, _, said) = overfly(folder.path(), &[&["simulate"], words].concat());
        assert_eq!(exit, Some(2), "{words:?}: {said}");
        assert!(said.contains(&format!("error[{code}]")) && said.contains(named), "{words:?}: {said}");
    }
    let (exit, _, said) = overfly(folder.path(), &["fly", "--flight", "somewhere"]);
    assert!(exit == Some(2) && said.contains("--db"), "{said}");
}
