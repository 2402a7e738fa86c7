//! `JsonBody`: a JSON text, read whole.

use super::body::{in_time, metered, stated_bytes};
use super::error::ServerError;
use super::form_error::FormError;
use super::json_object::object;
use super::state::ServiceState;
use super::work::Upload;
use axum::body::{Body, Bytes, to_bytes};
use axum::http::HeaderMap;
use axum::http::header::CONTENT_TYPE;
use http_body_util::LengthLimitError;
use serde::de::DeserializeOwned;
use std::error::Error;

/// A JSON text in memory, which is reserved until it is dropped. Whether it is JSON is not known yet.
#[derive(Debug)]
pub(super) struct JsonBody {
    bytes: Bytes,
    _place: Upload,
}

impl JsonBody {
    /// Reads a body of at most `most_bytes`.
    ///
    /// # Errors
    /// [`FormError`], or [`ServerError::Busy`].
    pub(super) async fn read(
        state: &ServiceState,
        headers: &HeaderMap,
        body: Body,
        most_bytes: usize,
    ) -> Result<Self, ServerError> {
        if !is_json(headers) {
            let reason = "expected the header `Content-Type: application/json`".to_owned();
            return Err(FormError::NotJson { name: "body", reason }.into());
        }
        let limit_bytes = most_bytes.min(state.limits.body_bytes);
        if stated_bytes(headers).is_some_and(|stated| stated > limit_bytes) {
            return Err(FormError::TooLarge { limit_bytes }.into());
        }
        let (body, meter) = metered(state, headers, limit_bytes, body)?;
        let broken = |e: axum::Error| match e.source() {
            Some(cause) if cause.is::<LengthLimitError>() => FormError::TooLarge { limit_bytes },
            _ => FormError::Broken { reason: e.to_string() },
        };
        let read = in_time(state, async { to_bytes(body, limit_bytes).await.map_err(broken) }).await;
        let (bytes, place) = meter.finish(read)?;
        Ok(Self { bytes, _place: place })
    }

    /// Parses the text, which must be an object: Serde also takes a list for a struct.
    ///
    /// # Errors
    /// [`FormError::NotJson`].
    pub(super) fn object<T: DeserializeOwned>(&self) -> Result<T, FormError> {
        object("body", &self.bytes)
    }
}

/// Whether the media type is `application/json`, or ends in `+json` (RFC 6839).
fn is_json(headers: &HeaderMap) -> bool {
    let value = headers.get(CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
    let media_type = value.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    media_type == "application/json" || (media_type.starts_with("application/") && media_type.ends_with("+json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_media_types_of_json() {
        let is = |value: &str| is_json(&HeaderMap::from_iter([(CONTENT_TYPE, value.parse().unwrap())]));
        assert!(is("application/json") && is("Application/JSON; charset=utf-8") && is("application/geo+json"));
        assert!(!is("application/jsonp") && !is("text/plain") && !is("text/x+json") && !is_json(&HeaderMap::new()));
    }
}
