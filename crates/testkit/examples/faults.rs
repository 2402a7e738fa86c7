//! Injects faults into everything that writes a store, at every call or at many, and counts the states of the target
//! after each: absent, old or new, always valid. Then runs the same command again, which must give the undisturbed
//! result. The long form of the tests' faults.
//!
//! ```sh
//! cargo build --release && cargo run --release -p overfly-testkit --example faults -- --kills 500 --full 200 --io 200
//! ```

use overfly_testkit::drawn;

use clap::Parser;
use overfly_ingest::export::{ExportRequest, export};
use overfly_ingest::plan::parse_routes;
use overfly_testkit::faults::bench::{FaultBench, TargetState};
use overfly_testkit::faults::operations::operations;
use overfly_testkit::faults::reading::{ReadTally, readings};
use overfly_testkit::faults::serving::ServiceReads;
use overfly_testkit::faults::shim::FaultKind;
use overfly_testkit::faults::tally::FaultTally;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Parser)]
struct Args {
    /// The program [default: beside this one, as cargo puts it]
    #[arg(long)]
    overfly: Option<PathBuf>,
    /// Kills, over all operations: before calls, amid writes, with what was not synced lost.
    #[arg(long, default_value_t = 500)]
    kills: u64,
    /// Full disks.
    #[arg(long, default_value_t = 200)]
    full: u64,
    /// Failing disks, short reads and writes, early ends of files.
    #[arg(long, default_value_t = 200)]
    io: u64,
    /// Bad reads while a store is verified, searched, or served onboard.
    #[arg(long, default_value_t = 200)]
    reads: u64,
    /// Only operations whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Seed of the points.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let beside = || std::env::current_exe().expect("this program's place").with_file_name("../overfly");
    let overfly = args.overfly.clone().unwrap_or_else(beside);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bench = match FaultBench::new(&overfly, folder.path()) {
        Ok(bench) => bench,
        Err(reason) => {
            eprintln!("no fault can be injected: {reason}");
            return ExitCode::FAILURE;
        }
    };
    let operations: Vec<_> =
        operations(&bench, folder.path()).into_iter().filter(|o| o.name.contains(&args.only)).collect();
    println!(
        "{:<28} {:<9} {:>6} {:>6} {:>7} {:>5} {:>11} {:>5} {:>8}",
        "operation", "fault", "points", "tried", "absent", "old", "unfinished", "new", "failures"
    );
    let mut failures = Vec::new();
    for operation in &operations {
        let expected = bench.undisturbed(operation);
        for (kinds, all) in
            [(&FaultKind::KILLS[..], args.kills), (&FaultKind::FULL, args.full), (&FaultKind::IO, args.io)]
        {
            let most = all.div_ceil((kinds.len() * operations.len()) as u64);
            for &kind in kinds {
                let tally = FaultTally::run(&bench, operation, &expected, kind, most, args.seed);
                print_row(operation.name, kind, &tally);
                failures.extend(tally.failures);
            }
        }
    }
    failures.extend(read(&bench, folder.path(), &args));
    failures.iter().for_each(|f| println!("{f}"));
    if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Injects bad reads; returns what is wrong with the program.
fn read(bench: &FaultBench, folder: &Path, args: &Args) -> Vec<String> {
    let store = drawn::drawn_store();
    let exported = folder.join("to read.gpkg");
    let line = r#"{"type": "LineString", "coordinates": [[15.6120, 48.4915], [15.6160, 48.4915]]}"#;
    let request = ExportRequest::along(parse_routes(line).expect("a route"), 200.0);
    export(store, &request, &exported, &|_, _| ()).expect("an export");
    println!(
        "{:<28} {:<9} {:>6} {:>6} {:>8} {:>8} {:>8}",
        "reading", "fault", "points", "tried", "answered", "refused", "failures"
    );
    let readings: Vec<_> = readings(store.path(), &exported, &drawn::project(""))
        .into_iter()
        .filter(|r| r.name.contains(&args.only))
        .collect();
    let most = args.reads.div_ceil((FaultKind::IO.len() * (readings.len() + 1)) as u64);
    let mut failures = Vec::new();
    let mut told = |name: &str, kind: FaultKind, tally: ReadTally| {
        let ReadTally { points, tried, answered, refused, .. } = tally;
        println!(
            "{name:<28} {:<9} {points:>6} {tried:>6} {answered:>8} {refused:>8} {:>8}",
            format!("{kind:?}"),
            tally.failures.len()
        );
        failures.extend(tally.failures);
    };
    for reading in &readings {
        FaultKind::IO
            .into_iter()
            .for_each(|k| told(reading.name, k, ReadTally::run(bench, reading, k, most, args.seed)));
    }
    if "serve, onboard".contains(&args.only) {
        let serving = ServiceReads::new(bench, &exported, &drawn::project("tiles/flight/frames/019.jpg"));
        FaultKind::IO.into_iter().for_each(|k| told("serve, onboard", k, serving.tally(bench, k, most, args.seed)));
    }
    failures
}

fn print_row(operation: &str, kind: FaultKind, tally: &FaultTally) {
    println!(
        "{operation:<28} {:<9} {:>6} {:>6} {:>7} {:>5} {:>11} {:>5} {:>8}",
        format!("{kind:?}"),
        tally.points,
        tally.tried,
        tally.ended(TargetState::Absent),
        tally.ended(TargetState::Old),
        tally.ended(TargetState::Unfinished),
        tally.ended(TargetState::New),
        tally.failures.len()
    );
}
