//! A soak: `overfly serve --onboard` under mixed requests with faults, with every answer checked and its memory
//! measured.
//!
//! ```sh
//! cargo build --release && cargo run --release -p overfly-testkit --example soak -- --requests 200000 --db small.gpkg
//! cargo run --release -p overfly-testkit --example soak -- --requests 10000 --db big.gpkg --in-place --memory 128MB
//! ```
//!
//! The store must contain the landscape of `tiles/` (`big_store` makes such a store). A copy of it is served; some of
//! its tiles rot meanwhile, and at the end it is removed, replaced, truncated and made unreadable under the service.
//! `--in-place` serves the store itself without faults.

use clap::Parser;
use overfly_testkit::soak::client::ServedStore;
use overfly_testkit::soak::fault::{FAULTS, endure};
use overfly_testkit::soak::question::{QuestionCounts, Questions};
use overfly_testkit::soak::{SoakPlan, SoakResult, soak};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Soaks the service.
#[derive(Parser)]
struct Args {
    /// The store.
    #[arg(long)]
    db: PathBuf,
    /// Requests in all.
    #[arg(long, default_value_t = 200_000)]
    requests: u64,
    /// Connections at once.
    #[arg(long, default_value_t = 4)]
    connections: u64,
    /// The service's `--memory`.
    #[arg(long, default_value = "128MB")]
    memory: String,
    /// The program; beside this one's folder by default.
    #[arg(long)]
    program: Option<PathBuf>,
    /// Serve the store itself, without rot and faults of its file.
    #[arg(long)]
    in_place: bool,
    /// Seed of the requests.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> anyhow::Result<ExitCode> {
    let args = Args::parse();
    let beside = std::env::current_exe()?.parent().and_then(Path::parent).map(|p| p.join("overfly"));
    let program = args.program.clone().or(beside).unwrap_or_else(|| "overfly".into());
    let folder = tempfile::tempdir()?;
    let questions = Questions::new(&args.db, QuestionCounts { tiles: 400, candidates: 400, fixes: 40 }, args.seed);
    let copy = folder.path().join("served.gpkg");
    let db = if args.in_place { &args.db } else { &copy };
    if !args.in_place {
        std::fs::copy(&args.db, &copy)?;
    }
    let start = || {
        let arguments = ["--memory".to_owned(), args.memory.clone()];
        ServedStore::start(&program, db, &arguments, &folder.path().join("log"))
    };
    let since = Instant::now();
    let mut serving = start().map_err(anyhow::Error::msg)?;
    let rotting = (!args.in_place).then_some((copy.as_path(), args.db.as_path()));
    let plan = SoakPlan {
        requests: args.requests,
        connections: args.connections,
        seed: args.seed,
        rotting,
        spares_landscape: true,
    };
    let soaked = soak(&mut serving, &questions, &plan);
    drop(serving);
    let mut wrong = show(&soaked, since);
    if !args.in_place {
        for fault in FAULTS {
            std::fs::copy(&args.db, &copy)?;
            let (asked, found) = endure(fault, &args.db, &copy, &questions, &start);
            println!("{fault:?} while serving: {asked} requests, {} wrong", found.len());
            found.iter().for_each(|w| println!("  {w}"));
            wrong += found.len();
        }
    }
    Ok(if wrong == 0 && soaked.lives { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Prints the results; returns the number of wrong answers.
fn show(soaked: &SoakResult, since: Instant) -> usize {
    let SoakResult { tally, readings, lives } = soaked;
    println!(
        "{:>14} {:>8} {:>8} {:>7} {:>6} {:>9} {:>8}",
        "request", "asked", "right", "found", "busy", "too much", "damaged"
    );
    for (kind, c) in &tally.counts {
        let (asked, right, found) = (c.asked, c.right, c.found);
        println!("{kind:>14} {asked:>8} {right:>8} {found:>7} {:>6} {:>9} {:>8}", c.busy, c.too_much, c.damaged);
    }
    let elapsed_s = since.elapsed().as_secs_f64();
    println!(
        "{} requests in {elapsed_s:.0} s, {} wrong, {}",
        tally.asked(),
        tally.wrong.len(),
        if *lives { "alive" } else { "CRASHED" }
    );
    tally.wrong.iter().take(20).for_each(|w| println!("  {w}"));
    for r in readings {
        println!(
            "after {:>7}: resident {:.1} MB (on average since the last reading {:.1} MB), at most {:.1} MB",
            r.asked,
            r.resident_kb as f64 / 1e3,
            r.mean_resident_kb as f64 / 1e3,
            r.most_resident_kb as f64 / 1e3
        );
    }
    tally.wrong.len()
}
