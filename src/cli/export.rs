//! `overfly export`: what one flight needs, for the aircraft's storage.

use super::number::positive;
use super::{Exit, Failure, Output};
use overfly_core::coupling::Calibration;
use overfly_core::tile::gsd_at;
use overfly_ingest::export::{
    CorridorCoverage, CorridorDrift, ExportRequest, Exported, ExportedLevel, Preview, export, preview,
};
use overfly_ingest::plan::{read_aircraft, read_calibration, read_routes};
use overfly_store::Reader;
use overfly_store::package::{Date, SecretKey, parse_date};
use serde::Serialize;
use std::path::PathBuf;

const HELP: &str = "\
The route: lines of GeoJSON, GPX or KML. Lines that follow one another are legs; any other is an alternate. Taken are the tiles
of all levels that meet the corridor, W metres on each side of the route, and those around them that a search reads beside. So a
search whose ground lies inside answers as it would over the full store: W is at least the prior's error and half an image's
diagonal, and a third of an image more. With --aircraft the corridor grows along the way by that, and by the drift of relative
registrations without any fix since the start.

--max-bytes drops, only as far as needed: the keypoint descriptors (no fix uses them); whole layers, oldest first, down
to one; its finest levels, down to one; its imagery's quality (JPEG 60, then 40). What was dropped and what that costs is printed and written down in the manifest.

The file comes into being whole, by a rename; the same request gives the same bytes. It is sealed: `overfly verify` checks every
byte of it, and no build writes to it.

Examples:
  overfly export --db map.gpkg --route route.geojson --corridor-m 1500 --out flight.gpkg --dry-run
  overfly export --db map.gpkg --route route.gpx --corridor-m 500 --aircraft aircraft.toml --calibration calibration.toml \\
      --out flight.gpkg --valid-until 2027-03-31 --sign ground.key";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store to cut from.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The route: GeoJSON, GPX or KML.
    #[arg(long, value_name = "FILE")]
    route: PathBuf,
    /// W: the corridor on each side of the route.
    #[arg(long, value_name = "W", value_parser = positive)]
    corridor_m: f64,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Take this layer only; may be given again [default: all].
    #[arg(long, value_name = "NAME")]
    layer: Vec<String>,
    /// Print what would be taken and what the map shows along the route; write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Drop what is needed least until the file takes no more.
    #[arg(long, value_name = "N")]
    max_bytes: Option<u64>,
    /// Encode imagery anew with this JPEG quality, 1 to 100; what that does to fixes: docs/onboard.md.
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100))]
    jpeg_quality: Option<u8>,
    /// The last day on which it may be flown (UTC).
    #[arg(long, value_name = "DATE", value_parser = parse_date)]
    valid_until: Option<Date>,
    /// Sign it with this key (see `overfly keygen`).
    #[arg(long, value_name = "KEY")]
    sign: Option<PathBuf>,
    /// Let the corridor grow by this aircraft's drift along the way (see `overfly plan --help`).
    #[arg(long, value_name = "FILE")]
    aircraft: Option<PathBuf>,
    /// What `overfly calibrate` wrote [default: constants of the project].
    #[arg(long, value_name = "FILE", requires = "aircraft")]
    calibration: Option<PathBuf>,
}

/// What is printed as JSON after a dry run.
#[derive(Serialize)]
struct Previewed<'a> {
    dry_run: bool,
    #[serde(flatten)]
    preview: &'a Preview,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let store = Reader::open(&args.db)?;
    let request = request(args, &store)?;
    if args.dry_run {
        let preview = preview(&store, &request)?;
        steps(&preview.coverage, output);
        output.say(&Previewed { dry_run: true, preview: &preview }, || previewed(args, &preview));
        return Ok(Exit::Done);
    }
    let exported = output.during("tiles", |tell| export(&store, &request, &args.out, tell))?;
    steps(&exported.coverage, output);
    output.say(&exported, || text(args, &exported));
    Ok(Exit::Done)
}

fn request(args: &Args, store: &Reader) -> Result<ExportRequest, Failure> {
    let routes = read_routes(&args.route)?;
    let calibration = args.calibration.as_deref().map(read_calibration).transpose()?;
    let drift = match &args.aircraft {
        Some(path) => {
            let aircraft = read_aircraft(path)?;
            let known = calibration.unwrap_or(Calibration::PROJECT);
            let parameters = aircraft
                .parameters(&known, map_gsd_m_per_px(store))
                .map_err(overfly_ingest::export::ExportError::from)?;
            Some(CorridorDrift(parameters))
        }
        None => None,
    };
    Ok(ExportRequest {
        routes,
        corridor_m: args.corridor_m,
        calibration: drift.map(|_| calibration.unwrap_or(Calibration::PROJECT)),
        drift,
        layers: args.layer.clone(),
        max_bytes: args.max_bytes,
        jpeg_quality: args.jpeg_quality,
        valid_until: args.valid_until,
        key: args.sign.as_deref().map(SecretKey::read).transpose()?,
    })
}

/// Of the coarsest base level among the layers, in the middle of its layer.
fn map_gsd_m_per_px(store: &Reader) -> Option<f64> {
    let layer = store.layers().iter().filter(|l| l.complete).min_by_key(|l| l.base_zoom)?;
    Some(gsd_at(layer.bounds_deg.middle().ok()?, layer.base_zoom).mean_m_per_px())
}

fn steps(coverage: &[CorridorCoverage], output: &Output) {
    if output.is_json() {
        coverage.iter().flat_map(|c| &c.steps).for_each(|step| output.say(step, String::new));
    }
}

fn table(parts: &[ExportedLevel]) -> String {
    let mut text = String::from("layer                 level    tiles        imagery    descriptors          cells\n");
    for part in parts {
        let b = part.bytes;
        let row = format!(
            "{:<20} {:>6} {:>8} {:>14} {:>14} {:>14}\n",
            part.layer, part.zoom, part.tiles, b.imagery, b.descriptors, b.cells
        );
        text.push_str(&row);
    }
    text
}

fn coverage_text(coverage: &[CorridorCoverage]) -> String {
    let line = |c: &CorridorCoverage| {
        format!(
            "layer {}: the map shows {:.1} % of the corridor, {:.1} % where it shows least; less than half in {:.1} % of the way",
            c.layer,
            100.0 * c.mean,
            100.0 * c.least,
            100.0 * c.poor_share
        )
    };
    coverage.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn previewed(args: &Args, preview: &Preview) -> String {
    let allowed = args.max_bytes.filter(|most| preview.bytes > *most).map_or(String::new(), |most| {
        format!("that is more than the {most} allowed: the export drops what is needed least, and says what\n")
    });
    format!(
        "{}{} bytes; footprints, indexes and pages filled in part come to it, about half a megabyte and 10 kB a tile\n{allowed}\
         the corridor is up to {:.0} m wide on each side\n{}",
        table(&preview.parts),
        preview.bytes,
        preview.widest_m,
        coverage_text(&preview.coverage)
    )
}

fn text(args: &Args, exported: &Exported) -> String {
    let mut text = format!("{}{}\n", table(&exported.parts), coverage_text(&exported.coverage));
    for dropped in &exported.dropped {
        text.push_str(&format!("dropped {}: {}\n", dropped.what, dropped.effect));
    }
    let signed = exported.signed_by.as_ref().map_or("not signed".into(), |key| format!("signed by {key}"));
    text.push_str(&format!("{}: {} bytes, digest {}, {signed}", args.out.display(), exported.bytes, exported.digest));
    text
}
