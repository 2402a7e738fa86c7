//! For those who run the service: `/healthz`, `/readyz`, `/metrics`.

use super::detail::detail;
use super::error::ServerError;
use super::health::Health;
use super::problem::Problem;
use super::state::ServiceState;
use super::work::Load;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;

/// Whether the process lives; after the first line what is wrong with its store, where something is.
#[utoipa::path(get, path = "/healthz", tag = "operations", responses((status = 200, description = "It lives", body = String, content_type = "text/plain")))]
pub(super) async fn healthz(State(state): State<ServiceState>) -> String {
    Health::of(&state).text("ok")
}

/// Whether the store answers, read anew: the file is there, is the one that was opened, and its pages can be read; after the first line what is wrong with it, where something is.
#[utoipa::path(
    get, path = "/readyz", tag = "operations",
    responses(
        (status = 200, description = "The store answers", body = String, content_type = "text/plain"),
        (status = "5XX", description = "It does not", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn readyz(State(state): State<ServiceState>) -> Result<String, ServerError> {
    let store = state.store.clone();
    state
        .work
        .run(Load::Question, move || -> Result<(), ServerError> {
            store.check_readable()?;
            for layer in store.layers().iter().filter(|l| l.complete) {
                store.footprints_in(layer, layer.min_zoom, &peephole())?;
            }
            Ok(())
        })
        .await?
        .map_err(not_ready)?;
    Ok(Health::of(&state).text("ready"))
}

/// Why the service is not ready; the log has the error in full.
fn not_ready(error: ServerError) -> ServerError {
    tracing::warn!(code = error.code(), "not ready: {error}");
    ServerError::NotReady { code: error.code(), reason: detail(&error) }
}

/// A window on the map that costs nothing to look through: one micrometre in the middle of the world.
fn peephole() -> overfly_core::tile::MercatorBounds {
    overfly_core::tile::MercatorBounds { min_x_m: 0.0, min_y_m: 0.0, max_x_m: 1e-6, max_y_m: 1e-6 }
}

/// Prometheus's exposition text.
#[utoipa::path(get, path = "/metrics", tag = "operations", responses((status = 200, description = "Metrics", body = String, content_type = "text/plain")))]
pub(super) async fn metrics(State(state): State<ServiceState>) -> impl IntoResponse {
    let layers = state.store.layers();
    let text = state.metrics.render(layers.len(), layers.iter().map(|l| l.tiles).sum());
    ([(CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text)
}
