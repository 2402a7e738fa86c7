//! `overfly fly`: a flight replayed in a closed loop, in one coupling mode or all.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::default_right_m;
use crate::cli::lab::integrity_args::{IntegrityArgs, integrity_text};
use crate::cli::lab::mosaic::{finest_level, mosaic_of};
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::{any, metres, positive, positive_metres, share};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_core::coupling::Mode;
use overfly_core::tile::TILE_SIZE_PX;
use overfly_flight::navigate::{ExecutionTimes, NavigateOptions, SensorSigmas};
use overfly_lab::report::{Mosaic, ReplayedFlight, replay_html};
use overfly_lab::trial::{
    Disturbances, FlyOutcome, FlyScore, FlyTrial, Quantiles, ScaleSource, SequenceFault, SourceScore, write_positions,
};
use overfly_store::{Layer, Reader};
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
The true position (the true_ columns of flight.csv) starts the flight and scores it. In between, positions come only from the images,
the compass and the altimeter. Modes:
  sequential  --relative-count relative registrations, then an absolute one, for whose result the navigator waits
  parallel    both at once; the relative registrations made meanwhile carry the absolute result forward
  combined    only absolute registrations, each over all ground that can have been reached since the last
  auto        waits for an absolute registration if it ends before the next image is due, else runs it in parallel
For comparison, every mode stands beside dead reckoning: relative registrations alone, from the true start of each run between pauses,
without disturbances.

Execution times are --execution-s, or 0.05 s plus 0.001 s a tile; they are never measured, so a replay gives the same positions on every
machine. Disturbances for trials: --start-error-m, --blackout, --cloud, --heading-bias-deg, --disturb.

With --json: one object per mode. --out writes positions.csv, summary.json and the page report.html.

Example:
  overfly fly --db map.gpkg --flight flights/0716 --mode all --out flown";

/// Arguments of `fly`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    over: FlightOverStore,
    /// How to couple absolute and relative registration.
    #[arg(long, value_enum, default_value_t = ModeArg::Auto)]
    mode: ModeArg,
    /// n of the sequential mode: images between two absolute registrations.
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::new(5).expect("5 is not 0"))]
    relative_count: NonZeroUsize,
    /// One standard deviation of the compass, degrees, for its constant offset and for the noise of each reading.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    heading_sigma_deg: f64,
    /// One standard deviation of the height, as a ratio, for its constant offset and for the noise of each reading.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// One standard deviation of the start position per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 50.0)]
    start_sigma_m: f64,
    /// Initial ground speed, m/s; its standard deviation is half of it.
    #[arg(long, value_name = "MPS", value_parser = positive, default_value_t = 40.0)]
    speed_mps: f64,
    /// Smallest turn radius, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 500.0)]
    min_turn_radius_m: f64,
    /// Execution time of every absolute registration, seconds [default: 0.05 plus 0.001 a tile].
    #[arg(long, value_name = "S", value_parser = positive)]
    execution_s: Option<f64>,
    /// Execution time of a relative registration, seconds.
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 0.03)]
    relative_s: f64,
    /// Decide on each image alone, and not on tracks of several.
    #[arg(long)]
    without_tracks: bool,
    /// Error of the start position, metres, in a random direction.
    #[arg(long, value_name = "M", value_parser = metres, default_value_t = 0.0, help_heading = "Disturbances")]
    start_error_m: f64,
    /// Images FIRST to FIRST + COUNT - 1, counted from 0, are black.
    #[arg(long, value_name = "FIRST:COUNT", value_parser = blackout, help_heading = "Disturbances")]
    blackout: Option<(usize, usize)>,
    /// Share of the images that show only cloud.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.0, help_heading = "Disturbances")]
    cloud: f64,
    /// Offset of the compass, degrees.
    #[arg(long, value_name = "DEG", value_parser = any, default_value_t = 0.0, allow_negative_numbers = true, help_heading = "Disturbances")]
    heading_bias_deg: f64,
    /// A fault of camera, sensors or clock on a stretch of the flight; see `evaluate sequences`.
    #[arg(long, value_name = "FAULT", help_heading = "Disturbances")]
    disturb: Option<SequenceFault>,
    /// Seed of the disturbances.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Disturbances")]
    seed: u64,
    /// Greatest error that counts as right, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    right_m: Option<f64>,
    /// Threads of each registration.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    #[command(flatten)]
    integrity: IntegrityArgs,
    /// Write positions.csv, summary.json and report.html here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One mode, or all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ModeArg {
    Sequential,
    Parallel,
    Combined,
    Auto,
    All,
}

impl ModeArg {
    fn modes(self) -> Vec<Mode> {
        match self {
            Self::Sequential => vec![Mode::Sequential],
            Self::Parallel => vec![Mode::Parallel],
            Self::Combined => vec![Mode::Combined],
            Self::Auto => vec![Mode::Auto],
            Self::All => Mode::ALL.to_vec(),
        }
    }
}

/// `FIRST:COUNT`.
fn blackout(text: &str) -> Result<(usize, usize), String> {
    let parse = |t: &str| t.trim().parse::<usize>().ok();
    let found = text.split_once(':').and_then(|(first, count)| Some((parse(first)?, parse(count)?)));
    found.ok_or_else(|| "not two whole numbers".into())
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (flight, store) = args.over.open_with_absurd_rows(output)?;
    let layer = args.over.layer(&store)?;
    let right_m = args.right_m.map_or_else(|| default_right_m(&store, layer), Ok)?;
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let modes = args.mode.modes();
    let bar = output.progress((flight.frames.len() * (modes.len() + 1)) as u64, "images");
    let trial = FlyTrial { store: &store, flight: &flight, disturbances: args.disturbances() };
    let reckoned = trial.reckon(&args.options(&layer.name, Mode::RelativeOnly), |_| bar.inc(1))?;
    let title = format!("overfly: {} flown without GPS", args.over.flight.display());
    let mut flown: Vec<(Mode, Vec<FlyOutcome>)> = Vec::new();
    for mode in modes {
        flown.push((mode, trial.run(&args.options(&layer.name, mode), |_| bar.inc(1))?));
    }
    bar.finish_and_clear();
    let scores: Vec<FlyScore> =
        flown.iter().map(|(mode, outcomes)| args.score(*mode, outcomes, &reckoned, right_m)).collect();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_positions(folder, &flown, args.integrity.integrity_risk)?.display()));
        let summary = serde_json::to_vec_pretty(&scores).expect("plain numbers");
        output.write(&folder.join("summary.json"), &summary)?;
        if let Some(mosaic) = picture(&store, layer)? {
            let execution_times = args.execution_times();
            let modes: Vec<ReplayedFlight> = flown
                .iter()
                .zip(&scores)
                .map(|((_, outcomes), score)| {
                    let protected = FlyOutcome::protected_errors(outcomes, args.integrity.integrity_risk);
                    ReplayedFlight { outcomes, score, protected, execution_times }
                })
                .collect();
            output.write(&folder.join("report.html"), replay_html(&title, &mosaic, &modes).as_bytes())?;
        }
    }
    for score in &scores {
        output.say(score, || text(score));
    }
    Ok(Exit::Done)
}

impl Args {
    fn score(&self, mode: Mode, outcomes: &[FlyOutcome], reckoned: &[Vec<FlyOutcome>], right_m: f64) -> FlyScore {
        let integrity = self.integrity.score(&FlyOutcome::protected_errors(outcomes, self.integrity.integrity_risk));
        FlyScore { integrity, ..FlyScore::from_outcomes(mode, outcomes, reckoned, right_m) }
    }

    fn disturbances(&self) -> Disturbances {
        Disturbances {
            start_error_m: self.start_error_m,
            blackout: self.blackout,
            cloud_share: self.cloud,
            heading_bias_rad: self.heading_bias_deg.to_radians(),
            fault: self.disturb,
            seed: self.seed,
        }
    }

    fn execution_times(&self) -> ExecutionTimes {
        let stated = ExecutionTimes { relative_s: self.relative_s, ..ExecutionTimes::default() };
        self.execution_s.map_or(stated, |fixed_s| ExecutionTimes { fixed_s, seconds_per_tile: 0.0, ..stated })
    }

    fn options(&self, layer: &str, mode: Mode) -> NavigateOptions {
        NavigateOptions {
            layer: layer.to_owned(),
            mode,
            relative_count: self.relative_count.get(),
            sensors: SensorSigmas {
                heading_offset_rad: self.heading_sigma_deg.to_radians(),
                heading_noise_rad: self.heading_sigma_deg.to_radians(),
                height_offset_ratio: self.height_sigma_ratio,
                height_noise_ratio: self.height_sigma_ratio,
            },
            start_sigma_m: self.start_sigma_m,
            speed_mps: self.speed_mps,
            speed_sigma_mps: self.speed_mps / 2.0,
            min_turn_radius_m: self.min_turn_radius_m,
            execution_times: self.execution_times(),
            tracks: !self.without_tracks,
            threads: self.threads.get(),
        }
    }
}

/// Most tiles of the page's map.
const MOST_MAP_TILES: usize = 40;

// Few enough pixels for a picture in a page.
const _: () = assert!(MOST_MAP_TILES * (TILE_SIZE_PX as usize).pow(2) < 20_000_000);

/// The layer at the finest level that has few enough tiles; `None` if even the coarsest has more.
fn picture(store: &Reader, layer: &Layer) -> Result<Option<Mosaic>, Failure> {
    match finest_level(store, layer, MOST_MAP_TILES)? {
        Some(zoom) => mosaic_of(store, layer, zoom),
        None => Ok(None),
    }
}

fn text(score: &FlyScore) -> String {
    let spread = |s: &Option<Quantiles>| {
        s.map_or("none".into(), |s| format!("median {:.1}, 95 % {:.1}, max {:.1}", s.median, s.p95, s.max))
    };
    let recovered = match score.recovered_after_frames {
        Some(n) => format!("{n} clear images after the last disturbance"),
        None => "never".into(),
    };
    format!(
        "{}\n  images     {} ({} absolute registrations, {} of them fixes, {} false; {} relative ones)\n  position   {} m off\n  \
         ellipse    {} of the positions have the truth in their own 95 % ellipse\n  outside    99.9 %: {}\n  protection {}\n  within {:.0} m for good: {recovered}\n  \
         beside it  dead reckoning {} m off{}",
        score.mode.word(),
        score.frames,
        score.absolute_count,
        score.fixes,
        score.wrong,
        score.relative_count,
        spread(&score.position_error_m),
        score.ellipse95_coverage.map_or("none".into(), |c| format!("{:.1} %", 100.0 * c)),
        sources_text(score),
        integrity_text(&score.integrity),
        score.right_m,
        spread(&score.dead_reckoning_error_m),
        reckoned_text(score),
    )
}

/// How many positions have the truth outside their own 99.9 % ellipse, by what they call themselves.
fn sources_text(score: &FlyScore) -> String {
    let one = |word: &str, s: SourceScore| format!("{} of {} {word}", s.outside, s.positions);
    let s = &score.sources;
    [one("absolute", s.absolute), one("propagated", s.propagated), one("lost", s.lost)].join(", ")
}

/// The end error of each run of dead reckoning, with the heights as stated and scaled.
fn reckoned_text(score: &FlyScore) -> String {
    let Some(scale) = score.scale else { return String::new() };
    let from = match scale.from {
        ScaleSource::Fixes => "known from fixes",
        ScaleSource::Truth => "fitted to the truth",
    };
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    let runs = score.dead_reckoning_runs.iter().map(|run| {
        let scaled = run.scaled_end_error_share.map(percent).unwrap_or_default();
        format!("{} ({scaled}) % of {:.0} m", percent(run.end_error_share), run.path_m)
    });
    let runs: Vec<String> = runs.collect();
    format!("\n  its runs   end {} off; in brackets with heights times {:.3}, {from}", runs.join(", "), scale.ratio)
}
