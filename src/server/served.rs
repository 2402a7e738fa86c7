//! `Served`: an extractor for the state with the one store that a request uses from beginning to end.

use super::error::ServerError;
use super::service::Service;
use super::state::ServiceState;
use super::store_slot::OpenStore;
use super::work::WorkClass;
use axum::extract::{FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::Response;
use std::convert::Infallible;

/// The state, with the store that was current when the request came.
#[derive(Debug)]
pub(super) struct Served(pub ServiceState);

impl FromRequestParts<ServiceState> for Served {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &ServiceState) -> Result<Self, Infallible> {
        let store = parts.extensions.get::<OpenStore>().cloned().unwrap_or_else(|| state.slot.last());
        Ok(Self(ServiceState { store, ..state.clone() }))
    }
}

/// Gives a request the store that is in the file now. Layers and indexes are read only once for each store, and an answer that mixes
/// two stores would be wrong: on the ground, where a build may write to the open file, the answer is refused if that has happened
/// meanwhile. Onboard, a file that is replaced stays as it was for those who have it open.
pub(super) async fn same_store(
    State(state): State<ServiceState>,
    mut request: Request,
    next: Next,
) -> Result<Response, ServerError> {
    let store = state.slot.current(&state.work).await?;
    let reader = store.reader.clone();
    request.extensions_mut().insert(store);
    let response = next.run(request).await;
    if state.service == Service::Preflight {
        state.work.run(WorkClass::Short, move || reader.check_unchanged()).await??;
    }
    Ok(response)
}
