//! `overfly candidates`: the tiles to search, as `GET /v1/candidates` lists them.

use super::{Exit, Failure, Output};
use overfly::locate::candidates::{CandidateParameters, Candidates, candidates};
use overfly::store::Reader;
use std::path::PathBuf;

/// Arguments: the HTTP parameters by the same names.
#[derive(clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Most likely position of the image's centre, degrees north.
    #[arg(long)]
    latitude_deg: f64,
    /// Most likely position of the image's centre, degrees east.
    #[arg(long)]
    longitude_deg: f64,
    /// Direction of the image's upper edge, clockwise from true north, [0, 360).
    #[arg(long)]
    heading_deg: f64,
    /// a: the image's ground extent across the heading.
    #[arg(long)]
    across_m: f64,
    /// b: the image's ground extent along the heading.
    #[arg(long)]
    along_m: f64,
    /// I: full width of the last fix's error.
    #[arg(long)]
    inaccuracy_m: Option<f64>,
    /// D_T: drift since the last fix, one-sided.
    #[arg(long)]
    drift_m: Option<f64>,
    /// Instead of inaccuracy and drift: one standard deviation towards east.
    #[arg(long)]
    sigma_east_m: Option<f64>,
    /// One standard deviation towards north.
    #[arg(long)]
    sigma_north_m: Option<f64>,
    /// Correlation of both [default: 0].
    #[arg(long)]
    correlation: Option<f64>,
    /// sequential, parallel or combined [default: sequential].
    #[arg(long)]
    mode: Option<String>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long)]
    layer: Option<String>,
    /// Return only this many of the best.
    #[arg(long)]
    max_tiles: Option<u64>,
    /// Chooses the coarsest level whose pixels are no larger [default: the base level].
    #[arg(long)]
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
            layer: self.layer.clone(),
            max_tiles: self.max_tiles,
            gsd_m_per_px: self.gsd_m_per_px,
            ..CandidateParameters::default()
        }
    }
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let query = args.parameters().query()?;
    let store = Reader::open(&args.db)?;
    let answer = candidates(&store, &query)?;
    output.say(&answer, || table(&answer));
    Ok(Exit::Done)
}

fn table(answer: &Candidates) -> String {
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
        "{} tiles hold the image's centre with probability {:.4}; nominal count {:.2}; about {:.2} s to search",
        answer.tiles.len(),
        answer.containment,
        answer.nominal_count,
        answer.estimated_s
    ));
    lines.join("\n")
}
