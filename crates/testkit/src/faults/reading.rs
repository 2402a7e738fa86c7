//! Commands that only read a store, under bad reads: the usual answer or an error; never another answer.

use super::bench::{FaultBench, text};
use super::shim::{FaultKind, InjectedFault, ShimReport};
use super::tally::spread;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A command that reads the store `target.gpkg` of the work folder.
pub struct ReadOperation {
    pub name: &'static str,
    pub store: PathBuf,
    pub arguments: Vec<OsString>,
    /// The keys of the JSON answer whose values must stay the same.
    pub same: &'static [&'static str],
}

/// The results of bad reads.
#[derive(Debug, Default)]
pub struct ReadTally {
    pub points: u64,
    pub tried: u64,
    /// Runs with the undisturbed answer.
    pub answered: u64,
    /// Runs with an error: an exit code and a reason.
    pub refused: u64,
    pub failures: Vec<String>,
}

/// The commands for a store of the drawn landscape and an export of it.
pub fn readings(built: &Path, exported: &Path, project: &Path) -> Vec<ReadOperation> {
    let row = |name, store: &Path, words: &[&str], same| ReadOperation {
        name,
        store: store.into(),
        arguments: words.iter().map(Into::into).collect(),
        same,
    };
    let tile = |name: &str| project.join("tiles/flight").join(name).to_str().expect("the path is UTF-8").to_owned();
    let (frame, camera) = (tile("frames/019.jpg"), tile("camera.toml"));
    let fix = "fix --db {}/target.gpkg --latitude-deg 48.4915 --longitude-deg 15.6160 --sigma-m 200 --heading-deg 271.6 \
               --height-m 500.4 --pitch-deg 1.17 --roll-deg 0 --image";
    let fix: Vec<&str> = fix.split_whitespace().chain([frame.as_str(), "--camera", camera.as_str()]).collect();
    let position = &["latitude_deg", "longitude_deg", "heading_deg"];
    vec![
        row("verify, a built store", built, &["verify", "{}/target.gpkg"], &["digest", "ok"]),
        row("verify, an exported store", exported, &["verify", "{}/target.gpkg"], &["digest", "ok"]),
        row("fix, a built store", built, &fix, position),
    ]
}

impl ReadTally {
    /// Injects at most `most` bad reads of a kind, evenly spread.
    pub fn run(bench: &FaultBench, reading: &ReadOperation, kind: FaultKind, most: u64, seed: u64) -> Self {
        bench.lay_out(&[("target.gpkg", reading.store.clone())].into());
        let (output, report) = bench.disturb(&reading.arguments, InjectedFault { kind, at: 0 });
        let points = kind.points(&report.counts);
        assert!(output.status.success() && points > 0, "{} of {points} points: {}", reading.name, text(&output));
        let sound = answer(reading, &output);
        assert!(sound.iter().all(|v| !v.is_null()), "{}: {}", reading.name, text(&output));
        let mut tally = Self { points, ..Self::default() };
        for at in spread(points, most, seed) {
            let (output, ShimReport { fired, .. }) = bench.disturb(&reading.arguments, InjectedFault { kind, at });
            tally.tried += u64::from(fired.is_some());
            let said = text(&output);
            let mut wrong = |what: &str| {
                let met = fired.as_deref().unwrap_or("no call");
                tally.failures.push(format!("{}, {kind:?} at {at} ({met}): {what}\n  {said}", reading.name));
            };
            match output.status.code() {
                _ if said.contains("panicked") => wrong("it panics"),
                Some(0) if answer(reading, &output) == sound => tally.answered += 1,
                Some(0) => wrong("another answer"),
                Some(1..=3) if kind == FaultKind::Short => wrong("a short read is no fault"),
                // An error that names the file, no fix, or a verdict.
                Some(1..=3) if ["target.gpkg", "\"reason\"", "\"ok\":false"].iter().any(|w| said.contains(w)) => {
                    tally.refused += 1;
                }
                Some(1..=3) => wrong("it does not name the file"),
                _ => wrong("no exit code"),
            }
        }
        tally
    }
}

/// The parts of the last line of output that must stay the same.
fn answer(reading: &ReadOperation, output: &std::process::Output) -> Vec<serde_json::Value> {
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let json: serde_json::Value = said.lines().last().and_then(|l| serde_json::from_str(l).ok()).unwrap_or_default();
    reading.same.iter().map(|key| json[key].clone()).collect()
}
