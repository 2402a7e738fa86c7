//! `overfly evaluate negatives`: measures the rate of false fixes.

use super::trial_args::SensorArgs;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::default_right_m;
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::{positive, positive_metres, share};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use crate::server::dto::AnswerJson;
use overfly_core::integrity::DEFAULT_INTEGRITY_RISK;
use overfly_lab::report::calibration_svg;
use overfly_lab::trial::{
    NegativeKind, NegativeOutcome, NegativeScore, NegativeTrial, PatternKind, ProbabilityBin, RecordedFlight,
    write_negatives,
};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
Every trial is a search that must end without a fix, or with one at the frame's true place; any other fix is false. The kinds:
  elsewhere  a real frame, searched for in a region (grown by the frame's reach) that does not contain it
  mirrored   left and right exchanged, as over a mirrored map
  turned     rotated by 90, 180 or 270 degrees, with the unrotated heading as prior
  noise      white or smoothed          water    faint ripples
  blank      one value, a gradient, a vignette
  fields     stripes, chequers, crop rows, repeating parcels
  scaled     magnified 1.3 to 1.6 times, with the true height as prior
  foreign    frames of another place, given with --foreign-flight
Ground that repeats itself on the map and in the frame, with other noise, brightness and defects in each (a fix within --right-m of
the truth counts as right, any other as false; a false one whose own 99.99 % ellipse holds the truth is at the right place and vague):
  repeating         one of 13 patterns over the whole map
  repeating_mixed   the same, mixed with 25 or 50 % of the real image
  repeating_block   blocks of pattern in real surroundings        repeating_inside  frames wholly within a block
  repeating_gaps    many elements missing, other ones on the map than in the frame
  repeating_absent  the frame's place shows other ground on the map, or lies outside the region: every fix is false

Regions are given as areas in usual squares (twice --prior-error-m wide). A layer smaller than a region is searched as a whole;
searched_ratio is the area searched. If `elsewhere` has no room, its trials are skipped and counted.

If n trials accept no fix, the rate is below 3 / n with 95 % confidence. Calibration: each answer states how many matches as good as its
best place are expected by chance (log10_false_alarms); of n trials, at most n * 10^x may state less than 10^x. `scaled` and the
repeating kinds are left out of the calibration, because what agrees there agrees not by chance. Over the repeating kinds the stated
false_fix_probability of the best place, accepted or not, stands beside the share of such places that is wrong.

With --json: one line per accepted trial, then the summary. Exit code 0 whatever was accepted.

Example:
  overfly evaluate negatives --db map.gpkg --flight flights/0716 --trials 20000 --out scored";

/// Arguments of `evaluate negatives`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    over: FlightOverStore,
    /// A flight over another place, for trials of the kind `foreign`.
    #[arg(long, value_name = "DIR")]
    foreign_flight: Option<PathBuf>,
    /// Number of trials, spread evenly over kinds and regions.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    trials: usize,
    /// Seed: equal seeds give equal trials.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Half width of the usual square, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 500.0)]
    prior_error_m: f64,
    /// Areas to search, in usual squares.
    #[arg(long, value_name = "RATIO,...", value_parser = positive, value_delimiter = ',', default_values_t = [1.0, 10.0, 100.0])]
    regions: Vec<f64>,
    /// Kinds of trials [default: all; foreign only with --foreign-flight].
    #[arg(long, value_name = "KIND,...", value_delimiter = ',')]
    kinds: Option<Vec<NegativeKind>>,
    /// Share of the trials without a heading prior (`turned` always has one).
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.5)]
    unknown_heading_share: f64,
    /// Greatest error of a right fix over repeating ground, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    right_m: Option<f64>,
    #[command(flatten)]
    sensors: SensorArgs,
    /// Trials that run at the same time; each search uses one thread.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write negatives.csv (one row per trial) and calibration.svg here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// An accepted trial as a JSON line.
#[derive(Serialize)]
struct AcceptedLine<'a> {
    trial: usize,
    kind: NegativeKind,
    region: f64,
    image: &'a str,
    pattern: Option<PatternKind>,
    period_m: Option<f64>,
    error_m: Option<f64>,
    heading_known: bool,
    #[serde(flatten)]
    answer: AnswerJson,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (flight, store) = args.over.open(output)?;
    let foreign = args.foreign_flight.as_deref().map(RecordedFlight::read).transpose()?;
    let layer = args.over.layer(&store)?;
    let trial = NegativeTrial {
        layer: layer.name.clone(),
        trials: args.trials,
        seed: args.seed,
        prior_error_m: args.prior_error_m,
        regions: args.regions.clone(),
        kinds: args.kinds.clone().unwrap_or_else(|| NegativeKind::ALL.to_vec()),
        unknown_heading_share: args.unknown_heading_share,
        heading_sigma_deg: args.sensors.heading_sigma_deg,
        height_sigma_ratio: args.sensors.height_sigma_ratio,
        right_m: match args.right_m {
            Some(right_m) => right_m,
            None => default_right_m(&store, layer)?,
        },
        threads: args.threads.get(),
    };
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let bar = output.progress(args.trials as u64, "trials");
    let outcomes = trial.run(&store, &flight, foreign.as_ref(), |_| bar.inc(1))?;
    bar.finish_and_clear();
    let score = NegativeScore::from_outcomes(&outcomes, args.threads.get());
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_negatives(folder, &outcomes)?.display()));
        output.write(&folder.join("calibration.svg"), calibration_svg(&score).as_bytes())?;
    }
    if output.is_json() {
        outcomes.iter().filter_map(accepted_line).for_each(|line| output.say(&line, String::new));
    }
    output.say(&score, || text(&score));
    Ok(Exit::Done)
}

fn accepted_line(outcome: &NegativeOutcome) -> Option<AcceptedLine<'_>> {
    let search = outcome.search.as_ref()?;
    outcome.is_accepted().then_some(AcceptedLine {
        trial: outcome.number,
        kind: outcome.kind,
        region: outcome.region,
        image: &outcome.image,
        pattern: outcome.pattern.map(|p| p.kind),
        period_m: outcome.pattern.map(|p| p.period_m),
        error_m: outcome.error_m(),
        heading_known: outcome.is_heading_known,
        answer: AnswerJson::new(search.answer.clone(), search.elapsed_ms, DEFAULT_INTEGRITY_RISK),
    })
}

/// The score as text.
fn text(score: &NegativeScore) -> String {
    let mut text = format!(
        "trials     {} ({} skipped)\naccepted   {} (false fixes), {} of them outside their own 99.99 % ellipse\nright      {} (fixes at the true place)\n\
         rate       below {:.1e} with 95 % confidence\n\n  \
         kind               area  trials  skipped  right  accepted  rate below   least log10\n",
        score.trials, score.skipped, score.accepted, score.outside, score.right, score.false_rate_upper95
    );
    for k in &score.by_kind {
        let least = k.least_log10_false_alarms.map_or("-".into(), |l| format!("{l:.1}"));
        text.push_str(&format!(
            "  {:<16} {:>6} {:>7} {:>8} {:>6} {:>9} {:>11.1e} {:>13}\n",
            k.kind.word(),
            k.region,
            k.trials,
            k.skipped,
            k.right,
            k.accepted,
            k.false_rate_upper95,
            least
        ));
    }
    if !score.by_pattern.is_empty() {
        text.push_str("\n  pattern       trials  right  accepted  rate below\n");
    }
    for p in &score.by_pattern {
        text.push_str(&format!(
            "  {:<12} {:>7} {:>6} {:>9} {:>11.1e}\n",
            p.pattern.word(),
            p.trials,
            p.right,
            p.accepted,
            p.false_rate_upper95
        ));
    }
    for r in &score.by_region {
        let searched = r.searched_ratio.map_or("nothing".into(), |s| format!("{:.1} (at most {:.1})", s.median, s.max));
        text.push_str(&format!(
            "\narea {}: {} accepted of {}, rate below {:.1e}; map searched {searched} usual squares, median\n  \
             stated below  observed  expected at most\n",
            r.region, r.accepted, r.trials, r.false_rate_upper95
        ));
        for c in &r.calibration {
            let verdict = if c.is_kept { "" } else { "  too many" };
            text.push_str(&format!(
                "  10^{:<10} {:>8} {:>16.2}{verdict}\n",
                c.log10_false_alarms, c.observed, c.expected
            ));
        }
    }
    text.push_str(&probabilities(&score.probabilities));
    text.trim_end().to_owned()
}

/// Stated beside observed probabilities of wrong best places, as text; nothing where none was compared with rivals.
fn probabilities(bins: &[ProbabilityBin]) -> String {
    if bins.iter().all(|b| b.searches == 0) {
        return String::new();
    }
    let mut text = "\nrepeating ground: the best place, accepted or not\n  \
                    states a wrong place with  searches  wrong  stated mean  observed, 95 % bounds\n"
        .to_owned();
    for b in bins {
        let verdict = if b.is_kept { "" } else { "  too low" };
        let range = format!("{:.1e} to {:.1e}", b.above, b.up_to);
        text.push_str(&format!(
            "  {range:<25} {:>9} {:>6} {:>12.1e}  {:.1e} to {:.1e}{verdict}\n",
            b.searches, b.wrong, b.stated_mean, b.rate_lower95, b.rate_upper95
        ));
    }
    text
}
