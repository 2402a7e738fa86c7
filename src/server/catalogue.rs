//! What the store holds: `GET /v1/store`, `/v1/layers`, `/v1/coverage`.

use super::dto::{CoverageJson, LayerJson};
use super::error::ServerError;
use super::health::Health;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::query::Query;
use super::service::Service;
use super::state::ServiceState;
use super::work::Load;
use axum::Json;
use axum::extract::{RawQuery, State};
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use overfly_flight::locate::coverage::coverage;
use serde::Serialize;
use utoipa::ToSchema;

/// What a store is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct StoreReply {
    /// BLAKE3 over its whole logical content, hexadecimal: the same inputs give the same digest.
    digest: String,
    /// How its tiles are described; frames must be described alike.
    descriptor_contract: String,
    /// The file format's version.
    format_version: u32,
    /// Tiles of all finished layers and levels.
    tiles: u64,
    /// Size of the file.
    bytes: u64,
    /// Its layers, by name.
    layers: Vec<LayerJson>,
    /// What was found wrong with it since the service was started, and what the service warns of.
    health: Health,
    /// Where this service runs.
    service: Service,
    /// The program's version.
    program_version: &'static str,
}

/// What the store is and holds.
#[utoipa::path(get, path = "/v1/store", tag = "store", responses((status = 200, description = "The store", body = StoreReply)))]
pub(super) async fn store(State(state): State<ServiceState>, _: NoQuery) -> Json<StoreReply> {
    let store = &state.store;
    Json(StoreReply {
        digest: store.digest().to_owned(),
        descriptor_contract: store.descriptor_contract().to_owned(),
        format_version: store.format_version(),
        tiles: store.layers().iter().filter(|l| l.complete).map(|l| l.tiles).sum(),
        bytes: store.bytes(),
        layers: store.layers().iter().map(LayerJson::from).collect(),
        health: Health::of(&state),
        service: state.service,
        program_version: env!("CARGO_PKG_VERSION"),
    })
}

/// The layers, by name.
#[utoipa::path(get, path = "/v1/layers", tag = "store", responses((status = 200, description = "The layers", body = Vec<LayerJson>)))]
pub(super) async fn layers(State(state): State<ServiceState>, _: NoQuery) -> Json<Vec<LayerJson>> {
    Json(state.store.layers().iter().map(LayerJson::from).collect())
}

/// Where each layer has imagery, as GeoJSON: a feature a layer, its tiles joined to rectangles.
#[utoipa::path(
    get, path = "/v1/coverage", operation_id = "coverage", tag = "store",
    params(("layer" = Option<String>, Query, description = "Only this layer")),
    responses(
        (status = 200, description = "A feature collection", body = CoverageJson, content_type = "application/geo+json"),
        (status = "4XX", description = "No such layer, or the query is at fault", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn coverage_get(
    State(state): State<ServiceState>,
    RawQuery(raw): RawQuery,
) -> Result<impl IntoResponse, ServerError> {
    let layer = Query::read(raw.as_deref(), &["layer"])?.text("layer")?;
    let store = state.store.clone();
    let collection = state.work.run(Load::Question, move || coverage(&store, layer.as_deref())).await??;
    Ok(([(CONTENT_TYPE, "application/geo+json")], Json(CoverageJson::from(collection))))
}
