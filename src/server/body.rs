//! Bodies that are read whole, within limits of size and time, their memory reserved before it is taken.

use super::error::ServerError;
use super::form_error::FormError;
use super::state::ServiceState;
use super::work::Upload;
use axum::body::{Body, Bytes, to_bytes};
use axum::http::HeaderMap;
use axum::http::header::{CONTENT_LENGTH, CONTENT_TYPE};
use http_body_util::LengthLimitError;
use std::error::Error;

/// A body in memory. Its memory is reserved until it is dropped.
#[derive(Debug)]
pub(super) struct WholeBody {
    /// The content.
    pub bytes: Bytes,
    _place: Upload,
}

impl WholeBody {
    /// Reads a JSON text of at most `limit_bytes`.
    ///
    /// # Errors
    /// [`FormError`], or [`ServerError::Busy`].
    pub(super) async fn read_json(
        state: &ServiceState,
        headers: &HeaderMap,
        body: Body,
        limit_bytes: usize,
    ) -> Result<Self, ServerError> {
        let media_type = headers.get(CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
        if !media_type.trim_start().to_ascii_lowercase().starts_with("application/json") {
            let reason = "expected the header `Content-Type: application/json`".to_owned();
            return Err(FormError::NotJson { name: "body", reason }.into());
        }
        let limit_bytes = limit_bytes.min(state.limits.body_bytes);
        let stated = headers.get(CONTENT_LENGTH).and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok());
        if stated.is_some_and(|stated: usize| stated > limit_bytes) {
            return Err(FormError::TooLarge { limit_bytes }.into());
        }
        let place = state.work.upload(stated.unwrap_or(limit_bytes))?;
        let time = state.limits.body_time;
        let bytes = tokio::time::timeout(time, to_bytes(body, limit_bytes))
            .await
            .map_err(|_| FormError::TooSlow { limit_s: time.as_secs_f64() })?
            .map_err(|e| match e.source() {
                Some(cause) if cause.is::<LengthLimitError>() => FormError::TooLarge { limit_bytes },
                _ => FormError::Broken { reason: e.to_string() },
            })?;
        Ok(Self { bytes, _place: place })
    }
}
