//! Injures copies of an exported store, one bit, one end, or two pages at a time, and counts the results of `verify`
//! and of the onboard service: no injury may be missed, none may crash, no answer may be wrong. The long form of the
//! tests' injuries.
//!
//! ```sh
//! cargo run --release -p overfly-testkit --example injure_store -- flight.gpkg --flips 20000 --truncations 1000 --swaps 1000
//! ```

use clap::Parser;
use overfly_testkit::injury::SoundStore;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Parser)]
struct Args {
    /// An exported store; only copies of it are injured.
    store: PathBuf,
    /// Flipped bits.
    #[arg(long, default_value_t = 20_000)]
    flips: usize,
    /// Truncations.
    #[arg(long, default_value_t = 1_000)]
    truncations: usize,
    /// Swapped pairs of pages.
    #[arg(long, default_value_t = 1_000)]
    swaps: usize,
    /// Seed of bits, ends and pages.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sound = SoundStore::read(&args.store);
    let copy = folder.path().join("injured.gpkg");
    let mut failures = 0;
    for (kind, flips, truncations, swaps) in
        [("flips", args.flips, 0, 0), ("truncations", 0, args.truncations, 0), ("swaps", 0, 0, args.swaps)]
    {
        let injuries = sound.injuries(flips, truncations, swaps, args.seed);
        let mut done = 0;
        let tally = sound.endure(&copy, &injuries, |_, _| {
            done += 1;
            if done % 500 == 0 {
                eprintln!("{kind}: {done}");
            }
        });
        let (refused, degraded) = (tally.refused_onboard, tally.degraded);
        println!(
            "{kind}: {} injuries; verify: {} not good (3), {} no store (2); onboard: {refused} refused, {degraded} degraded; {} failures",
            tally.injuries,
            tally.not_good,
            tally.no_store,
            tally.failures.len()
        );
        tally.failures.iter().take(20).for_each(|f| println!("  {f}"));
        failures += tally.failures.len();
    }
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
