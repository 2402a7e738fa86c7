//! The content of the store: `GET /v1/store`, `/v1/layers`, `/v1/coverage`.

use super::dto::{CoverageJson, LayerJson, TerrainJson};
use super::error::ServerError;
use super::health::Health;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::query::Query;
use super::served::Served;
use super::service::Service;
use super::work::WorkClass;
use axum::Json;
use axum::extract::RawQuery;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use overfly_flight::locate::coverage::coverage;
use overfly_store::Reader;
use overfly_store::package::Manifest;
use serde::Serialize;
use utoipa::ToSchema;

/// The store and the service over it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct StoreReply {
    /// BLAKE3 over the whole logical content of the store, hexadecimal: equal inputs give equal digests.
    digest: String,
    /// The mission's name, if the store is an export that states one.
    name: Option<String>,
    /// The serial of the export.
    serial: Option<u64>,
    /// The last day on which the export may be flown, YYYY-MM-DD.
    valid_until: Option<String>,
    /// How the tiles are described; frames must be described in the same way.
    descriptor_contract: String,
    /// Version of the file format.
    format_version: u32,
    /// Number of tiles of all finished layers, at all levels.
    tiles: u64,
    /// Size of the file, bytes.
    bytes: u64,
    /// The layers of imagery, by name.
    layers: Vec<LayerJson>,
    /// The terrain; null where the store has none.
    terrain: Option<TerrainJson>,
    /// Damage found since the service was started, and warnings.
    health: Health,
    /// Where the service runs.
    service: Service,
    /// Version of the program.
    program_version: &'static str,
}

/// The store and what it holds.
#[utoipa::path(get, path = "/v1/store", operation_id = "store", tag = "store", responses((status = 200, description = "The store", body = StoreReply)))]
pub(super) async fn store(Served(state): Served, _: NoQuery) -> Json<StoreReply> {
    let store = &state.store.reader;
    let manifest = store.manifest().and_then(|text| Manifest::from_text(text).ok());
    let (name, serial, valid_until) = manifest.map_or((None, None, None), |m| (m.name, m.serial, m.valid_until));
    Json(StoreReply {
        digest: store.digest().to_owned(),
        name,
        serial,
        valid_until,
        descriptor_contract: store.descriptor_contract().to_owned(),
        format_version: store.format_version(),
        tiles: store.layers().iter().filter(|l| l.complete).map(|l| l.tiles).sum(),
        bytes: store.bytes(),
        layers: imagery(store),
        terrain: store.terrain().map(|(layer, terrain)| TerrainJson::new(layer, terrain)),
        health: Health::from_state(&state),
        service: state.service,
        program_version: env!("CARGO_PKG_VERSION"),
    })
}

/// The layers of imagery, by name.
#[utoipa::path(get, path = "/v1/layers", operation_id = "layers", tag = "store", responses((status = 200, description = "The layers", body = Vec<LayerJson>)))]
pub(super) async fn layers(Served(state): Served, _: NoQuery) -> Json<Vec<LayerJson>> {
    Json(imagery(&state.store.reader))
}

/// The layers of imagery, finished or not.
fn imagery(store: &Reader) -> Vec<LayerJson> {
    store.layers().iter().filter(|layer| layer.terrain.is_none()).map(LayerJson::from).collect()
}

/// Where each layer has imagery, as GeoJSON: one feature per layer, with its tiles joined to rectangles.
#[utoipa::path(
    get, path = "/v1/coverage", operation_id = "coverage", tag = "store",
    params(("layer" = Option<String>, Query, description = "Only this layer")),
    responses(
        (status = 200, description = "A feature collection", body = CoverageJson, content_type = "application/geo+json"),
        (status = "4XX", description = "No such layer, or the query is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn coverage_get(
    Served(state): Served,
    RawQuery(raw): RawQuery,
) -> Result<impl IntoResponse, ServerError> {
    let layer = Query::read(raw.as_deref(), &["layer"])?.text("layer")?;
    let store = state.store.reader.clone();
    let collection = state.work.run(WorkClass::Query, move || coverage(&store, layer.as_deref())).await??;
    Ok(([(CONTENT_TYPE, "application/geo+json")], Json(CoverageJson::from(collection))))
}
