//! `overfly plan`: what the models say of an aircraft, and where along a route fixes can be had.

mod text;

use super::evaluate::make_folder;
use super::number::{positive, share};
use super::{Exit, Failure, Output};
use overfly_core::coupling::Calibration;
use overfly_core::tile::gsd_at;
use overfly_flight::locate::candidates::default_layer;
use overfly_ingest::plan::{
    Forecast, RouteForecast, Sensitivity, Thresholds, read_aircraft, read_calibration, read_route, route_csv,
    route_geojson, sensitivity,
};
use overfly_lab::report::{Mosaic, plan_html, plan_svgs};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::path::{Path, PathBuf};

const HELP: &str = "\
aircraft.toml: speed_mps, min_turn_radius_m (inf: straight flight only), and what an image shows, one of
  width_px, height_px, gsd_m_per_px | width_px, height_px, height_m, field_of_view_deg (along the heading) | height_m, camera
camera is a camera.toml beside the file. Optional: map_gsd_m_per_px, inaccuracy_m (I, full width; default six map pixels),
matched_count, unit_drift_m (D_U), height_error_ratio (adds its share of every displacement to D_U), drift_growth (linear or
square_root), failure_probability (p), without_fix_s (since the last fix, at the start), parallel_registrations (true).

Along a route (one line of GeoJSON, GPX or KML, taken in steps of one image) a fix is expected where map, keypoints and distinctiveness
reach their thresholds. Drift in the gaps is that of relative registrations; over water or cloud these fail as well.

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
    /// What `overfly calibrate` wrote [default: constants of the project].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// The store; its pixels give the map's ground sample distance.
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME", requires = "db")]
    layer: Option<String>,
    /// The route: one line of GeoJSON, GPX or KML.
    #[arg(long, value_name = "FILE", requires = "db")]
    route: Option<PathBuf>,
    /// A fix is expected where the map shows at least this share of the image.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = Thresholds::default().least_covered)]
    least_covered: f64,
    /// And its tiles have at least so many keypoints each.
    #[arg(long, value_name = "N", value_parser = positive, default_value_t = Thresholds::default().least_keypoints)]
    least_keypoints: f64,
    /// And at least this distinctiveness.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = Thresholds::default().least_distinctiveness)]
    least_distinctiveness: f64,
    /// Write plan.html, plan.json, sensitivity.csv, the plots, and route.csv and route.geojson here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// What is printed as JSON. Infinite numbers are null.
#[derive(Serialize)]
struct Summary<'a> {
    #[serde(flatten)]
    forecast: &'a Forecast,
    calibration: &'a Calibration,
    sensitivity: &'a [Sensitivity],
    route: Option<&'a RouteForecast>,
}

/// Runs the command; exit code 1 where no mode works, or a route has no map at all.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let aircraft = read_aircraft(&args.aircraft)?;
    let calibration = args.calibration.as_deref().map_or(Ok(Calibration::PROJECT), read_calibration)?;
    let route = args.route.as_deref().map(read_route).transpose()?;
    let store = args.db.as_deref().map(Reader::open).transpose()?;
    let layer = match (&store, &args.layer) {
        (Some(store), Some(name)) => Some(store.layer(name)?),
        (Some(store), None) => Some(default_layer(store)?),
        (None, _) => None,
    };
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
    let summary =
        Summary { forecast: &forecast, calibration: &calibration, sensitivity: &changed, route: along.as_ref() };
    let text = text::text(&summary);
    if let Some(folder) = &args.out {
        let mosaic = match (&store, layer, &along) {
            (Some(store), Some(layer), Some(_)) => mosaic(store, layer)?,
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

/// Of the layer's base tiles, at its middle.
fn map_gsd_m_per_px(store: &Reader, layer: &Layer) -> Result<Option<f64>, Failure> {
    let footprints = store.footprints(layer, layer.base_zoom)?;
    let middle = footprints.get(footprints.len() / 2);
    Ok(middle.map(|f| gsd_at(f.tile.centre(), layer.base_zoom).mean_m_per_px()))
}

/// The coarsest level that still shows something: at most 64 tiles.
fn mosaic(store: &Reader, layer: &Layer) -> Result<Option<Mosaic>, Failure> {
    for zoom in (layer.min_zoom..=layer.base_zoom).rev() {
        let footprints = store.footprints(layer, zoom)?;
        if footprints.len() <= 64 || zoom == layer.min_zoom {
            let mut tiles = Vec::new();
            for footprint in footprints {
                tiles.extend(store.tile(layer, footprint.tile)?.map(|pixels| (footprint.tile, pixels)));
            }
            return Ok(Mosaic::assemble(&tiles));
        }
    }
    Ok(None)
}

fn write(
    folder: &Path,
    summary: &Summary,
    text: &str,
    mosaic: Option<&Mosaic>,
    output: &Output,
) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(summary).expect("results serialise");
    output.write(&folder.join("plan.json"), json.as_bytes())?;
    output.write(&folder.join("sensitivity.csv"), sensitivity_csv(summary.sensitivity).as_bytes())?;
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

/// Absent cells: no such number.
fn sensitivity_csv(rows: &[Sensitivity]) -> String {
    let cell = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
    let mut text = String::from(
        "parameter,factor,sequential_max_speed_mps,max_relative_count,max_mission_s,parallel_stable_s,combined_max_speed_mps\n",
    );
    for r in rows {
        text.push_str(&format!(
            "{},{},{:.6},{},{},{},{:.6}\n",
            r.parameter,
            r.factor,
            r.sequential_max_speed_mps,
            cell(r.max_relative_count),
            cell(r.max_mission_s),
            cell(r.parallel_stable_s),
            r.combined_max_speed_mps
        ));
    }
    text
}
