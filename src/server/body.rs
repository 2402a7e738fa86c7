//! Bodies of requests: their memory is reserved as it is taken, and they arrive in time.

use super::error::ServerError;
use super::form_error::FormError;
use super::metered_body::Meter;
use super::state::ServiceState;
use axum::body::Body;
use axum::http::HeaderMap;
use axum::http::header::CONTENT_LENGTH;
use std::future::Future;

/// The length that the headers of a request state, bytes.
pub(super) fn stated_bytes(headers: &HeaderMap) -> Option<usize> {
    headers.get(CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

/// Begins to count a body of at most `most_bytes`. Returns the body to read in its place.
///
/// # Errors
/// [`ServerError::Busy`].
pub(super) fn metered(
    state: &ServiceState,
    headers: &HeaderMap,
    most_bytes: usize,
    body: Body,
) -> Result<(Body, Meter), ServerError> {
    let bytes = stated_bytes(headers).unwrap_or(most_bytes).min(most_bytes);
    Meter::begin(&state.work, &state.limits, bytes, body)
}

/// Waits for a body as long as the limits allow.
///
/// # Errors
/// [`FormError::TooSlow`], or that of the reading.
pub(super) async fn in_time<T>(
    state: &ServiceState,
    reading: impl Future<Output = Result<T, FormError>>,
) -> Result<T, FormError> {
    let time = state.limits.body_time;
    let read = tokio::time::timeout(time, reading).await;
    read.unwrap_or(Err(FormError::TooSlow { limit_s: time.as_secs_f64() }))
}
