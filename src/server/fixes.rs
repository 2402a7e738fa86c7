//! `POST /v1/fixes`: runs one absolute registration.

use super::dto::{AnswerJson, FixParametersJson};
use super::error::ServerError;
use super::form::Form;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::served::Served;
use super::work::WorkClass;
use axum::Json;
use axum::extract::Request;
use overfly_flight::locate::{FixParameters, locate_cancellable, requested_layer};
use std::time::Instant;

/// The form of a fix.
#[derive(utoipa::ToSchema)]
#[allow(dead_code)]
pub(super) struct FixForm {
    /// The frame: PNG, JPEG or WebP.
    #[schema(value_type = String, format = Binary)]
    image: Vec<u8>,
    /// What is known of the frame, as JSON.
    request: FixParametersJson,
}

/// Locates a camera frame on the map.
///
/// "No fix" is an answer (status 200), never an error.
#[utoipa::path(
    post, path = "/v1/fixes", operation_id = "fix", tag = "registration",
    request_body(content = FixForm, content_type = "multipart/form-data"),
    responses(
        (status = 200, description = "A fix, or no fix with the reason", body = AnswerJson),
        (status = "4XX", description = "The request is not valid", body = Problem, content_type = "application/problem+json"),
        (status = "5XX", description = "The service failed or is busy", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(Served(state): Served, _: NoQuery, request: Request) -> Result<Json<AnswerJson>, ServerError> {
    let mut form = Form::read(&state, request, &["image", "request"]).await?;
    let parameters: FixParametersJson = form.json("request")?;
    let bytes = form.take("image")?;
    let work = state.work.clone();
    let answer = work
        .run_cancellable(WorkClass::Registration, move |cancellation| -> Result<AnswerJson, ServerError> {
            let layer = requested_layer(&state.store.reader, parameters.layer.as_deref())?;
            let request = FixParameters::from(&parameters).request(&layer)?;
            let frame = state.limits.frame("image", &bytes)?;
            let start = Instant::now();
            let answer = locate_cancellable(&state.store.reader, &frame, &request, state.limits.threads, cancellation)?;
            Ok(AnswerJson::new(answer, start.elapsed().as_micros() as f64 / 1e3))
        })
        .await??;
    Ok(Json(answer))
}
