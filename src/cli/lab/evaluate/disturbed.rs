//! `overfly evaluate fixes --disturb`: disturbed frames scored by kind.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_lab::trial::{
    DisturbanceKind, DisturbanceScore, DisturbedKindScore, DisturbedTrial, FixTrial, RecordedFlight, write_disturbed,
};
use overfly_store::Reader;
use std::path::Path;

/// The kinds of disturbances that the command line names.
#[derive(Debug, Clone)]
pub struct DisturbanceKinds(Vec<DisturbanceKind>);

impl std::str::FromStr for DisturbanceKinds {
    type Err = String;

    fn from_str(words: &str) -> Result<Self, Self::Err> {
        if words == "all" {
            return Ok(Self(DisturbanceKind::ALL.to_vec()));
        }
        words.split(',').map(str::parse).collect::<Result<_, _>>().map(Self)
    }
}

/// Locates the disturbed frames, writes disturbed.csv where a folder is given, and prints the table by kind.
///
/// # Errors
/// If the trial fails.
pub fn run(
    fixes: FixTrial,
    kinds: &DisturbanceKinds,
    frames: usize,
    (store, flight): (&Reader, &RecordedFlight),
    (right_m, out): (f64, Option<&Path>),
    output: &Output,
) -> Result<(), Failure> {
    let trial = DisturbedTrial { fixes, kinds: kinds.0.clone(), frames };
    let bar = output.progress((trial.kinds.len() * frames) as u64, "frames");
    let outcomes = trial.run(store, flight, || bar.inc(1))?;
    bar.finish_and_clear();
    if let Some(folder) = out {
        output.note(&format!("wrote {}", write_disturbed(folder, &outcomes)?.display()));
    }
    let score = DisturbanceScore::from_outcomes(&outcomes, &trial.kinds, right_m);
    output.say(&score, || text(&score));
    Ok(())
}

fn text(score: &DisturbanceScore) -> String {
    let header = format!(
        "right: image's centre within {:.2} m or inside its own 99.99 % ellipse; outside: of their own 99.9 % ellipse\n\
         {:<16} {:>6} {:>5} {:>5} {:>5}  {:>13} {:>14}  {:>26}",
        score.right_m,
        "kind",
        "frames",
        "fixes",
        "right",
        "false",
        "outside nadir",
        "outside centre",
        "half axis m nadir, centre"
    );
    let rows = score.by_kind.iter().chain([&score.total]).map(row);
    std::iter::once(header).chain(rows).collect::<Vec<_>>().join("\n")
}

fn row(score: &DisturbedKindScore) -> String {
    let metres = |m: Option<f64>| m.map_or("-".into(), |m| format!("{m:.1}"));
    format!(
        "{:<16} {:>6} {:>5} {:>5} {:>5}  {:>13} {:>14}  {:>16} {:>9}",
        score.kind.map_or("all", DisturbanceKind::word),
        score.frames,
        score.fixes,
        score.right,
        score.wrong,
        score.outside999_nadir,
        score.outside999_centre,
        metres(score.semi_major_999_nadir_m),
        metres(score.semi_major_999_centre_m),
    )
}
