//! The map page: the files of `web/`, compiled into the program.

use super::error::ServerError;
use axum::extract::Path;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, X_CONTENT_TYPE_OPTIONS};
use axum::response::{IntoResponse, Response};
use rust_embed::RustEmbed;

#[derive(RustEmbed)]
#[folder = "web/"]
struct Web;

/// The page may load only from this service, so it works without a network.
const POLICY: &str =
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; base-uri 'none'; frame-ancestors 'none'";

/// `GET /`: the map page.
pub(super) async fn index() -> Result<Response, ServerError> {
    file("index.html")
}

/// `GET /page/{file}`: the scripts, styles and icons of the map page.
pub(super) async fn part(Path(name): Path<String>) -> Result<Response, ServerError> {
    file(&name)
}

fn file(name: &str) -> Result<Response, ServerError> {
    let found = Web::get(name).ok_or(ServerError::NoRoute)?;
    let media_type = match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    };
    let headers = [
        (CONTENT_TYPE, media_type),
        (CACHE_CONTROL, "no-cache"),
        (CONTENT_SECURITY_POLICY, POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    Ok((headers, found.data).into_response())
}
