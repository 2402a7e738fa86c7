//! Checks `Host`, `Origin` and the token of every request, before anything else of it is looked at.

use super::access::Access;
use super::error::ServerError;
use super::public_address::PublicAddress;
use super::refusal::Refusal;
use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, COOKIE, HOST, ORIGIN};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, Method, Uri};
use axum::middleware::Next;
use axum::response::Response;
use std::sync::Arc;

/// The cookie that `POST /v1/session` sets.
pub(super) const SESSION_COOKIE: &str = "overfly_session";
/// Supervisors and load balancers ask these, without a token and under any host.
const OPEN: [&str; 2] = ["/healthz", "/readyz"];
/// Most characters of a header that an answer repeats.
const MOST_REPEATED: usize = 100;

/// Refuses requests that the access does not admit.
pub(super) async fn admit(
    State(access): State<Arc<Access>>,
    request: Request,
    next: Next,
) -> Result<Response, ServerError> {
    if !OPEN.contains(&request.uri().path()) {
        check(&access, &request)?;
    }
    Ok(next.run(request).await)
}

fn check(access: &Access, request: &Request) -> Result<(), Refusal> {
    let headers = request.headers();
    if let Some(hosts) = &access.hosts {
        require_host(hosts, request.uri(), headers)?;
    }
    if ![Method::GET, Method::HEAD, Method::OPTIONS].contains(request.method()) {
        require_own_origin(&access.origins, headers)?;
    }
    match &access.token {
        Some(token) if !is_page(request.uri().path()) => {
            let stated = headers.get(AUTHORIZATION);
            let (bearer, session) = (stated.and_then(bearer), session(headers));
            let is_known = bearer.is_some_and(|given| token.matches(given))
                || session.is_some_and(|given| token.matches_cookie(given.as_bytes()));
            match (stated, bearer, session) {
                _ if is_known => Ok(()),
                (None, _, None) => Err(Refusal::NoToken),
                (Some(_), None, _) => Err(Refusal::NotBearer),
                _ => Err(Refusal::WrongToken),
            }
        }
        _ => Ok(()),
    }
}

/// The files of the map page hold nothing of the store; without them nobody could enter the token.
fn is_page(path: &str) -> bool {
    path == "/" || path.starts_with("/page/")
}

/// Refuses hosts that are not known. Browsers always state the host: what is missing is no attack.
fn require_host(hosts: &[String], uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
    let stated = uri.authority().map(Authority::as_str).or_else(|| headers.get(HOST).map(text));
    let Some(stated) = stated else { return Ok(()) };
    let is_known = stated
        .parse::<Authority>()
        .is_ok_and(|authority| hosts.iter().any(|known| known.eq_ignore_ascii_case(authority.host())));
    if is_known { Ok(()) } else { Err(Refusal::Host { found: short(stated) }) }
}

/// Refuses what pages of other origins send. A browser states the origin of every such request, of forms too.
fn require_own_origin(allowed: &[HeaderValue], headers: &HeaderMap) -> Result<(), Refusal> {
    let Some(given) = headers.get(ORIGIN) else { return Ok(()) };
    let own = [headers.get(HOST).map(text), PublicAddress::from_headers(headers).host];
    let is_own = text(given).split_once("://").is_some_and(|(scheme, authority)| {
        let port = if scheme == "https" { ":443" } else { ":80" };
        let plain = |host: &str| host.strip_suffix(port).unwrap_or(host).to_ascii_lowercase();
        own.iter().flatten().any(|host| plain(host) == plain(authority))
    });
    if is_own || allowed.contains(given) { Ok(()) } else { Err(Refusal::Origin { found: short(text(given)) }) }
}

fn bearer(value: &HeaderValue) -> Option<&[u8]> {
    let (scheme, token) = value.as_bytes().split_at_checked("Bearer ".len())?;
    scheme.eq_ignore_ascii_case(b"Bearer ").then_some(token)
}

fn session(headers: &HeaderMap) -> Option<&str> {
    let cookies = headers.get_all(COOKIE).iter().flat_map(|value| text(value).split(';'));
    cookies.filter_map(|cookie| cookie.trim().split_once('=')).find(|(name, _)| *name == SESSION_COOKIE).map(|(_, v)| v)
}

/// The text of a header; empty if it is not plain.
fn text(value: &HeaderValue) -> &str {
    value.to_str().unwrap_or_default()
}

fn short(text: &str) -> String {
    text.chars().take(MOST_REPEATED).collect()
}
