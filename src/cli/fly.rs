//! `overfly fly`: a flight replayed in a closed loop, in one coupling mode or all.

use super::evaluate::{default_right_m, make_folder};
use super::number::{any, positive, share};
use super::{Exit, Failure, Output, chosen_layer, default_threads, simulate};
use overfly_core::coupling::Mode;
use overfly_core::tile::TILE_SIZE_PX;
use overfly_flight::navigate::{ExecutionTimes, NavigateOptions, SensorSigmas};
use overfly_lab::report::{Mosaic, ReplayedFlight, replay_html};
use overfly_lab::trial::{
    Disturbances, FlyOutcome, FlyScore, FlyTrial, Quantiles, RecordedFlight, ScaleSource, write_positions,
};
use overfly_store::{Layer, Reader, StoreError};
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
Truth (the true_ columns of flight.csv) starts the flight and scores it; between, positions come from the images, compass
and altimeter alone. Modes:
  sequential  --relative-count relative registrations, then an absolute one, which is waited for
  parallel    both at once; an absolute result is carried forward by the relative registrations made meanwhile
  combined    absolute registrations alone, each over all that can have been reached since the last
  auto        waits for an absolute registration that ends before the next image is due, else lets it run beside
Beside each stands dead reckoning: relative registrations alone, from the true start of each run between pauses, untroubled.

--simulate flies thousands of drawn flights of hours instead, whose errors, times and failures the file states, and holds what the
models predict against what happens: failures (11, 14), T0_max (16), settling times (21), covariances. No image is registered.
docs/simulation/commented.toml has every field; --out writes simulation.csv, summary.json, plots and the page simulation.html.

Execution times are --execution-s, or a stated line (0.05 s and 0.001 s a tile), never the machine's: a replay gives the same
positions everywhere. Troubles for trials: --start-error-m, --blackout, --cloud, --heading-bias-deg.

With --json: an object per mode. --out writes positions.csv, summary.json and the page report.html.

Examples:
  overfly fly --db map.gpkg --flight flights/0716 --mode all --out flown
  overfly fly --simulate docs/simulation/paper.toml --out simulated";

/// What says nothing of a simulation.
const FLOWN_ONLY: [&str; 17] = [
    "flight",
    "layer",
    "mode",
    "relative_count",
    "heading_sigma_deg",
    "height_sigma_ratio",
    "start_sigma_m",
    "speed_mps",
    "min_turn_radius_m",
    "execution_s",
    "relative_s",
    "start_error_m",
    "blackout",
    "cloud",
    "heading_bias_deg",
    "seed",
    "right_m",
];

/// Arguments of `fly`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE", required_unless_present = "simulate")]
    db: Option<PathBuf>,
    /// The flight: a folder with flight.csv, camera.toml and images.
    #[arg(long, value_name = "DIR", required_unless_present = "simulate")]
    flight: Option<PathBuf>,
    /// Simulate what this file describes; with --db over that store, where the file has a table [store].
    #[arg(long, value_name = "FILE", conflicts_with_all = FLOWN_ONLY)]
    simulate: Option<PathBuf>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// How to couple absolute and relative registration.
    #[arg(long, value_enum, default_value_t = ModeArg::Auto)]
    mode: ModeArg,
    /// n of the sequential mode: images between two absolute registrations.
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::new(5).expect("5 is not 0"))]
    relative_count: NonZeroUsize,
    /// One standard deviation of the compass, degrees: of what it is wrong by throughout, and of what anew each time.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    heading_sigma_deg: f64,
    /// One standard deviation of the height, as a ratio of it, in the same two ways.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// One standard deviation of the start per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive, default_value_t = 50.0)]
    start_sigma_m: f64,
    /// Speed over ground until images tell it, m/s, trusted to a half.
    #[arg(long, value_name = "MPS", value_parser = positive, default_value_t = 40.0)]
    speed_mps: f64,
    /// Smallest turn radius, metres.
    #[arg(long, value_name = "M", value_parser = positive, default_value_t = 500.0)]
    min_turn_radius_m: f64,
    /// Execution time of an absolute registration, whatever it searches, seconds [default: 0.05 and 0.001 a tile].
    #[arg(long, value_name = "S", value_parser = positive)]
    execution_s: Option<f64>,
    /// Execution time of a relative registration, seconds.
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 0.03)]
    relative_s: f64,
    /// Trouble: the stated start lies this far off, in a direction drawn, metres.
    #[arg(long, value_name = "M", value_parser = any, default_value_t = 0.0, help_heading = "Troubles")]
    start_error_m: f64,
    /// Trouble: images FIRST to FIRST + COUNT - 1, counted from 0, are black.
    #[arg(long, value_name = "FIRST:COUNT", value_parser = blackout, help_heading = "Troubles")]
    blackout: Option<(usize, usize)>,
    /// Trouble: this share of the images shows nothing but cloud.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.0, help_heading = "Troubles")]
    cloud: f64,
    /// Trouble: the compass says this much too much, degrees.
    #[arg(long, value_name = "DEG", value_parser = any, default_value_t = 0.0, allow_negative_numbers = true, help_heading = "Troubles")]
    heading_bias_deg: f64,
    /// Seed of the troubles.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Troubles")]
    seed: u64,
    /// Greatest error that counts as right, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive)]
    right_m: Option<f64>,
    /// Threads of each registration; simulated flights at a time.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write positions.csv, summary.json and report.html here; of a simulation simulation.csv, summary.json, the plots and
    /// simulation.html.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A mode, or all of them.
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
    found.ok_or_else(|| "two whole numbers, FIRST:COUNT, like 20:10".into())
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    if let Some(file) = &args.simulate {
        return simulate::run(file, args.db.as_deref(), args.threads.get(), args.out.as_deref(), output);
    }
    let (Some(db), Some(flown)) = (&args.db, &args.flight) else {
        unreachable!("both are required where nothing is simulated")
    };
    let flight = RecordedFlight::read(flown)?;
    let store = Reader::open(db)?;
    let layer = chosen_layer(&store, args.layer.as_deref())?;
    let right_m = args.right_m.map_or_else(|| default_right_m(&store, layer), Ok)?;
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let modes = args.mode.modes();
    let bar = output.progress((flight.frames.len() * (modes.len() + 1)) as u64, "images");
    let trial = FlyTrial { store: &store, flight: &flight, disturbances: args.disturbances() };
    let reckoned = trial.reckon(&args.options(&layer.name, Mode::RelativeOnly), |_| bar.inc(1))?;
    let title = format!("overfly: {} flown without GPS", flown.display());
    let mut flown: Vec<(Mode, Vec<FlyOutcome>)> = Vec::new();
    for mode in modes {
        flown.push((mode, trial.run(&args.options(&layer.name, mode), |_| bar.inc(1))?));
    }
    bar.finish_and_clear();
    let scores: Vec<FlyScore> =
        flown.iter().map(|(mode, outcomes)| FlyScore::from_outcomes(*mode, outcomes, &reckoned, right_m)).collect();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_positions(folder, &flown)?.display()));
        let summary = serde_json::to_vec_pretty(&scores).expect("plain numbers");
        output.write(&folder.join("summary.json"), &summary)?;
        if let Some(mosaic) = picture(&store, layer)? {
            let execution_times = args.execution_times();
            let modes: Vec<ReplayedFlight> = flown
                .iter()
                .zip(&scores)
                .map(|((_, outcomes), score)| ReplayedFlight { outcomes, score, execution_times })
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
    fn disturbances(&self) -> Disturbances {
        Disturbances {
            start_error_m: self.start_error_m,
            blackout: self.blackout,
            cloud_share: self.cloud,
            heading_bias_rad: self.heading_bias_deg.to_radians(),
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
            threads: self.threads.get(),
        }
    }
}

/// A page's map has at most so many pixels to begin with.
const MOST_PICTURE_TILES: u64 = 40;

/// The layer at the finest level whose tiles are few enough; `None` where even the coarsest has more.
fn picture(store: &Reader, layer: &Layer) -> Result<Option<Mosaic>, StoreError> {
    const { assert!(MOST_PICTURE_TILES * (TILE_SIZE_PX as u64).pow(2) < 20_000_000) };
    for zoom in (layer.min_zoom..=layer.base_zoom).rev() {
        let footprints = store.footprints(layer, zoom)?;
        if footprints.len() as u64 <= MOST_PICTURE_TILES {
            let mut tiles = Vec::new();
            for footprint in footprints {
                tiles.extend(store.tile(layer, footprint.tile)?.map(|pixels| (footprint.tile, pixels)));
            }
            return Ok(Mosaic::assemble(&tiles));
        }
    }
    Ok(None)
}

fn text(score: &FlyScore) -> String {
    let spread = |s: &Option<Quantiles>| {
        s.map_or("none".into(), |s| format!("median {:.1}, 95 % {:.1}, max {:.1}", s.median, s.p95, s.max))
    };
    let recovered = match score.recovered_after_frames {
        Some(n) => format!("{n} clear images after the last trouble"),
        None => "never".into(),
    };
    format!(
        "{}\n  images     {} ({} absolute registrations, {} of them fixes, {} false; {} relative ones)\n  position   {} m off\n  \
         ellipse    {} of the positions have the truth in their own 95 % ellipse\n  within {:.0} m for good: {recovered}\n  \
         beside it  dead reckoning {} m off{}",
        score.mode.word(),
        score.frames,
        score.absolute_count,
        score.fixes,
        score.wrong,
        score.relative_count,
        spread(&score.position_error_m),
        score.ellipse95_coverage.map_or("none".into(), |c| format!("{:.1} %", 100.0 * c)),
        score.right_m,
        spread(&score.dead_reckoning_error_m),
        reckoned_text(score),
    )
}

/// Each run of dead reckoning, as it is and with one scale.
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
