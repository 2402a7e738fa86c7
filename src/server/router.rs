//! `router`: the routes, and the layers around every handler.

use super::access::Access;
use super::document::{Api, finished};
use super::error::ServerError;
use super::guard::admit;
use super::metrics::observe;
use super::problem::{PROBLEM_JSON, Problem};
use super::served::same_store;
use super::state::ServiceState;
use super::{candidates, catalogue, exports, fixes, motions, operations, page, session, tiles};
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::Method;
use axum::http::header::{AUTHORIZATION, CONTENT_RANGE, CONTENT_TYPE, ETAG, IF_NONE_MATCH, IF_RANGE, LOCATION, RANGE};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::CorsLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// The routes of the service. Onboard, no route writes.
pub fn router(state: ServiceState) -> Router {
    let store_routes = OpenApiRouter::new()
        .routes(routes!(candidates::get, candidates::post))
        .routes(routes!(fixes::post))
        .routes(routes!(motions::post))
        .routes(routes!(catalogue::store))
        .routes(routes!(catalogue::layers))
        .routes(routes!(catalogue::coverage_get))
        .routes(routes!(tiles::image))
        .routes(routes!(tiles::tilejson))
        .routes(routes!(tiles::descriptors))
        .routes(routes!(operations::readyz))
        .merge(exports::routes(&state))
        .route_layer(from_fn_with_state(state.clone(), same_store));
    let routes = OpenApiRouter::with_openapi(Api::openapi())
        .merge(store_routes)
        .routes(routes!(operations::healthz))
        .routes(routes!(operations::metrics));
    let is_protected = state.access.token.is_some();
    let routes = if is_protected { routes.routes(routes!(session::post)) } else { routes };
    let (router, mut api) = routes.split_for_parts();
    if is_protected {
        session::describe(&mut api);
    }
    // Written once: a client may ask for it over and over.
    let api = Bytes::from(finished(&api).to_string());
    let with_pages = router
        .route("/openapi.json", get(move || async move { ([(CONTENT_TYPE, "application/json")], api) }))
        .route("/", get(page::index))
        .route("/page/{file}", get(page::part))
        .fallback(|| async { ServerError::NoRoute })
        .method_not_allowed_fallback(|| async { ServerError::Method });
    surrounded(with_pages, state)
}

/// Adds the layers around every handler: access, a limit on bodies, problem documents for panics and other failures, and metrics.
fn surrounded(router: Router<ServiceState>, state: ServiceState) -> Router {
    let (body_bytes, metrics, access) = (state.limits.body_bytes, state.metrics.clone(), state.access.clone());
    let guarded = router
        .with_state(state)
        .layer(from_fn_with_state(access.clone(), admit))
        .layer(DefaultBodyLimit::max(body_bytes))
        .layer(CatchPanicLayer::custom(|_| ServerError::Panicked.into_response()))
        .layer(from_fn(problems_only));
    let shared = if access.origins.is_empty() { guarded } else { guarded.layer(other_origins(&access)) };
    shared.layer(from_fn_with_state(metrics, observe))
}

/// Lets pages of the allowed origins read answers. Preflight requests have no token: this layer answers them. Pages of other origins
/// use the token, never the cookie.
fn other_origins(access: &Access) -> CorsLayer {
    CorsLayer::new()
        .allow_origin(access.origins.clone())
        .allow_methods([Method::GET, Method::HEAD, Method::POST, Method::DELETE])
        .allow_headers([AUTHORIZATION, CONTENT_TYPE, IF_NONE_MATCH, IF_RANGE, RANGE])
        .expose_headers([CONTENT_RANGE, ETAG, LOCATION, tiles::CONTRACT_HEADER])
}

/// Turns plain-text errors of layers and extractors into problem documents.
async fn problems_only(request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let status = response.status();
    let is_problem = response.headers().get(CONTENT_TYPE).is_some_and(|t| t == PROBLEM_JSON);
    if is_problem || !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let detail = status.canonical_reason().unwrap_or("the request cannot be answered").to_lowercase();
    Problem::new(status, "request_refused", detail, None).into_response()
}

#[cfg(test)]
mod tests {
    use super::super::limits::Limits;
    use super::super::service::Service;
    use super::super::work::WorkClass;
    use super::*;
    use axum::body::{Body, to_bytes};
    use axum::extract::State;
    use axum::routing::get;
    use overfly_core::feature::keypoint::CONTRACT;
    use overfly_core::pixels::{Colour, Mask, MaskedColour};
    use overfly_core::tile::TileId;
    use overfly_store::{BuiltTile, Declaration, Reader, Terms, TileContent, Writer};
    use tower::ServiceExt;

    fn state(folder: &std::path::Path) -> ServiceState {
        let path = folder.join("s.gpkg");
        let tile = TileId::new(3, 1, 1).unwrap();
        let pixels = MaskedColour { colour: Colour::black(512, 512), mask: Mask::filled(512, 512, true) };
        let content = TileContent::encode(tile, &pixels, &[], None).unwrap();
        let declaration = Declaration {
            layer: "ortho".into(),
            sources: Vec::new(),
            zoom_override: None,
            base_zoom: 3,
            min_zoom: 3,
            terms: Terms::default(),
            terrain: None,
        };
        let mut writer = Writer::begin(&path, CONTRACT, declaration).unwrap();
        writer.put(&BuiltTile { tile, inputs_hash: [0; 32], content: Some(content) }).unwrap();
        writer.finish(&|_| true).unwrap();
        // One place in each class: a panic that kept its place would leave none.
        let limits = Limits { questions: 1, registrations: 1, ..Limits::default() };
        ServiceState::new(Reader::open_onboard(&path).unwrap(), Service::Onboard, limits)
    }

    async fn in_work(State(state): State<ServiceState>, load: WorkClass) -> Result<String, ServerError> {
        let store = state.store.reader.clone();
        state.work.run(load, move || -> String { panic!("poisoned, with {} layers", store.layers().len()) }).await
    }

    async fn asked(app: &Router, path: &str) -> (u16, String) {
        let response = app.clone().oneshot(Request::get(path).body(Body::empty()).unwrap()).await.unwrap();
        let status = response.status().as_u16();
        (status, String::from_utf8(to_bytes(response.into_body(), 1 << 20).await.unwrap().into()).unwrap())
    }

    #[test]
    fn a_panic_is_a_problem_document_and_counted_and_the_service_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let state = state(folder.path());
        let poisoned = Router::new()
            .route("/handler", get(|| async { std::hint::black_box(None::<String>).expect("poisoned") }))
            .route("/question", get(|state| in_work(state, WorkClass::Query)))
            .route("/registration", get(|state| in_work(state, WorkClass::Registration)))
            .route("/metrics", get(operations::metrics))
            .route("/readyz", get(operations::readyz));
        let app = surrounded(poisoned, state);
        tokio::runtime::Runtime::new().unwrap().block_on(async {
            for path in ["/handler", "/question", "/registration"].repeat(7) {
                let (status, body) = asked(&app, path).await;
                assert!(status == 500 && body.contains("\"code\":\"internal\""), "{path}: {status} {body}");
                assert!(!body.contains("poisoned"), "what panicked stays in the log");
                assert_eq!(asked(&app, "/readyz").await, (200, "ready\n".into()));
            }
            let (_, counted) = asked(&app, "/metrics").await;
            assert!(counted.contains("overfly_panics_total 21\n"), "{counted}");
        });
    }
}
