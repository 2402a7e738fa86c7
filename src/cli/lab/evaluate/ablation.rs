//! `overfly evaluate ablation`: what each part of the method brings.

use super::trial_args::{Opened, TrialArgs};
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_flight::locate::{Part, Parts};
use overfly_lab::trial::{FixScore, FixTrial};
use serde::Serialize;

const HELP: &str = "\
The flight is located once with the whole method, and once more without each of its parts. Parts:
  soft_vote       windows vote for all places, by how well they fit there; without: each for the one place where it fits best
  small_windows   windows of 6 px vote; without: those of 10 px, which measure
  window_weights  windows that find the same wrong places have less weight; without: all count alike
  tilt            the vote elects pitch and roll; without: both are as stated until the camera is measured
  whole_view      the whole view must stand out too; without: the windows are enough
  rival_votes     a rival that its windows do not tell from chance is none; without: the pixels alone decide
  near_rivals     a rival within a place's own ellipse widens it; without: it makes the place ambiguous
  terrain         frames are laid on the store's terrain, where it has one; without: on a plane

Example:
  overfly evaluate ablation --db town.gpkg --flight town/flight --prior-error-m 100 --right-m 20 --truth centre --attitude-sigma-deg 8";

/// Arguments of `evaluate ablation`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    trial: TrialArgs,
}

/// One row of the table.
#[derive(Serialize)]
struct Row {
    /// What was left out; `null`: nothing.
    without: Option<&'static str>,
    #[serde(flatten)]
    score: FixScore,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let Opened { flight, store, trial, right_m } = args.trial.open(output)?;
    let left_out: Vec<Option<Part>> = std::iter::once(None).chain(Part::ALL.map(Some)).collect();
    let bar = output.progress((left_out.len() * flight.frames.len()) as u64, "frames");
    let mut rows = Vec::new();
    for part in left_out {
        let parts = part.map_or(Parts::ALL, Parts::without);
        let trial = FixTrial { parts, ..trial.clone() };
        let outcomes = trial.run(&store, &flight, |_| bar.inc(1))?;
        let score = FixScore::from_outcomes(&outcomes, right_m, trial.threads);
        let row = Row { without: part.map(name), score };
        if output.is_json() {
            output.say(&row, String::new);
        }
        rows.push(row);
    }
    bar.finish_and_clear();
    output.say(&serde_json::json!({ "rows": rows }), || table(&rows));
    Ok(Exit::Done)
}

fn name(part: Part) -> &'static str {
    match part {
        Part::SoftVote => "soft_vote",
        Part::SmallWindows => "small_windows",
        Part::WindowWeights => "window_weights",
        Part::Tilt => "tilt",
        Part::WholeView => "whole_view",
        Part::RivalVotes => "rival_votes",
        Part::NearRivals => "near_rivals",
        Part::Terrain => "terrain",
    }
}

fn table(rows: &[Row]) -> String {
    let mut text =
        String::from("without         frames  right  false  error_m median  95 %  ellipse %  elapsed_ms median\n");
    for Row { without, score } in rows {
        // Without a fix there is neither error nor ellipse.
        let shown =
            |value: Option<f64>, digits: usize| value.map_or("none".into(), |value| format!("{value:.digits$}"));
        let (median, p95) = (score.error_m.map(|error| error.median), score.error_m.map(|error| error.p95));
        text.push_str(&format!(
            "{:<14}  {:>6}  {:>5}  {:>5}  {:>14}  {:>4}  {:>9}  {:>17}\n",
            without.unwrap_or("nothing"),
            score.frames,
            score.right,
            score.wrong,
            shown(median, 2),
            shown(p95, 1),
            shown(score.ellipse95_coverage.map(|share| 100.0 * share), 1),
            shown(score.elapsed_ms.map(|elapsed| elapsed.median), 0),
        ));
    }
    text.truncate(text.trim_end().len());
    text
}
