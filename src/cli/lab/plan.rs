//! `overfly plan`: what the models predict for an aircraft, and where along a route fixes can be expected.

mod sensitivity_csv;
mod summary;
mod text;

use crate::cli::chosen_layer::chosen_layer;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::mosaic::{finest_level, mosaic_of};
use crate::cli::number::{positive, share};
use crate::cli::output::Output;
use overfly_core::coupling::Calibration;
use overfly_core::tile::gsd_at;
use overfly_ingest::plan::{
    Forecast, RouteForecast, Thresholds, read_aircraft, read_calibration, read_route, route_csv, route_geojson,
    sensitivity,
};
use overfly_lab::report::{Mosaic, plan_html, plan_svgs};
use overfly_store::{Layer, Reader};
use sensitivity_csv::sensitivity_csv;
use std::path::{Path, PathBuf};
use summary::PlanSummary;

const HELP: &str = "\
aircraft.toml has speed_mps, min_turn_radius_m (inf: straight flight only), and the extent of an image as one of
  width_px, height_px, gsd_m_per_px | width_px, height_px, height_m, field_of_view_deg (along the heading) | height_m, camera
where camera is a camera.toml beside the file. Optional: map_gsd_m_per_px, inaccuracy_m (I, full width; default six map pixels),
matched_count, unit_drift_m (D_U), height_error_ratio (adds this share of every displacement to D_U), drift_growth (linear or
square_root), failure_probability (p), without_fix_s (time since the last fix at the start), parallel_registrations (true).

The first line is the verdict. With a route, the mode is one that holds through the route's longest gap between fixes.

Along a route (one line of GeoJSON, GPX or KML, in steps of one image) a fix is expected where the map, the keypoints and the
distinctiveness reach their thresholds. The drift in the gaps is that of relative registrations; over water or cloud these fail as well.

Examples:
  overfly plan --aircraft aircraft.toml --calibration calibration.toml
  overfly plan --aircraft aircraft.toml --db map.gpkg --route route.geojson --out planned";

/// Arguments of `plan`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The aircraft and its camera.
    #[arg(long, value_name = "FILE")]
    aircraft: PathBuf,
    /// The file that `overfly calibrate` wrote [default: the project's constants].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// The store; it gives the map's ground sample distance.
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME", requires = "db")]
    layer: Option<String>,
    /// The route: one line of GeoJSON, GPX or KML.
    #[arg(long, value_name = "FILE", requires = "db")]
    route: Option<PathBuf>,
    /// Threshold for a fix: the share of the image that the map shows.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = Thresholds::default().least_covered)]
    least_covered: f64,
    /// Threshold for a fix: keypoints per tile.
    #[arg(long, value_name = "N", value_parser = positive, default_value_t = Thresholds::default().least_keypoints)]
    least_keypoints: f64,
    /// Threshold for a fix: distinctiveness.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = Thresholds::default().least_distinctiveness)]
    least_distinctiveness: f64,
    /// Write plan.html, plan.json, sensitivity.csv, the plots, and route.csv and route.geojson here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command; exit code 1 if no mode works, or if the route has no map at all.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let aircraft = read_aircraft(&args.aircraft)?;
    let calibration = args.calibration.as_deref().map_or(Ok(Calibration::PROJECT), read_calibration)?;
    let route = args.route.as_deref().map(read_route).transpose()?;
    let store = args.db.as_deref().map(Reader::open).transpose()?;
    let layer = store.as_ref().map(|store| chosen_layer(store, args.layer.as_deref())).transpose()?;
    let map_gsd = match (&store, layer) {
        (Some(store), Some(layer)) => map_gsd_m_per_px(store, layer)?,
        _ => None,
    };
    let forecast = Forecast::new(&aircraft, &calibration, map_gsd)?;
    let changed = sensitivity(forecast.parameters)?;
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let thresholds = Thresholds {
        least_covered: args.least_covered,
        least_keypoints: args.least_keypoints,
        least_distinctiveness: args.least_distinctiveness,
    };
    let along = match (&store, layer, &route) {
        (Some(store), Some(layer), Some(route)) => {
            let bar = output.progress((route.length_m() / forecast.parameters.along_m) as u64 + 1, "images");
            let along = RouteForecast::new(route, &forecast, store, layer, thresholds, || bar.inc(1));
            bar.finish_and_clear();
            Some(along?)
        }
        _ => None,
    };
    let forecast = along.iter().fold(forecast, Forecast::along);
    let verdict = forecast.verdict(along.as_ref());
    let summary = PlanSummary {
        verdict: &verdict,
        forecast: &forecast,
        calibration: &calibration,
        sensitivity: &changed,
        route: along.as_ref(),
    };
    let text = text::text(&summary);
    if let Some(folder) = &args.out {
        let mosaic = match (&store, layer, &along) {
            (Some(store), Some(layer), Some(_)) => picture(store, layer)?,
            _ => None,
        };
        write(folder, &summary, &text, mosaic.as_ref(), output)?;
    }
    if output.is_json() {
        for step in along.iter().flat_map(|a| &a.steps) {
            output.say(step, String::new);
        }
    }
    output.say(&summary, || text);
    let nothing = forecast.advice.mode.is_none() || along.is_some_and(|a| a.with_map == 0.0);
    Ok(if nothing { Exit::Failed } else { Exit::Done })
}

/// The ground sample distance of the layer's base level, in its middle, m/px.
fn map_gsd_m_per_px(store: &Reader, layer: &Layer) -> Result<Option<f64>, Failure> {
    let footprints = store.footprints(layer, layer.base_zoom)?;
    let middle = footprints.get(footprints.len() / 2);
    Ok(middle.map(|f| gsd_at(f.tile.centre(), layer.base_zoom).mean_m_per_px()))
}

/// The layer at the finest level with at most 64 tiles, or at its coarsest.
fn picture(store: &Reader, layer: &Layer) -> Result<Option<Mosaic>, Failure> {
    let zoom = finest_level(store, layer, 64)?.unwrap_or(layer.min_zoom);
    mosaic_of(store, layer, zoom)
}

fn write(
    folder: &Path,
    summary: &PlanSummary,
    text: &str,
    mosaic: Option<&Mosaic>,
    output: &Output,
) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(summary).expect("results serialise");
    output.write(&folder.join("plan.json"), json.as_bytes())?;
    output.write(&folder.join("sensitivity.csv"), &sensitivity_csv(summary.sensitivity))?;
    for (name, plot) in plan_svgs(summary.forecast) {
        output.write(&folder.join(format!("{name}.svg")), plot.as_bytes())?;
    }
    if let Some(route) = summary.route {
        output.write(&folder.join("route.csv"), route_csv(route).as_bytes())?;
        output.write(&folder.join("route.geojson"), route_geojson(route).as_bytes())?;
    }
    let page = plan_html(summary.forecast, text, summary.route.map(|route| (route, mosaic)));
    output.write(&folder.join("plan.html"), page.as_bytes())
}
