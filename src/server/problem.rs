//! `Problem`: a problem document (RFC 9457).

use super::problem_code::ProblemCode;
use axum::Json;
use axum::http::header::{CACHE_CONTROL, CONNECTION, CONTENT_TYPE, RETRY_AFTER};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

/// The media type of problem documents.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// A problem document (RFC 9457): `code` is for programs, `detail` for people.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Problem {
    /// Always `about:blank`: the status and `code` name the problem.
    #[schema(example = "about:blank")]
    pub r#type: &'static str,
    /// The phrase of the status.
    #[schema(example = "Bad Request")]
    pub title: &'static str,
    /// The HTTP status.
    #[schema(example = 400)]
    pub status: u16,
    /// A stable code word for the problem.
    #[schema(value_type = ProblemCode)]
    pub code: &'static str,
    /// What happened and what to do.
    #[schema(example = "drift_m = -1: expected metres, at least 0 and finite")]
    pub detail: String,
    /// The query parameter, JSON key or form part that is not valid, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "drift_m")]
    pub parameter: Option<String>,
}

impl Problem {
    /// The document for a status, with the phrase of that status.
    pub(super) fn new(status: StatusCode, code: &'static str, detail: String, parameter: Option<String>) -> Self {
        let title = status.canonical_reason().unwrap_or("Error");
        Self { r#type: "about:blank", title, status: status.as_u16(), code, detail, parameter }
    }
}

/// Marks the answer of a handler that panicked, so that panics are counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panicked;

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).expect("made from a status");
        let mut response = (status, Json(self)).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
        if status == StatusCode::SERVICE_UNAVAILABLE {
            headers.insert(RETRY_AFTER, HeaderValue::from_static("1"));
            // The body may not have been read, so the connection cannot serve another request.
            headers.insert(CONNECTION, HeaderValue::from_static("close"));
        }
        response
    }
}
