//! A `ServerError` as a problem document.

use super::detail::detail;
use super::error::ServerError;
use super::problem::{Panicked, Problem};
use axum::http::header::WWW_AUTHENTICATE;
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};

impl IntoResponse for ServerError {
    fn into_response(self) -> Response {
        let status = self.status();
        if status == StatusCode::INTERNAL_SERVER_ERROR {
            // The cause is logged here and nowhere else; paths and system messages stay in the log.
            tracing::error!(code = self.code(), "{self}");
            let detail = "the service failed; its log has the details".to_owned();
            let mut response = Problem::new(status, self.code(), detail, None).into_response();
            if matches!(self, Self::Panicked) {
                response.extensions_mut().insert(Panicked);
            }
            return response;
        }
        let mut response = Problem::new(status, self.code(), detail(&self), self.parameter()).into_response();
        if status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}
