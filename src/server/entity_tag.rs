//! Entity tags: content that a caller has already is not sent again.

use axum::http::HeaderMap;
use axum::http::header::IF_NONE_MATCH;

/// The entity tag for a hash.
pub(super) fn etag(hash: &str) -> String {
    format!("\"{hash}\"")
}

/// Whether `If-None-Match` contains the tag (weak comparison, RFC 9110 section 13.1.2).
pub(super) fn unchanged(headers: &HeaderMap, tag: &str) -> bool {
    let given = headers.get_all(IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    given.flat_map(|v| v.split(',')).map(str::trim).any(|v| v == "*" || v.strip_prefix("W/").unwrap_or(v) == tag)
}
