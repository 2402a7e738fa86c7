//! `overfly export`: cuts out what one flight needs, for the aircraft's storage.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::mission_text::mission_text;
use crate::cli::number::{file_bytes, positive_metres, share};
use crate::cli::output::Output;
use crate::cli::preflight::export_warnings::{ExportWarning, export_warnings, newer_replaced};
use crate::today::today;
use overfly_core::coupling::Calibration;
use overfly_core::tile::gsd_at;
use overfly_ingest::export::{
    CorridorCoverage, CorridorDrift, ExportRequest, Exported, ExportedLevel, Preview, covered_share, export, preview,
};
use overfly_ingest::plan::{read_aircraft, read_calibration, read_routes};
use overfly_store::Reader;
use overfly_store::package::{Date, SecretKey, parse_date};
use serde::Serialize;
use std::path::PathBuf;

const HELP: &str = "\
The route is given as lines of GeoJSON, GPX or KML. Lines that follow one another are legs; any other line is an alternate. The export
holds the tiles of all levels that meet the corridor (W metres on each side of the route) and the neighbours that a search also reads. A
search whose ground lies inside the corridor therefore answers as it would over the full store; for that, W must be at least the prior's
error plus half an image's diagonal plus a third of an image. With --aircraft, the corridor grows along the route by that, and by the
drift of relative registrations without any fix since the start.

--max-bytes drops, only as far as needed and in this order: the keypoint descriptors (no fix uses them); whole layers, oldest first,
down to one; its finest levels, down to one; the quality of its imagery (JPEG 60, then 40). What was dropped, and its effect, is printed
and recorded in the manifest.

The file is renamed into place when it is complete; equal requests give equal bytes. The file is sealed: `overfly verify` checks every
byte, and no build writes to it.

Examples:
  overfly export --db map.gpkg --route route.geojson --corridor-m 1500 --out flight.gpkg --dry-run
  overfly export --db map.gpkg --route route.gpx --corridor-m 500 --aircraft aircraft.toml --calibration calibration.toml \\
      --out flight.gpkg --valid-until 2027-03-31 --name \"Survey 7\" --serial 12 --sign ground.key";

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
    /// W: width of the corridor on each side of the route: metres, or with a unit (m, km, ft, nmi or NM), as in 0.4km or 1300ft.
    #[arg(long, value_name = "W", value_parser = positive_metres)]
    corridor_m: f64,
    /// The file to write; an export there is replaced, a map is not.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Export only this layer; may be repeated [default: all].
    #[arg(long, value_name = "NAME")]
    layer: Vec<String>,
    /// Refuse the export unless imagery covers at least this share of the corridor's area, as in 0.95.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    require_covered: Option<f64>,
    /// Print what would be exported and what the map shows along the route; write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Drop what is needed least until the file has at most SIZE bytes; also as in 5MB or 64MiB.
    #[arg(long, value_name = "SIZE", value_parser = file_bytes)]
    max_bytes: Option<u64>,
    /// Encode the imagery again with this JPEG quality, 1 to 100; docs/onboard.md has the effect on fixes.
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100))]
    jpeg_quality: Option<u8>,
    /// The last day on which the export may be flown (UTC).
    #[arg(long, value_name = "DATE", value_parser = parse_date)]
    valid_until: Option<Date>,
    /// The mission's name, which the manifest states and `overfly verify` prints.
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Serial number of the export. Count up: an aircraft takes no store of a lower number than that of the store it has.
    #[arg(long, value_name = "N")]
    serial: Option<u64>,
    /// Sign the export with this key (see `overfly keygen`). Needs --serial.
    #[arg(long, value_name = "KEY", requires = "serial")]
    sign: Option<PathBuf>,
    /// Widen the corridor along the route by this aircraft's drift (see `overfly plan --help`).
    #[arg(long, value_name = "FILE")]
    aircraft: Option<PathBuf>,
    /// The file that `overfly calibrate` wrote [default: the project's constants].
    #[arg(long, value_name = "FILE", requires = "aircraft")]
    calibration: Option<PathBuf>,
}

/// The result as JSON.
#[derive(Serialize)]
struct Reported<'a, T> {
    dry_run: bool,
    warnings: &'a [ExportWarning],
    #[serde(flatten)]
    result: &'a T,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let store = Reader::open_proved(&args.db)?;
    let request = request(args, &store)?;
    request.check_dates(&store, today())?;
    // Looking costs little beside writing, and a planner wants to know before it.
    let looked = preview(&store, &request)?;
    let mut warnings = export_warnings(&store, &args.layer, &looked.coverage, (args.corridor_m, looked.widest_m));
    warnings.extend(newer_replaced(&args.out, args.serial));
    warnings.iter().for_each(|warning| output.note(&format!("WARNING: {}", warning.message)));
    args.require_covered.map_or(Ok(()), |least| require_covered(args, &looked.coverage, least))?;
    if args.dry_run {
        steps(&looked.coverage, output);
        let reported = Reported { dry_run: true, warnings: &warnings, result: &looked };
        output.say(&reported, || previewed(args, &looked));
        return Ok(Exit::Done);
    }
    let exported = output.during("tiles", |tell| export(&store, &request, &args.out, tell))?;
    steps(&exported.coverage, output);
    output.say(&Reported { dry_run: false, warnings: &warnings, result: &exported }, || text(args, &exported));
    Ok(Exit::Done)
}

/// Refuses a corridor of which less than the required share has imagery.
fn require_covered(args: &Args, coverage: &[CorridorCoverage], least: f64) -> Result<(), Failure> {
    let covered = covered_share(coverage);
    if covered >= least {
        return Ok(());
    }
    let reason = anyhow::anyhow!(
        "{}: imagery covers {:.1} % of the corridor of {}, and --require-covered {least} asks for {:.1} %",
        args.db.display(),
        100.0 * covered,
        args.route.display(),
        100.0 * least
    );
    let remedy = "build more imagery along the route, narrow --corridor-m, or change the route";
    Err(Failure::unusable("not_covered", reason).with_remedy(Some(remedy)))
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
        name: args.name.clone(),
        serial: args.serial,
        key: args.sign.as_deref().map(SecretKey::read).transpose()?,
    })
}

/// The ground sample distance of the coarsest base level, in the middle of its layer, m/px.
fn map_gsd_m_per_px(store: &Reader) -> Option<f64> {
    let layer = store.imagery_layers().min_by_key(|l| l.base_zoom)?;
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
            "layer {}: the map shows {:.1} % of the corridor, at least {:.1} %; less than half along {:.1} % of the route",
            c.layer,
            100.0 * c.mean,
            100.0 * c.least,
            100.0 * c.poor_share
        )
    };
    coverage.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn previewed(args: &Args, preview: &Preview) -> String {
    let allowed = args.max_bytes.filter(|most| preview.estimated_bytes > *most).map_or(String::new(), |most| {
        format!("that is more than the {most} allowed: the export drops what is needed least, and lists it\n")
    });
    format!(
        "{}{} bytes of content; the file takes about {:.1} MB\n{allowed}\
         the corridor is up to {:.0} m wide on each side\n{}",
        table(&preview.parts),
        preview.bytes,
        preview.estimated_bytes as f64 / 1e6,
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
    let mission = mission_text(exported.name.as_deref(), exported.serial, exported.valid_until.as_deref());
    let (out, bytes, digest) = (args.out.display(), exported.bytes, &exported.digest);
    text.push_str(&format!("{out}: {mission}{bytes} bytes, digest {digest}, {signed}"));
    text
}
