//! `POST /v1/session`: exchanges the token for a cookie, so that the map page does not keep the token.

use super::guard::SESSION_COOKIE;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::public_address::PublicAddress;
use super::state::ServiceState;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, SET_COOKIE};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use utoipa::openapi::OpenApi;
use utoipa::openapi::security::{ApiKey, ApiKeyValue, Http, HttpAuthScheme, SecurityRequirement, SecurityScheme};

/// Exchanges the token for a cookie that lasts until the browser is closed or the token changes.
#[utoipa::path(
    post, path = "/v1/session", operation_id = "session", tag = "operations",
    responses(
        (status = 204, description = "The header `Set-Cookie` has the cookie"),
        (status = "4XX", description = "Not the token, or a page of another origin", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(State(state): State<ServiceState>, _: NoQuery, headers: HeaderMap) -> Response {
    // The guard has checked the token.
    let value = state.access.token.as_ref().map(|token| token.cookie()).unwrap_or_default();
    let secure = if PublicAddress::from_headers(&headers).is_https { "; Secure" } else { "" };
    let cookie = format!("{SESSION_COOKIE}={value}; Path=/; HttpOnly; SameSite=Strict{secure}");
    (StatusCode::NO_CONTENT, [(SET_COOKIE, cookie), (CACHE_CONTROL, "no-store".to_owned())]).into_response()
}

/// Describes in the API that its routes need the token, as a header or as the cookie.
pub(super) fn describe(api: &mut OpenApi) {
    let components = api.components.get_or_insert_with(Default::default);
    components.add_security_scheme("token", SecurityScheme::Http(Http::new(HttpAuthScheme::Bearer)));
    let cookie = ApiKey::Cookie(ApiKeyValue::new(SESSION_COOKIE));
    components.add_security_scheme("session", SecurityScheme::ApiKey(cookie));
    let needed = |name: &str| SecurityRequirement::new::<_, [&str; 0], &str>(name, []);
    api.security = Some(vec![needed("token"), needed("session")]);
}
