//! `ExportFailure`: why an export failed.

use axum::http::StatusCode;

/// Why an export failed, as every caller who asks for it is told.
#[derive(Debug, Clone)]
pub(super) struct ExportFailure {
    pub status: StatusCode,
    pub code: &'static str,
    pub detail: String,
}
