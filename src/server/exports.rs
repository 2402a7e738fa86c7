//! `POST /v1/exports`, `GET /v1/exports/{id}`: what one flight needs, for the aircraft's storage. On the ground only.

use super::entity_tag::{etag, unchanged};
use super::error::ServerError;
use super::export_jobs::{ExportJobs, Found};
use super::form::FormError;
use super::problem::Problem;
use super::query::NoQuery;
use super::range::Asked;
use super::state::ServiceState;
use axum::Json;
use axum::extract::rejection::{JsonRejection, PathRejection};
use axum::extract::{Path, Request, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_RANGE, ETAG, IF_RANGE, LOCATION, RANGE};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use overfly_ingest::export::ExportRequest;
use overfly_ingest::plan::parse_routes;
use overfly_store::package::parse_date;
use serde::{Deserialize, Serialize};
use std::path::Path as FilePath;
use tower_http::services::ServeFile;
use utoipa::ToSchema;

/// The media type of GeoPackages (IANA).
const GEOPACKAGE: &str = "application/geopackage+sqlite3";

/// What shall be exported: as `overfly export` takes it.
#[derive(Debug, Clone, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ExportParameters {
    /// GeoJSON with LineStrings, longitude first: the planned route, then its alternates.
    #[schema(value_type = Object)]
    pub route: serde_json::Value,
    /// W: the corridor on each side of the route, metres.
    #[schema(example = 1500.0)]
    pub corridor_m: f64,
    /// Layers to take; all where none is named.
    #[serde(default)]
    pub layers: Vec<String>,
    /// Most bytes of the file.
    pub max_bytes: Option<u64>,
    /// The JPEG quality, 1 to 100, to encode imagery with anew.
    #[schema(minimum = 1, maximum = 100)]
    pub jpeg_quality: Option<u8>,
    /// The last day on which it may be flown, YYYY-MM-DD.
    pub valid_until: Option<String>,
}

impl ExportParameters {
    fn request(&self) -> Result<ExportRequest, ServerError> {
        let wrong = |name, reason: String| ServerError::Parameter { name, reason };
        let routes = parse_routes(&self.route.to_string()).map_err(|reason| wrong("route", reason))?;
        if !(self.corridor_m.is_finite() && self.corridor_m > 0.0) {
            return Err(wrong("corridor_m", "expected metres, more than 0".into()));
        }
        if self.jpeg_quality.is_some_and(|q| !(1..=100).contains(&q)) {
            return Err(wrong("jpeg_quality", "expected 1 to 100".into()));
        }
        let valid_until = self.valid_until.as_deref().map(parse_date).transpose();
        Ok(ExportRequest {
            layers: self.layers.clone(),
            max_bytes: self.max_bytes,
            jpeg_quality: self.jpeg_quality,
            valid_until: valid_until.map_err(|reason| wrong("valid_until", reason))?,
            ..ExportRequest::along(routes, self.corridor_m)
        })
    }
}

/// How far an export is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ExportProgress {
    /// Its name: of the store's digest and the request, so that asking for the same again is answered by the same file.
    pub id: String,
    /// Whether the file is there to be fetched.
    pub done: bool,
    /// Tiles written.
    pub tiles_done: u64,
    /// Tiles to write; 0 while they are being chosen.
    pub tiles: u64,
}

/// Begins an export. It is not signed: `overfly export --sign` does that, where the key is.
#[utoipa::path(
    post, path = "/v1/exports", tag = "exports", request_body = ExportParameters,
    responses(
        (status = 200, description = "It is there already: fetch it at its `Location`", body = ExportProgress),
        (status = 202, description = "Begun, or under way: its `Location` is where to ask for it", body = ExportProgress),
        (status = "4XX", description = "The request is at fault", body = Problem, content_type = "application/problem+json"),
        (status = "5XX", description = "The service is at fault, or writes another export", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(
    State(state): State<ServiceState>,
    _: NoQuery,
    body: Result<Json<ExportParameters>, JsonRejection>,
) -> Result<Response, ServerError> {
    let limit_bytes = state.limits.body_bytes;
    let Json(parameters) = body.map_err(|e| match e.status() {
        StatusCode::PAYLOAD_TOO_LARGE => FormError::TooLarge { limit_bytes },
        _ => FormError::NotJson { name: "body", reason: e.body_text() },
    })?;
    let request = parameters.request()?;
    for name in &parameters.layers {
        state.store.layer(name)?;
    }
    let progress = jobs(&state)?.begin(&state.store, &parameters, request)?;
    let status = if progress.done { StatusCode::OK } else { StatusCode::ACCEPTED };
    let location = format!("/v1/exports/{}", progress.id);
    Ok((status, [(LOCATION, location)], Json(progress)).into_response())
}

/// An export's file, whole or in ranges; how far it is while it is being written; or why it failed.
#[utoipa::path(
    get, path = "/v1/exports/{id}", tag = "exports",
    params(
        ("id" = String, Path, description = "As `POST /v1/exports` named it"),
        ("range" = Option<String>, Header, description = "A range of bytes: 206 with them"),
    ),
    responses(
        (status = 200, description = "The GeoPackage; its ETag is the digest that its seal states", content_type = "application/geopackage+sqlite3"),
        (status = 202, description = "It is being written: ask again", body = ExportProgress),
        (status = 206, description = "The range", content_type = "application/geopackage+sqlite3"),
        (status = "4XX", description = "No such export, or what was asked for cannot be exported", body = Problem, content_type = "application/problem+json"),
        (status = "5XX", description = "The export failed", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn get(
    State(state): State<ServiceState>,
    id: Result<Path<String>, PathRejection>,
    _: NoQuery,
    request: Request,
) -> Result<Response, ServerError> {
    let Path(id) = id.map_err(|e| ServerError::Path(e.body_text()))?;
    match jobs(&state)?.find(&id)? {
        Found::UnderWay(progress) => Ok((StatusCode::ACCEPTED, Json(progress)).into_response()),
        Found::Done { path, file_digest } => file(&path, &id, &file_digest, request).await,
    }
}

fn jobs(state: &ServiceState) -> Result<&ExportJobs, ServerError> {
    state.exports.as_deref().ok_or(ServerError::NoRoute)
}

async fn file(path: &FilePath, id: &str, file_digest: &str, mut request: Request) -> Result<Response, ServerError> {
    let tag = etag(file_digest);
    if unchanged(request.headers(), &tag) {
        return Ok((StatusCode::NOT_MODIFIED, [(ETAG, tag)]).into_response());
    }
    let failed = |e| overfly_store::StoreError::io(path, e);
    let len = tokio::fs::metadata(path).await.map_err(failed)?.len();
    let headers = request.headers_mut();
    // What was begun of another file is not gone on with (RFC 9110, 13.1.5).
    let same = headers.get(IF_RANGE).is_none_or(|begun| *begun == tag.as_str());
    let range = headers.get(RANGE).filter(|_| same).and_then(|range| range.to_str().ok());
    let asked = Asked::of(range, len);
    // What is asked is decided here; the rest of the headers shall not decide it otherwise.
    headers.clear();
    match asked {
        Asked::Beyond => return Ok(beyond(len)),
        Asked::Whole => {}
        Asked::Part(first, last) => {
            headers.insert(RANGE, HeaderValue::from_str(&format!("bytes={first}-{last}")).expect("digits"));
        }
    }
    let mime = GEOPACKAGE.parse().expect("a media type");
    let mut response = ServeFile::new_with_mime(path, &mime).try_call(request).await.map_err(failed)?.into_response();
    let short = id.get(..12).unwrap_or(id);
    let name = format!("attachment; filename=\"overfly-{short}.gpkg\"");
    for (header, value) in [(ETAG, tag), (CONTENT_DISPOSITION, name)] {
        response.headers_mut().insert(header, HeaderValue::from_str(&value).expect("digits and letters"));
    }
    Ok(response)
}

fn beyond(len: u64) -> Response {
    let detail = format!("the file ends at byte {len}");
    let problem = Problem::new(StatusCode::RANGE_NOT_SATISFIABLE, "range_not_satisfiable", detail, None);
    let place = HeaderValue::from_str(&format!("bytes */{len}")).expect("digits");
    let mut response = problem.into_response();
    response.headers_mut().insert(CONTENT_RANGE, place);
    response
}
