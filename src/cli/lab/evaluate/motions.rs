//! `overfly evaluate motions`: scores relative registration.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::number::{positive, positive_metres};
use crate::cli::output::Output;
use overfly_core::registration::relative::MotionAnswer;
use overfly_lab::trial::{
    ImagePairs, Leg, LegScore, LegSensorSigmas, MirroredPairScore, MirroredPairTrial, MotionScore, Quantiles,
    RecordedFlight, RivalPairTrial, run_legs, run_motions, write_motions,
};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

const HELP: &str = "\
--pairs: a table image_a,image_b,overlap_percent,m00,m01,m02,m10,m11,m12 with the images beside it. The 2 x 3 matrix takes a point of
image b to image a, in pixels counted from the corner. Right: within 1 px at the image's centre.

--flight: a folder as for `evaluate fixes`. Every frame is registered against the previous one (a pause of five usual intervals ends a
run); the scale is compared with the ratio of heights, the displacement with the positions. Agrees: within three sigma of both.

--mirrored: views of these photos against mirrored views. They share no ground, so every accepted motion is false.

--rivals: pairs of known motion over ground that repeats itself (stripes, dots, checkers, orchards, solar rows and others, alone, mixed with
a photo, or as a block in it), copies of an image where the camera has moved, and overlays, dust and wings that stand still. A motion
that is off by more than 1 px is false.

Examples:
  overfly evaluate motions --rivals photos/*.jpg --trials 2000
  overfly evaluate motions --pairs pairs.csv --out scored
  overfly evaluate motions --flight flights/0716
  overfly evaluate motions --mirrored photos/*.jpg --trials 2000 --seed 1";

/// Arguments of `evaluate motions`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
#[command(group = clap::ArgGroup::new("what").required(true).args(["pairs", "flight", "mirrored", "rivals"]))]
pub struct Args {
    /// Pairs of known motion: the table.
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,
    /// Consecutive frames of a flight, compared with its sensors.
    #[arg(long, value_name = "DIR")]
    flight: Option<PathBuf>,
    /// Pairs that share no ground, cut from these photos.
    #[arg(long, value_name = "PHOTO", num_args = 1..)]
    mirrored: Vec<PathBuf>,
    /// Pairs that more than one motion seems to explain, made of these photos.
    #[arg(long, value_name = "PHOTO", num_args = 1..)]
    rivals: Vec<PathBuf>,
    /// Number of pairs, with --mirrored and --rivals.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    trials: usize,
    /// Seed of the views, with --mirrored and --rivals: equal seeds give equal views.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// One standard deviation of the flight's positions per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 2.0)]
    position_sigma_m: f64,
    /// One standard deviation of the flight's headings, degrees.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    heading_sigma_deg: f64,
    /// One standard deviation of the flight's heights, as a ratio.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// Pairs registered at the same time, with --pairs; more than one disturbs the measured times.
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::MIN)]
    threads: NonZeroUsize,
    /// Write motions.csv here, with --pairs: one row per pair.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    match (&args.pairs, &args.flight) {
        (Some(pairs), _) => on_pairs(args, pairs, output),
        (None, Some(flight)) => on_flight(args, flight, output),
        (None, None) if !args.rivals.is_empty() => on_rival_pairs(args, output),
        (None, None) => on_mirrored_pairs(args, output),
    }
}

fn on_pairs(args: &Args, pairs: &Path, output: &Output) -> Result<Exit, Failure> {
    let pairs = ImagePairs::read(pairs)?;
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let bar = output.progress(pairs.pairs.len() as u64, "pairs");
    let outcomes = run_motions(&pairs, args.threads.get(), || bar.inc(1))?;
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_motions(folder, &outcomes)?.display()));
    }
    let score = MotionScore::from_outcomes(&outcomes, args.threads.get());
    output.say(&score, || pairs_text(&score));
    Ok(Exit::Done)
}

fn pairs_text(score: &MotionScore) -> String {
    let mut text = format!(
        "pairs      {} ({} right, {} false, {} without a motion)\n\
         ellipse    {} of the right ones have the truth in their own 95 % ellipse\n  \
         overlap  right       drift px           elapsed ms\n",
        score.pairs,
        score.right,
        score.wrong,
        score.no_motion,
        score.ellipse95_coverage.map_or("none".into(), |c| format!("{:.0} %", 100.0 * c)),
    );
    for o in &score.by_overlap {
        let spread = |s: &Option<Quantiles>, digits: usize| {
            s.map_or("-".into(), |s| format!("{:.digits$} (95 % {:.digits$})", s.median, s.p95))
        };
        text.push_str(&format!(
            "  {:>5} %  {:>3} of {:<3}  {:<18} {}\n",
            o.overlap_percent,
            o.right,
            o.pairs,
            spread(&o.drift_px, 3),
            spread(&o.elapsed_ms, 0)
        ));
    }
    text.trim_end().to_owned()
}

fn on_flight(args: &Args, folder: &Path, output: &Output) -> Result<Exit, Failure> {
    let flight = RecordedFlight::read(folder)?;
    let sensors = LegSensorSigmas {
        position_m: args.position_sigma_m,
        heading_rad: args.heading_sigma_deg.to_radians(),
        height_ratio: args.height_sigma_ratio,
    };
    let legs = run_legs(&flight, &sensors, |leg| output.say(leg, || leg_text(leg)))?;
    let score = LegScore::from_legs(&legs);
    output.say(&score, || {
        format!(
            "legs       {} ({} registered, {} agree with the sensors)",
            score.legs, score.registered, score.agreeing
        )
    });
    Ok(Exit::Done)
}

fn leg_text(leg: &Leg) -> String {
    let (Some(m), MotionAnswer::Motion(motion)) = (&leg.measured, &leg.answer) else {
        return format!("{} to {}: no motion", leg.image_a, leg.image_b);
    };
    let ([east_m, north_m], [position_east_m, position_north_m]) = (m.displacement_m, m.position_displacement_m);
    format!(
        "{} to {}: {}\n  scale      {:.4}, heights {:.4}\n  \
         moved      {east_m:.1} m east, {north_m:.1} m north; positions {position_east_m:.1}, {position_north_m:.1}\n  \
         turned     {:.1} degrees, compass {:.1}",
        leg.image_a,
        leg.image_b,
        if m.agrees { "agrees" } else { "disagrees" },
        motion.scale,
        m.height_ratio,
        motion.rotation_deg,
        m.heading_change_deg,
    )
}

fn on_mirrored_pairs(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let trial = MirroredPairTrial { photos: args.mirrored.clone(), trials: args.trials, seed: args.seed };
    let bar = output.progress(trial.trials as u64, "pairs");
    let score = trial.run(|| bar.inc(1))?;
    bar.finish_and_clear();
    output.say(&score, || mirrored_pairs_text(&score));
    Ok(Exit::Done)
}

fn on_rival_pairs(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let trial = RivalPairTrial { photos: args.rivals.clone(), trials: args.trials, seed: args.seed };
    let bar = output.progress(trial.trials as u64, "pairs");
    let scores = trial.run(args.threads.get(), || bar.inc(1))?;
    bar.finish_and_clear();
    for score in &scores {
        output.say(score, || {
            format!(
                "{:<22} {:>6} pairs {:>6} right {:>4} false (with 95 % confidence below {:.2} %)",
                score.kind,
                score.pairs,
                score.right,
                score.wrong,
                100.0 * score.probability_below
            )
        });
    }
    Ok(Exit::Done)
}

fn mirrored_pairs_text(score: &MirroredPairScore) -> String {
    let mut text = format!(
        "pairs      {} that share no ground\nfalse      {} (with 95 % confidence below {:.2} % of such pairs)",
        score.trials,
        score.accepted,
        100.0 * score.probability_below
    );
    for pair in &score.accepted_pairs {
        text.push_str(&format!("\n  {pair}"));
    }
    text
}
