//! `POST /v1/fixes`: runs one absolute registration.

use super::dto::{AnswerJson, FixParametersJson};
use super::error::ServerError;
use super::fix_request::fix_request;
use super::form::Form;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::served::Served;
use super::state::ServiceState;
use super::work::WorkClass;
use axum::Json;
use axum::extract::Request;
use overfly_core::integrity::{DEFAULT_INTEGRITY_RISK, INTEGRITY_RISKS};
use overfly_core::pixels::Gray;
use overfly_flight::locate::{Answer, CancellationToken, FixRequest, Hints, hints, locate_cancellable};
use std::time::{Duration, Instant};

/// How long hints are searched for if the request does not say.
const HINTS_TIME: Duration = Duration::from_secs(2);
/// What remains of the time for an answer when the search for hints ends: it is cancelled within a second.
const RESERVE: Duration = Duration::from_secs(3);

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
/// "No fix" is an answer (status 200), never an error. With `hints`, it says which statement of the request to check.
#[utoipa::path(
    post, path = "/v1/fixes", operation_id = "fix", tag = "registration",
    request_body(content = FixForm, content_type = "multipart/form-data"),
    responses(
        (status = 200, description = "A fix, or no fix with the reason", body = AnswerJson),
        (status = "4XX", description = "The request is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(Served(state): Served, _: NoQuery, request: Request) -> Result<Json<AnswerJson>, ServerError> {
    let mut form = Form::read(&state, request, &["image", "request"]).await?;
    let parameters: FixParametersJson = form.json("request")?;
    let bytes = form.take("image")?;
    let integrity_risk = integrity_risk(&parameters)?;
    let hints_time = hints_time(&parameters, state.limits.hints_time)?;
    let (work, metrics) = (state.work.clone(), state.metrics.clone());
    let until = Instant::now() + state.limits.answer_time;
    let answer = work
        .run_cancellable(WorkClass::Registration, move |cancellation| -> Result<AnswerJson, ServerError> {
            let request = fix_request(&state.store.reader, &parameters)?;
            let frame = state.limits.frame("image", &bytes)?;
            let start = Instant::now();
            let answer = locate_cancellable(&state.store.reader, &frame, &request, state.limits.threads, cancellation)?;
            let elapsed_ms = start.elapsed().as_micros() as f64 / 1e3;
            let hints = match (&answer, hints_time) {
                (Answer::NoFix(_), Some(most)) => {
                    let left = until.saturating_duration_since(Instant::now() + RESERVE);
                    Some(searched_hints(&state, &frame, &request, most.min(left), cancellation))
                }
                _ => None,
            };
            Ok(AnswerJson::new(answer, elapsed_ms, integrity_risk).with_hints(hints, str::to_owned))
        })
        .await??;
    metrics.count_fix(&answer);
    Ok(Json(answer))
}

/// The risk of the answer's protection level.
///
/// # Errors
/// [`ServerError::Parameter`].
fn integrity_risk(parameters: &FixParametersJson) -> Result<f64, ServerError> {
    let risk = parameters.integrity_risk.unwrap_or(DEFAULT_INTEGRITY_RISK);
    if INTEGRITY_RISKS.contains(&risk) {
        return Ok(risk);
    }
    Err(ServerError::Parameter { name: "integrity_risk", reason: format!("{risk}: must be in [1e-9, 0.5]") })
}

/// How long to search for hints: `None` if the request does not ask for any.
///
/// # Errors
/// [`ServerError::Parameter`].
fn hints_time(parameters: &FixParametersJson, most: Duration) -> Result<Option<Duration>, ServerError> {
    let refused = |reason: String| ServerError::Parameter { name: "hints_limit_s", reason };
    match parameters.hints_limit_s {
        Some(_) if !parameters.hints => Err(refused("needs hints = true".to_owned())),
        Some(limit_s) if !(0.0..=most.as_secs_f64()).contains(&limit_s) => {
            Err(refused(format!("{limit_s}: must be in [0, {}], seconds", most.as_secs_f64())))
        }
        Some(limit_s) => Ok(Some(Duration::from_secs_f64(limit_s))),
        None => Ok(parameters.hints.then(|| HINTS_TIME.min(most))),
    }
}

/// The hints that are found within `most`, and before another registration waits. A store that fails meanwhile gives none: the answer
/// is there already.
fn searched_hints(
    state: &ServiceState,
    frame: &Gray,
    request: &FixRequest,
    most: Duration,
    cancellation: &CancellationToken,
) -> Hints {
    let optional = state.work.begin_optional(cancellation);
    let found = hints(&state.store.reader, frame, request, state.limits.threads, most, optional.token());
    found.unwrap_or_else(|error| {
        tracing::warn!(code = error.code(), "no hints: {error}");
        Hints { found: Vec::new(), is_complete: false }
    })
}
