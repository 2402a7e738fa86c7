//! `FaultTally`: many faults on one operation, and their results.

use super::bench::{FaultBench, TargetState, Undisturbed};
use super::operation::WriteOperation;
use super::shim::{FaultKind, InjectedFault};
use std::collections::BTreeMap;

/// The results of faults of one kind on one operation.
#[derive(Debug, Default)]
pub struct FaultTally {
    /// Calls that could meet the fault.
    pub points: u64,
    /// Faults that were met.
    pub tried: u64,
    /// Faults that were due after the end of the run: the number of calls varies a little from run to run.
    pub late: u64,
    /// The states of the target.
    pub ends: BTreeMap<TargetState, u64>,
    /// What is wrong with the program.
    pub failures: Vec<String>,
}

impl FaultTally {
    /// Injects at most `most` faults of a kind, evenly spread over all points.
    pub fn run(
        bench: &FaultBench,
        operation: &WriteOperation,
        expected: &Undisturbed,
        kind: FaultKind,
        most: u64,
        seed: u64,
    ) -> Self {
        let points = kind.points(&expected.counts);
        assert!(points > 0, "{}: no call can meet {kind:?}; does something go around the layer?", operation.name);
        let mut tally = Self { points, ..Self::default() };
        for at in spread(points, most, seed) {
            match bench.endure(operation, expected, InjectedFault { kind, at }) {
                Ok((end, true)) => {
                    tally.tried += 1;
                    *tally.ends.entry(end).or_default() += 1;
                }
                Ok((_, false)) => tally.late += 1,
                Err(failure) => {
                    tally.tried += 1;
                    tally.failures.push(failure);
                }
            }
        }
        tally
    }

    /// Number of runs after which the target had this state.
    pub fn ended(&self, end: TargetState) -> u64 {
        self.ends.get(&end).copied().unwrap_or(0)
    }
}

/// Chooses at most `most` of `1..=points`: the last few, where a target gets its name, and the others evenly, from a
/// start that `seed` chooses.
pub fn spread(points: u64, most: u64, seed: u64) -> Vec<u64> {
    if most >= points {
        return (1..=points).collect();
    }
    let last = (most / 3).min(3);
    let step = (points - last) as f64 / (most - last) as f64;
    let start = (seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64 / f64::from(1 << 24);
    let evenly = (0..most - last).map(|i| ((i as f64 + start) * step) as u64 + 1);
    evenly.chain(points - last + 1..=points).collect()
}
