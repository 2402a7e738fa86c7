//! `/v1/exports`: cuts out what one flight needs, for the aircraft's storage. On the ground only.

use super::binary::stated_media_type;
use super::dto::{ExportAnswer, ExportEntry, ExportParameters, ExportPreview, ExportProgress};
use super::entity_tag::{etag, unchanged};
use super::error::ServerError;
use super::export_job::export_failure;
use super::export_jobs::{ExportJob, ExportJobs};
use super::json_body::JsonBody;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::range::RequestedRange;
use super::served::Served;
use super::service::Service;
use super::state::ServiceState;
use super::work::WorkClass;
use crate::today::today;
use axum::body::Body;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_RANGE, ETAG, IF_RANGE, LOCATION, RANGE};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::any;
use axum::{Extension, Json};
use overfly_ingest::export::{ExportError, ExportRequest, preview};
use overfly_ingest::plan::parse_routes;
use overfly_store::package::parse_date;
use std::path::Path as FilePath;
use std::sync::Arc;
use tower_http::services::ServeFile;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// The media type of GeoPackages (IANA).
const GEOPACKAGE: &str = "application/geopackage+sqlite3";

/// Largest request: a route of 200,000 positions.
const MOST_BYTES: usize = 12 << 20;

/// The exports of this service; `None` if no temporary folder could be made for them.
type Jobs = Extension<Option<Arc<ExportJobs>>>;

/// The routes: none onboard. On the ground the exports get a temporary folder; if none can be made, the routes answer 404 and the
/// log says why.
pub(super) fn routes(state: &ServiceState) -> OpenApiRouter<ServiceState> {
    match state.service {
        // Not described: these paths do not exist onboard. They say where they do.
        Service::Onboard => {
            let elsewhere = || async { ServerError::OnGroundOnly };
            OpenApiRouter::new().route("/v1/exports", any(elsewhere)).route("/v1/exports/{id}", any(elsewhere))
        }
        Service::Preflight => {
            let jobs = ExportJobs::new(state.limits.exports)
                .inspect_err(|e| tracing::warn!("no exports over HTTP: no temporary folder can be made: {e}"));
            OpenApiRouter::new().routes(routes!(post, list)).routes(routes!(get, delete)).layer(Extension(jobs.ok()))
        }
    }
}

/// Begins an export, or answers what it would take (`dry_run`). The export is not signed; `overfly export --sign` does that on the machine that has the key.
#[utoipa::path(
    post, path = "/v1/exports", operation_id = "begin_export", tag = "exports", request_body = ExportParameters,
    responses(
        (status = 200, description = "The export exists already: fetch it at its `Location`; or the answer to a dry run", body = ExportAnswer),
        (status = 202, description = "The export has begun or is running: ask for it at its `Location`", body = ExportProgress),
        (status = "4XX", description = "The request is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(
    Served(state): Served,
    jobs: Jobs,
    _: NoQuery,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, ServerError> {
    let body = JsonBody::read(&state, &headers, body, MOST_BYTES).await?;
    let parsed = state.work.run(WorkClass::Parsing, move || parse(&body)).await?;
    let (parameters, request) = parsed?;
    for name in &parameters.layers {
        state.store.reader.layer(name)?;
    }
    request.check_dates(&state.store.reader, today()).map_err(dates_error)?;
    if parameters.dry_run {
        return Ok(Json(ExportAnswer::Preview(dry_run(&state, request).await?)).into_response());
    }
    let progress = available(jobs)?.begin(&state.store.reader, request)?;
    let status = if progress.done { StatusCode::OK } else { StatusCode::ACCEPTED };
    let location = format!("/v1/exports/{}", progress.id);
    Ok((status, [(LOCATION, location)], Json(ExportAnswer::Begun(progress))).into_response())
}

/// The refusal of a last day that has passed. Nothing is signed here, so no other date is checked.
fn dates_error(error: ExportError) -> ServerError {
    ServerError::Parameter { name: "valid_until", reason: error.to_string() }
}

async fn dry_run(state: &ServiceState, request: ExportRequest) -> Result<ExportPreview, ServerError> {
    let store = state.store.reader.clone();
    let found = state.work.run(WorkClass::Parsing, move || {
        preview(&store, &request).map_err(|error| ServerError::Export(export_failure(&error, [store.path(); 2])))
    });
    Ok(found.await??.into())
}

/// The exports that the service holds, the one begun first first. Of too many or too old ones the first are removed.
#[utoipa::path(
    get, path = "/v1/exports", operation_id = "exports", tag = "exports",
    responses((status = 200, description = "The exports", body = Vec<ExportEntry>))
)]
pub(super) async fn list(jobs: Jobs, _: NoQuery) -> Result<Json<Vec<ExportEntry>>, ServerError> {
    Ok(Json(available(jobs)?.list()))
}

/// Removes an export and its file. A download that has begun goes on.
#[utoipa::path(
    delete, path = "/v1/exports/{id}", operation_id = "delete_export", tag = "exports",
    params(("id" = String, Path, description = "The name from the answer of `POST /v1/exports`")),
    responses(
        (status = 204, description = "It is removed"),
        (status = "4XX", description = "No such export, or it is being written", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn delete(
    jobs: Jobs,
    id: Result<Path<String>, PathRejection>,
    _: NoQuery,
) -> Result<StatusCode, ServerError> {
    let Path(id) = id.map_err(|e| ServerError::Path(e.body_text()))?;
    available(jobs)?.delete(&id)?;
    Ok(StatusCode::NO_CONTENT)
}

/// The file of an export, whole or in ranges; its progress while it is being written; or why it failed.
#[utoipa::path(
    get, path = "/v1/exports/{id}", operation_id = "export", tag = "exports",
    params(
        ("id" = String, Path, description = "The name from the answer of `POST /v1/exports`"),
        ("range" = Option<String>, Header, description = "A range of bytes: the answer is 206 with these bytes"),
    ),
    responses(
        (status = 200, description = "The GeoPackage; its ETag is the digest in its seal", content((Vec<u8> = "application/geopackage+sqlite3"), (Vec<u8> = "application/octet-stream"))),
        (status = 202, description = "The export is being written: ask again", body = ExportProgress),
        (status = 206, description = "The requested range", content((Vec<u8> = "application/geopackage+sqlite3"), (Vec<u8> = "application/octet-stream"))),
        (status = "4XX", description = "No such export, or the export is not possible", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn get(
    jobs: Jobs,
    id: Result<Path<String>, PathRejection>,
    _: NoQuery,
    request: Request,
) -> Result<Response, ServerError> {
    let Path(id) = id.map_err(|e| ServerError::Path(e.body_text()))?;
    match available(jobs)?.find(&id)? {
        ExportJob::UnderWay(progress) => Ok((StatusCode::ACCEPTED, Json(progress)).into_response()),
        ExportJob::Done { path, file_digest } => file(&path, &id, &file_digest, request).await,
    }
}

fn available(jobs: Jobs) -> Result<Arc<ExportJobs>, ServerError> {
    jobs.0.ok_or(ServerError::NoRoute)
}

async fn file(path: &FilePath, id: &str, file_digest: &str, mut request: Request) -> Result<Response, ServerError> {
    let tag = etag(file_digest);
    if unchanged(request.headers(), &tag) {
        return Ok((StatusCode::NOT_MODIFIED, [(ETAG, tag)]).into_response());
    }
    let failed = |e| overfly_store::StoreError::io(path, e);
    let len = tokio::fs::metadata(path).await.map_err(failed)?.len();
    let headers = request.headers_mut();
    // A download of another file is not continued (RFC 9110, section 13.1.5).
    let same = headers.get(IF_RANGE).is_none_or(|begun| *begun == tag.as_str());
    let range = headers.get(RANGE).filter(|_| same).and_then(|range| range.to_str().ok());
    let asked = RequestedRange::parse(range, len);
    let media_type = stated_media_type(headers, GEOPACKAGE).to_owned();
    // The range is decided here; the other headers must not change it.
    headers.clear();
    match asked {
        RequestedRange::Beyond => return Ok(beyond(len)),
        RequestedRange::Whole => {}
        RequestedRange::Part(first, last) => {
            headers.insert(RANGE, HeaderValue::from_str(&format!("bytes={first}-{last}")).expect("digits"));
        }
    }
    let mime = media_type.parse().expect("a media type");
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

/// Parses a body: what was asked, and what the library is to do.
fn parse(body: &JsonBody) -> Result<(ExportParameters, ExportRequest), ServerError> {
    let parameters: ExportParameters = body.object()?;
    let request = request(&parameters)?;
    Ok((parameters, request))
}

fn request(parameters: &ExportParameters) -> Result<ExportRequest, ServerError> {
    let wrong = |name, reason: String| ServerError::Parameter { name, reason };
    let routes = parse_routes(parameters.route.get()).map_err(|reason| wrong("route", reason))?;
    if !(parameters.corridor_m.is_finite() && parameters.corridor_m > 0.0) {
        return Err(wrong("corridor_m", "expected metres, more than 0".into()));
    }
    if parameters.jpeg_quality.is_some_and(|q| !(1..=100).contains(&q)) {
        return Err(wrong("jpeg_quality", "expected 1 to 100".into()));
    }
    let valid_until = parameters.valid_until.as_deref().map(parse_date).transpose();
    Ok(ExportRequest {
        layers: parameters.layers.clone(),
        max_bytes: not_negative("max_bytes", parameters.max_bytes)?,
        jpeg_quality: parameters.jpeg_quality,
        valid_until: valid_until.map_err(|reason| wrong("valid_until", reason))?,
        name: parameters.name.clone(),
        serial: not_negative("serial", parameters.serial)?,
        ..ExportRequest::along(routes, parameters.corridor_m)
    })
}

fn not_negative(name: &'static str, value: Option<i64>) -> Result<Option<u64>, ServerError> {
    let negative = |_| ServerError::Parameter { name, reason: "expected a whole number of at least 0".into() };
    value.map(|value| u64::try_from(value).map_err(negative)).transpose()
}
