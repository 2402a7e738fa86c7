//! Routes for operators: `/healthz`, `/readyz`, `/metrics`.

use super::detail::detail;
use super::error::ServerError;
use super::health::Health;
use super::served::Served;
use super::work::WorkClass;
use axum::http::HeaderName;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;

/// Names the store that is served.
const DIGEST_HEADER: HeaderName = HeaderName::from_static("overfly-store-digest");

/// Whether the process is alive. The lines after the first list damage of its store, if there is any, and when it took the place of
/// another one; the header `overfly-store-digest` names the store.
#[utoipa::path(get, path = "/healthz", operation_id = "healthz", tag = "operations", security(()), responses((status = 200, description = "The process is alive", body = String, content_type = "text/plain", example = "ok\n")))]
pub(super) async fn healthz(Served(state): Served) -> impl IntoResponse {
    ([(DIGEST_HEADER, state.store.reader.digest().to_owned())], Health::from_state(&state).text("ok"))
}

/// Whether the store can be read now: the file exists, is the one that was opened, and its pages can be read. The lines after the first list damage of the store, if there is any.
#[utoipa::path(
    get, path = "/readyz", operation_id = "readyz", tag = "operations", security(()),
    responses(
        (status = 200, description = "The store can be read", body = String, content_type = "text/plain", example = "ready\n"),
    )
)]
pub(super) async fn readyz(Served(state): Served) -> Result<String, ServerError> {
    let store = state.store.reader.clone();
    state
        .work
        .run(WorkClass::Short, move || -> Result<(), ServerError> {
            store.check_readable()?;
            for layer in store.layers().iter().filter(|l| l.complete) {
                store.footprints_in(layer, layer.min_zoom, &tiny_window())?;
            }
            Ok(())
        })
        .await?
        .map_err(not_ready)?;
    Ok(Health::from_state(&state).text("ready"))
}

/// Turns an error into the reason why the service is not ready, and logs it in full.
fn not_ready(error: ServerError) -> ServerError {
    tracing::warn!(code = error.code(), "not ready: {error}");
    ServerError::NotReady { code: error.code(), reason: detail(&error) }
}

/// A small query window: one micrometre in the middle of the world.
fn tiny_window() -> overfly_core::tile::MercatorBounds {
    overfly_core::tile::MercatorBounds { min_x_m: 0.0, min_y_m: 0.0, max_x_m: 1e-6, max_y_m: 1e-6 }
}

/// Metrics in Prometheus's text format.
#[utoipa::path(get, path = "/metrics", operation_id = "metrics", tag = "operations", responses((status = 200, description = "Metrics", body = String, content_type = "text/plain", example = "overfly_store_tiles 64\n")))]
pub(super) async fn metrics(Served(state): Served) -> impl IntoResponse {
    let layers = state.store.reader.layers();
    let text = state.metrics.render(layers.len(), layers.iter().map(|l| l.tiles).sum());
    ([(CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text)
}
