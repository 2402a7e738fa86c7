//! `NoQuery`: an extractor for paths that take no parameters.

use super::error::ServerError;
use super::query::Query;
use axum::extract::{FromRequestParts, RawQuery};
use axum::http::request::Parts;

/// An extractor for paths that take no parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct NoQuery;

impl<S: Send + Sync> FromRequestParts<S> for NoQuery {
    type Rejection = ServerError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Self::Rejection> {
        let Ok(RawQuery(raw)) = RawQuery::from_request_parts(parts, state).await;
        Query::read(raw.as_deref(), &[])?;
        Ok(Self)
    }
}
