//! `GET /v1/tiles/...`: imagery, descriptors and TileJSON.

use super::binary::{OCTET_STREAM, stated_media_type};
use super::dto::TileJson;
use super::entity_tag::{etag, unchanged};
use super::error::ServerError;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::public_address::PublicAddress;
use super::served::Served;
use super::work::WorkClass;
use axum::Json;
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::header::{ACCEPT, CACHE_CONTROL, CONTENT_TYPE, ETAG, VARY};
use axum::http::{HeaderMap, HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use overfly_core::tile::TileId;

/// A tile may change when the store is built again: caches must revalidate after a minute.
const CACHE: &str = "public, max-age=60, must-revalidate";
/// Names the format of a descriptor blob.
pub(super) const CONTRACT_HEADER: HeaderName = HeaderName::from_static("overfly-descriptor-contract");

type TilePath = Result<Path<(String, String, String, String)>, PathRejection>;

fn name(path: TilePath) -> Result<(String, TileId), ServerError> {
    let Path((layer, z, x, y)) = path.map_err(|e| ServerError::Path(e.body_text()))?;
    let whole = |what, text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        text.parse::<u32>()
            .ok()
            .filter(|_| digits)
            .ok_or_else(|| ServerError::TileIndex { what, found: text.chars().take(64).collect() })
    };
    let (z, x, y) = (whole("z", &z)?, whole("x", &x)?, whole("y", &y)?);
    let zoom = u8::try_from(z).map_err(|_| ServerError::TileName(overfly_core::tile::TileError::Zoom { zoom: z }))?;
    Ok((layer, TileId::new(zoom, x, y).map_err(ServerError::TileName)?))
}

/// The imagery of a tile, as stored.
#[utoipa::path(
    get, path = "/v1/tiles/{layer}/{z}/{x}/{y}", operation_id = "tile", tag = "tiles",
    params(
        ("layer" = String, Path, description = "Layer"),
        ("z" = u8, Path, description = "Zoom (tiles of 512 px on the Web Mercator quad)"),
        ("x" = u32, Path, description = "Column from the antimeridian"),
        ("y" = u32, Path, description = "Row, 0 north"),
        ("if-none-match" = Option<String>, Header, description = "An earlier ETag: the answer is 304 if the content is unchanged"),
    ),
    responses(
        (status = 200, description = "The image; its ETag is the BLAKE3 of the tile's content", content((Vec<u8> = "image/jpeg"), (Vec<u8> = "image/png"), (Vec<u8> = "image/webp"), (Vec<u8> = "application/octet-stream"))),
        (status = 304, description = "Unchanged"),
        (status = "4XX", description = "Not a tile, or the layer does not have it", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn image(
    Served(state): Served,
    path: TilePath,
    headers: HeaderMap,
    _: NoQuery,
) -> Result<Response, ServerError> {
    let (layer, tile) = name(path)?;
    let (z, x, y) = (tile.zoom(), tile.column(), tile.row());
    let store = state.store.reader.clone();
    let found = state
        .work
        .run(WorkClass::Query, move || {
            let encoded = store.encoded_tile(store.layer(&layer)?, tile)?;
            encoded.ok_or(ServerError::NoTile { layer, z, x, y })
        })
        .await??;
    let tag = etag(&overfly_store::hex(&found.content_hash));
    let kept = [(ETAG, tag.clone()), (CACHE_CONTROL, CACHE.into()), (VARY, ACCEPT.to_string())];
    if unchanged(&headers, &tag) {
        return Ok((StatusCode::NOT_MODIFIED, kept).into_response());
    }
    let media_type = stated_media_type(&headers, found.media_type).to_owned();
    Ok((kept, [(CONTENT_TYPE, media_type)], found.bytes).into_response())
}

/// The keypoint descriptors of a tile: the blob that migrations/README.md describes.
#[utoipa::path(
    get, path = "/v1/tiles/{layer}/{z}/{x}/{y}/descriptors", operation_id = "descriptors", tag = "tiles",
    params(
        ("layer" = String, Path, description = "Layer"),
        ("z" = u8, Path, description = "Zoom"),
        ("x" = u32, Path, description = "Column"),
        ("y" = u32, Path, description = "Row, 0 north"),
        ("if-none-match" = Option<String>, Header, description = "An earlier ETag: the answer is 304 if the content is unchanged"),
    ),
    responses(
        (status = 200, description = "The blob; header `overfly-descriptor-contract` names its format", body = Vec<u8>, content_type = "application/octet-stream"),
        (status = 304, description = "Unchanged"),
        (status = "4XX", description = "Not a tile, or without descriptors", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn descriptors(
    Served(state): Served,
    path: TilePath,
    headers: HeaderMap,
    _: NoQuery,
) -> Result<Response, ServerError> {
    let (layer, tile) = name(path)?;
    let (z, x, y) = (tile.zoom(), tile.column(), tile.row());
    let store = state.store.reader.clone();
    let blob = state
        .work
        .run(WorkClass::Query, move || -> Result<Vec<u8>, ServerError> {
            let known = store.layer(&layer)?;
            if let Some(blob) = store.descriptors(known, tile)? {
                return Ok(blob);
            }
            match store.footprint(known, tile)? {
                Some(_) => Err(ServerError::NoDescriptors { layer, z, x, y }),
                None => Err(ServerError::NoTile { layer, z, x, y }),
            }
        })
        .await??;
    let tag = etag(&blake3::hash(&blob).to_hex());
    let contract = state.store.reader.descriptor_contract().to_owned();
    let kept = [(ETAG, tag.clone()), (CACHE_CONTROL, CACHE.into()), (CONTRACT_HEADER, contract)];
    if unchanged(&headers, &tag) {
        return Ok((StatusCode::NOT_MODIFIED, kept).into_response());
    }
    Ok((kept, [(CONTENT_TYPE, OCTET_STREAM)], blob).into_response())
}

/// The TileJSON of a layer, for map viewers.
#[utoipa::path(
    get, path = "/v1/tiles/{layer}/tilejson.json", operation_id = "tile_json", tag = "tiles",
    params(("layer" = String, Path, description = "Layer")),
    responses(
        (status = 200, description = "TileJSON", body = TileJson),
        (status = "4XX", description = "No such layer, or the query is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn tilejson(
    Served(state): Served,
    path: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
    _: NoQuery,
) -> Result<Json<TileJson>, ServerError> {
    let Path(layer) = path.map_err(|e| ServerError::Path(e.body_text()))?;
    let origin = PublicAddress::from_headers(&headers).origin();
    Ok(Json(TileJson::new(state.store.reader.layer(&layer)?, &origin)))
}
