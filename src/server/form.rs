//! `Form`: a multipart body with a fixed set of parts, read within limits.

use super::body::{in_time, metered};
use super::error::ServerError;
use super::form_error::FormError;
use super::json_object::object;
use super::state::ServiceState;
use super::work::Upload;
use axum::extract::multipart::MultipartError;
use axum::extract::{FromRequest, Multipart, Request};
use axum::http::StatusCode;
use serde::de::DeserializeOwned;

/// The parts of a form. Their memory is reserved until the form is dropped.
#[derive(Debug)]
pub(super) struct Form {
    parts: Vec<(&'static str, Vec<u8>)>,
    _place: Upload,
}

impl Form {
    /// Reads the body of a request with parts of the given names, each at most once.
    ///
    /// # Errors
    /// [`FormError`], or [`ServerError::Busy`].
    pub(super) async fn read(
        state: &ServiceState,
        request: Request,
        names: &'static [&'static str],
    ) -> Result<Self, ServerError> {
        let most_bytes = state.limits.body_bytes;
        let (head, body) = request.into_parts();
        let (body, meter) = metered(state, &head.headers, most_bytes, body)?;
        let multipart = Multipart::from_request(Request::from_parts(head, body), state).await;
        let multipart = multipart.map_err(|e| FormError::NotMultipart { reason: e.body_text() })?;
        let read = in_time(state, read_parts(multipart, names, most_bytes)).await;
        let (parts, place) = meter.finish(read)?;
        Ok(Self { parts, _place: place })
    }

    /// Takes the bytes of a part out of the form.
    ///
    /// # Errors
    /// [`FormError::Missing`].
    pub(super) fn take(&mut self, name: &'static str) -> Result<Vec<u8>, FormError> {
        let part = self.parts.iter_mut().find(|(given, _)| *given == name).ok_or(FormError::Missing { name })?;
        Ok(std::mem::take(&mut part.1))
    }

    /// Parses a part as JSON; an absent part counts as `{}`.
    ///
    /// # Errors
    /// [`FormError::NotJson`].
    pub(super) fn json<T: DeserializeOwned>(&mut self, name: &'static str) -> Result<T, FormError> {
        let bytes = match self.take(name) {
            Err(FormError::Missing { .. }) => b"{}".to_vec(),
            other => other?,
        };
        object(name, &bytes)
    }
}

async fn read_parts(
    mut multipart: Multipart,
    names: &'static [&'static str],
    limit_bytes: usize,
) -> Result<Vec<(&'static str, Vec<u8>)>, FormError> {
    let broken = |e: MultipartError| match e.status() {
        StatusCode::PAYLOAD_TOO_LARGE => FormError::TooLarge { limit_bytes },
        _ => FormError::Broken { reason: e.body_text() },
    };
    let mut parts: Vec<(&'static str, Vec<u8>)> = Vec::new();
    while let Some(field) = multipart.next_field().await.map_err(broken)? {
        let given = field.name().unwrap_or_default();
        let Some(&name) = names.iter().find(|n| **n == given) else {
            return Err(FormError::Unknown { name: given.chars().take(64).collect(), expected: names.join(", ") });
        };
        if parts.iter().any(|(other, _)| *other == name) {
            return Err(FormError::Repeated { name });
        }
        parts.push((name, field.bytes().await.map_err(broken)?.into()));
    }
    Ok(parts)
}
