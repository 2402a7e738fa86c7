//! `GET /v1/candidates`: the tiles to search for a position and its uncertainty; `POST /v1/candidates`: those that a fix searches.

use super::dto::{CandidatesJson, FixParametersJson};
use super::error::ServerError;
use super::fix_request::fix_request;
use super::json_body::JsonBody;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::query::{Query, QueryError};
use super::served::Served;
use super::work::WorkClass;
use axum::Json;
use axum::body::Body;
use axum::extract::RawQuery;
use axum::http::HeaderMap;
use overfly_flight::locate::candidates::{CandidateParameters, named_layer, searched_candidates};

/// Largest request for the candidates of a fix.
const MOST_BYTES: usize = 64 << 10;

/// The parameters of this path.
pub(super) const PARAMETERS: &[&str] = &[
    "latitude_deg",
    "longitude_deg",
    "heading_deg",
    "across_m",
    "along_m",
    "inaccuracy_m",
    "drift_m",
    "sigma_east_m",
    "sigma_north_m",
    "correlation",
    "mode",
    "unit_drift_m",
    "execution_s",
    "relative_s",
    "speed_mps",
    "min_turn_radius_m",
    "layer",
    "max_tiles",
    "gsd_m_per_px",
];

/// The tiles to search for a position and its uncertainty, best first.
///
/// Each `mode` has its own parameters. `sequential` takes `inaccuracy_m` and `drift_m` (the rectangle of equation 3), or
/// `sigma_east_m` and `sigma_north_m` instead (the 99.7 % ellipse dilated by the image's footprint); `parallel` takes `inaccuracy_m`,
/// `unit_drift_m`, `execution_s` and `relative_s` (equation 17); `combined` takes `inaccuracy_m`, `speed_mps`, `execution_s` and
/// `min_turn_radius_m` (all ground that the image can show after flying for exactly `execution_s` from the given position). The answer
/// has every tile that meets the region.
#[utoipa::path(
    get, path = "/v1/candidates", operation_id = "candidates", tag = "search",
    params(
        ("latitude_deg" = f64, Query, description = "Most likely position of the image's centre, degrees north; mode=combined: the position of the last fix", minimum = -85.051128, maximum = 85.051128, example = 47.66),
        ("longitude_deg" = f64, Query, description = "Longitude of that point, degrees east", minimum = -180.0, maximum = 180.0, example = -99.27),
        ("heading_deg" = f64, Query, description = "Direction of the image's upper edge, degrees clockwise from true north, less than 360; mode=combined: the heading at the last fix", minimum = 0.0, maximum = 360.0, example = 90.0),
        ("across_m" = f64, Query, description = "a: the image's ground extent across the heading, metres, more than 0", minimum = 0.0, example = 1400.0),
        ("along_m" = f64, Query, description = "b: the image's ground extent along the heading, metres, more than 0", minimum = 0.0, example = 1050.0),
        ("inaccuracy_m" = Option<f64>, Query, description = "I: full width of the last fix's error, metres; all modes", minimum = 0.0, example = 30.0),
        ("drift_m" = Option<f64>, Query, description = "D_T: drift since the last fix, one-sided, metres; mode=sequential", minimum = 0.0, example = 300.0),
        ("sigma_east_m" = Option<f64>, Query, description = "Instead of inaccuracy and drift, mode=sequential: one standard deviation towards east, metres, more than 0", minimum = 0.0),
        ("sigma_north_m" = Option<f64>, Query, description = "One standard deviation towards north, metres, more than 0", minimum = 0.0),
        ("correlation" = Option<f64>, Query, description = "Correlation of east and north; 0 by default; mode=sequential", minimum = -0.999999, maximum = 0.999999),
        ("mode" = Option<String>, Query, description = "`sequential` (default), `parallel` or `combined`"),
        ("unit_drift_m" = Option<f64>, Query, description = "D_U: drift of one relative registration, one-sided, metres; mode=parallel", minimum = 0.0),
        ("execution_s" = Option<f64>, Query, description = "t_exe: how long the absolute registration before this search ran, seconds, more than 0; mode=parallel and mode=combined", minimum = 0.0),
        ("relative_s" = Option<f64>, Query, description = "t0: time of one relative registration, seconds, more than 0; mode=parallel", minimum = 0.0),
        ("speed_mps" = Option<f64>, Query, description = "v: ground speed, metres per second, more than 0; mode=combined", minimum = 0.0),
        ("min_turn_radius_m" = Option<f64>, Query, description = "R_min: smallest turn radius, metres, more than 0; mode=combined", minimum = 0.0),
        ("layer" = Option<String>, Query, description = "The layer to search; by default the only one, or `ortho`"),
        ("max_tiles" = Option<u64>, Query, description = "Return only the best tiles, at most this many", minimum = 1),
        ("gsd_m_per_px" = Option<f64>, Query, description = "Search the coarsest level whose pixels are no larger than this; the base level by default", minimum = 0.0),
    ),
    responses(
        (status = 200, description = "The tiles that meet the region, best first", body = CandidatesJson),
        (status = "4XX", description = "A parameter is unknown, missing, repeated, not finite or out of range", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn get(Served(state): Served, RawQuery(raw): RawQuery) -> Result<Json<CandidatesJson>, ServerError> {
    let query = parameters(&Query::read(raw.as_deref(), PARAMETERS)?)?.query()?;
    let (store, residents) = (state.store.reader.clone(), state.store.residents.clone());
    let found = state.work.run(WorkClass::Short, move || residents.candidates(&store, &query)).await??;
    Ok(Json(found.into()))
}

/// The tiles that a fix with the same `request` searches, best first.
///
/// Takes what `POST /v1/fixes` takes as `request`, but no layer `any`; `height_m` and `camera` are required, for there is no image. `region` is the ground
/// that the fix compares: its position prior, widened by the uncertainty of pitch and roll, and by the footprint of a frame.
/// Probabilities are of the nadir, which is the point that the fix answers. A fix that is refused without a search (outside the
/// map, or the camera sees the horizon) searches no tile.
#[utoipa::path(
    post, path = "/v1/candidates", operation_id = "candidates_of_fix", tag = "search", request_body = FixParametersJson,
    responses(
        (status = 200, description = "The tiles that a fix searches, best first", body = CandidatesJson),
        (status = "4XX", description = "The request is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(
    Served(state): Served,
    _: NoQuery,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<CandidatesJson>, ServerError> {
    let body = JsonBody::read(&state, &headers, body, MOST_BYTES).await?;
    let parameters: FixParametersJson = body.object()?;
    let (store, most) = (state.store.reader.clone(), state.limits.tiles);
    let found = state
        .work
        .run(WorkClass::Query, move || -> Result<_, ServerError> {
            let request = fix_request(&store, &parameters)?;
            named_layer(&store, &request.layer)?;
            Ok(searched_candidates(&store, &request, most)?)
        })
        .await??;
    Ok(Json(found.into()))
}

fn parameters(query: &Query) -> Result<CandidateParameters, QueryError> {
    Ok(CandidateParameters {
        latitude_deg: query.number("latitude_deg")?,
        longitude_deg: query.number("longitude_deg")?,
        heading_deg: query.number("heading_deg")?,
        across_m: query.number("across_m")?,
        along_m: query.number("along_m")?,
        inaccuracy_m: query.number("inaccuracy_m")?,
        drift_m: query.number("drift_m")?,
        sigma_east_m: query.number("sigma_east_m")?,
        sigma_north_m: query.number("sigma_north_m")?,
        correlation: query.number("correlation")?,
        mode: query.text("mode")?,
        unit_drift_m: query.number("unit_drift_m")?,
        execution_s: query.number("execution_s")?,
        relative_s: query.number("relative_s")?,
        speed_mps: query.number("speed_mps")?,
        min_turn_radius_m: query.number("min_turn_radius_m")?,
        layer: query.text("layer")?,
        max_tiles: query.whole("max_tiles")?,
        gsd_m_per_px: query.number("gsd_m_per_px")?,
    })
}
