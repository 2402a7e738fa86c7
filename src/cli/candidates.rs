//! `overfly candidates`: the tiles to search, as `GET /v1/candidates` lists them.

use crate::cli::chosen_layer::chosen_layer;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::number::{any, metres};
use crate::cli::output::Output;
use crate::cli::outside_map::outside_note;
use overfly_flight::locate::candidates::{CandidateParameters, Candidates, candidates};
use overfly_store::Reader;
use std::path::PathBuf;

const HELP: &str = "\
The search region depends on the mode:
  sequential  --inaccuracy-m --drift-m: the image's centre lies within half the inaccuracy plus the drift of the given
              position (the paper's equation 3). Or --sigma-east-m --sigma-north-m: within the 99.7 % ellipse.
  parallel    --inaccuracy-m --unit-drift-m --execution-s --relative-s: as sequential, with the drift of the relative
              registrations that ran during one absolute registration (equation 17).
  combined    --inaccuracy-m --speed-mps --execution-s --min-turn-radius-m: the position and heading are those of the last
              fix. The region is all ground that the image can show after exactly the execution time, whatever turns the
              aircraft made.
Every region is widened by the extent of the image itself.

Examples:
  overfly candidates --db map.gpkg --latitude-deg 48.4915 --longitude-deg 15.616 --heading-deg 270 \\
      --across-m 400 --along-m 300 --inaccuracy-m 20 --drift-m 250
  overfly candidates --db map.gpkg --latitude-deg 48.4915 --longitude-deg 15.616 --heading-deg 270 \\
      --across-m 400 --along-m 300 --sigma-east-m 80 --sigma-north-m 50 --max-tiles 10 --json
  overfly candidates --db map.gpkg --latitude-deg 48.4915 --longitude-deg 15.616 --heading-deg 270 \\
      --across-m 400 --along-m 300 --mode parallel --inaccuracy-m 20 --unit-drift-m 2 --execution-s 10 --relative-s 0.2
  overfly candidates --db map.gpkg --latitude-deg 48.4915 --longitude-deg 15.616 --heading-deg 270 \\
      --across-m 400 --along-m 300 --mode combined --inaccuracy-m 20 --speed-mps 40 --execution-s 8 --min-turn-radius-m 300";

/// Arguments; the HTTP parameters have the same names.
#[derive(clap::Args)]
#[command(allow_negative_numbers = true, after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Most likely position of the image's centre, degrees north; combined: where the last fix was.
    #[arg(long, value_name = "DEG", value_parser = any)]
    latitude_deg: f64,
    /// Longitude of that point, degrees east.
    #[arg(long, value_name = "DEG", value_parser = any)]
    longitude_deg: f64,
    /// Direction of the image's upper edge, degrees clockwise from true north, in [0, 360); combined: heading at the last fix.
    #[arg(long, value_name = "DEG", value_parser = any)]
    heading_deg: f64,
    /// The image's extent on the ground across the heading, metres (the paper's a).
    #[arg(long, value_name = "M", value_parser = metres)]
    across_m: f64,
    /// The image's extent on the ground along the heading, metres (the paper's b).
    #[arg(long, value_name = "M", value_parser = metres)]
    along_m: f64,
    /// Coupling mode: sequential, parallel or combined [default: sequential].
    #[arg(long, value_name = "MODE")]
    mode: Option<String>,
    /// Full width of the last fix's error, metres (the paper's I). All modes.
    #[arg(long, value_name = "M", value_parser = metres)]
    inaccuracy_m: Option<f64>,
    /// Drift since the last fix to either side, metres (the paper's D_T). Sequential mode.
    #[arg(long, value_name = "M", value_parser = metres)]
    drift_m: Option<f64>,
    /// Instead of inaccuracy and drift: one standard deviation towards east, metres. Sequential mode.
    #[arg(long, value_name = "M", value_parser = metres)]
    sigma_east_m: Option<f64>,
    /// One standard deviation towards north, metres. Sequential mode.
    #[arg(long, value_name = "M", value_parser = metres)]
    sigma_north_m: Option<f64>,
    /// Correlation of east and north, in (-1, 1) [default: 0].
    #[arg(long, value_name = "R", value_parser = any)]
    correlation: Option<f64>,
    /// Drift of one relative registration to either side, metres (the paper's D_U). Parallel mode.
    #[arg(long, value_name = "M", value_parser = metres)]
    unit_drift_m: Option<f64>,
    /// How long the absolute registration before this search ran, seconds (the paper's t_exe). Parallel and combined modes.
    #[arg(long, value_name = "S", value_parser = any)]
    execution_s: Option<f64>,
    /// Time of one relative registration, seconds (the paper's t0). Parallel mode.
    #[arg(long, value_name = "S", value_parser = any)]
    relative_s: Option<f64>,
    /// Ground speed, metres per second (the paper's v). Combined mode.
    #[arg(long, value_name = "MPS", value_parser = any)]
    speed_mps: Option<f64>,
    /// Smallest turn radius, metres (the paper's R_min). Combined mode.
    #[arg(long, value_name = "M", value_parser = metres)]
    min_turn_radius_m: Option<f64>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Print only the best N tiles.
    #[arg(long, value_name = "N")]
    max_tiles: Option<u64>,
    /// Search the coarsest level whose pixels are no larger than this [default: the base level].
    #[arg(long, value_name = "M_PER_PX", value_parser = any)]
    gsd_m_per_px: Option<f64>,
}

impl Args {
    fn parameters(&self) -> CandidateParameters {
        CandidateParameters {
            latitude_deg: Some(self.latitude_deg),
            longitude_deg: Some(self.longitude_deg),
            heading_deg: Some(self.heading_deg),
            across_m: Some(self.across_m),
            along_m: Some(self.along_m),
            inaccuracy_m: self.inaccuracy_m,
            drift_m: self.drift_m,
            sigma_east_m: self.sigma_east_m,
            sigma_north_m: self.sigma_north_m,
            correlation: self.correlation,
            mode: self.mode.clone(),
            unit_drift_m: self.unit_drift_m,
            execution_s: self.execution_s,
            relative_s: self.relative_s,
            speed_mps: self.speed_mps,
            min_turn_radius_m: self.min_turn_radius_m,
            layer: self.layer.clone(),
            max_tiles: self.max_tiles,
            gsd_m_per_px: self.gsd_m_per_px,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let query = args.parameters().query()?;
    let store = Reader::open(&args.db).map_err(Failure::of_crew)?;
    let answer = candidates(&store, &query)?;
    output.say(&answer, || table(&answer));
    if answer.tiles.is_empty() {
        let layer = chosen_layer(&store, args.layer.as_deref())?;
        output.note(&outside_note(layer, args.latitude_deg, args.longitude_deg));
    }
    Ok(Exit::Done)
}

fn table(answer: &Candidates) -> String {
    if answer.tiles.is_empty() {
        return "no tile: the region to search lies outside the layer".into();
    }
    let mut lines = vec![format!(
        "{:<28} {:>11} {:>9} {:>15} {:>9}  acquired",
        "tile", "probability", "keypoints", "distinctiveness", "m/px"
    )];
    lines.extend(answer.tiles.iter().map(|t| {
        format!(
            "{:<28} {:>11.6} {:>9} {:>15.3} {:>9.3}  {}",
            t.id,
            t.probability,
            t.keypoints,
            t.distinctiveness,
            t.gsd_m_per_px,
            t.acquired.as_deref().unwrap_or("unknown")
        )
    }));
    lines.push(format!(
        "{} tile(s) hold the image's centre with probability {:.4}; nominal count {:.2}; about {:.2} s to search",
        answer.tiles.len(),
        answer.containment,
        answer.nominal_count,
        answer.estimated_s
    ));
    lines.join("\n")
}
