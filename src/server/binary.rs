//! The media type of answers that are not text.

use axum::http::HeaderMap;
use axum::http::header::ACCEPT;

/// For clients that know no other binary media type; generated ones ask for it.
pub(super) const OCTET_STREAM: &str = "application/octet-stream";

/// Returns the media type to state: `application/octet-stream` if that is all that the request accepts, else `own`.
pub(super) fn stated_media_type<'a>(headers: &HeaderMap, own: &'a str) -> &'a str {
    let accepts_only_bytes = headers.get(ACCEPT).is_some_and(|accepted| accepted == OCTET_STREAM);
    if accepts_only_bytes { OCTET_STREAM } else { own }
}
