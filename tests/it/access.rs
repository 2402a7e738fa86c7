//! Who may use the service: a token, known hosts, own pages; and what does not start without one of them.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::header::{
    ACCESS_CONTROL_ALLOW_HEADERS, ACCESS_CONTROL_ALLOW_ORIGIN, ACCESS_CONTROL_REQUEST_HEADERS,
    ACCESS_CONTROL_REQUEST_METHOD, AUTHORIZATION, CONTENT_TYPE, COOKIE, HOST, ORIGIN, SET_COOKIE, WWW_AUTHENTICATE,
};
use axum::http::{HeaderMap, Method, Request};
use overfly::server::{Access, AccessOptions, Limits, Service, ServiceState, Token, router};
use overfly_store::Reader;
use overfly_testkit::drawn::drawn_store;
use std::process::Command;
use tower::ServiceExt;

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

fn service(listen: &str, options: AccessOptions) -> Router {
    let access = Access::new(&listen.parse().unwrap(), options).unwrap();
    let store = Reader::open(drawn_store().path()).unwrap();
    router(ServiceState::new(store, Service::Preflight, Limits::default()).with_access(access))
}

fn protected() -> Router {
    service("0.0.0.0:1", AccessOptions { token: Token::parse(TOKEN).ok(), ..Default::default() })
}

struct Reply {
    status: u16,
    headers: HeaderMap,
    body: serde_json::Value,
}

impl Reply {
    fn code(&self) -> (u16, &str) {
        (self.status, self.body["code"].as_str().unwrap_or_default())
    }
}

fn send(app: &Router, method: Method, path: &str, headers: &[(axum::http::HeaderName, &str)]) -> Reply {
    let request = headers.iter().fold(Request::builder().method(method).uri(path), |r, (n, v)| r.header(n, *v));
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    runtime.block_on(async {
        let response = app.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
        let (parts, body) = response.into_parts();
        let bytes = to_bytes(body, 1 << 24).await.unwrap();
        let body = serde_json::from_slice(&bytes).unwrap_or_default();
        Reply { status: parts.status.as_u16(), headers: parts.headers, body }
    })
}

fn get(app: &Router, path: &str, headers: &[(axum::http::HeaderName, &str)]) -> Reply {
    send(app, Method::GET, path, headers)
}

#[test]
fn a_protected_service_answers_only_to_the_token() {
    let app = protected();
    let bearer = format!("Bearer {TOKEN}");
    for (path, method) in [
        ("/v1/store", Method::GET),
        ("/v1/candidates", Method::GET),
        ("/v1/fixes", Method::POST),
        ("/v1/exports", Method::POST),
        ("/v1/session", Method::POST),
        ("/openapi.json", Method::GET),
        ("/metrics", Method::GET),
        ("/no/such", Method::GET),
    ] {
        for wrong in ["", "Bearer ", "Bearer 0123456789abcdef", "Basic 0123456789abcdef0123456789abcdef", TOKEN] {
            let reply = send(&app, method.clone(), path, &[(AUTHORIZATION, wrong)]);
            assert_eq!(reply.code(), (401, "token_required"), "{path} {wrong:?}");
            assert_eq!(reply.headers[WWW_AUTHENTICATE], "Bearer");
        }
        assert_eq!(send(&app, method.clone(), path, &[]).code(), (401, "token_required"), "{path}");
        let said = |headers: &[(axum::http::HeaderName, &str)]| {
            send(&app, method.clone(), path, headers).body["detail"].as_str().unwrap().to_owned()
        };
        assert!(said(&[]).contains("the request has none"), "{path}");
        assert!(said(&[(AUTHORIZATION, TOKEN)]).contains("does not begin with `Bearer `"), "{path}");
        assert!(
            said(&[(AUTHORIZATION, "Bearer 0123456789abcdef")]).contains("not the token of this service"),
            "{path}"
        );
        assert_ne!(send(&app, method, path, &[(AUTHORIZATION, &bearer)]).status, 401, "{path}");
    }
    assert_eq!(get(&app, "/v1/store", &[(AUTHORIZATION, &bearer)]).status, 200);
    // What supervisors ask, and the page that asks for the token.
    for path in ["/healthz", "/readyz", "/", "/page/page.js"] {
        assert_eq!(get(&app, path, &[]).status, 200, "{path}");
    }
}

#[test]
fn the_page_exchanges_the_token_for_a_cookie() {
    let app = protected();
    let bearer = format!("Bearer {TOKEN}");
    let entered = send(&app, Method::POST, "/v1/session", &[(AUTHORIZATION, &bearer)]);
    let set = entered.headers[SET_COOKIE].to_str().unwrap();
    assert_eq!(entered.status, 204);
    assert!(set.contains("; HttpOnly") && set.contains("; SameSite=Strict") && !set.contains("; Secure"), "{set}");
    assert!(!set.contains(TOKEN), "the cookie does not disclose the token");
    let cookie = set.split(';').next().unwrap();
    assert_eq!(get(&app, "/v1/store", &[(COOKIE, cookie)]).status, 200);
    assert_eq!(get(&app, "/v1/store", &[(COOKIE, &format!("a=b; {cookie}"))]).status, 200);
    for wrong in ["overfly_session=", &format!("overfly_session={TOKEN}"), &cookie.replace("overfly", "other")] {
        assert_eq!(get(&app, "/v1/store", &[(COOKIE, wrong)]).status, 401, "{wrong}");
    }
    let behind = [(AUTHORIZATION, bearer.as_str()), ("x-forwarded-proto".parse().unwrap(), "https")];
    let entered = send(&app, Method::POST, "/v1/session", &behind);
    assert!(entered.headers[SET_COOKIE].to_str().unwrap().contains("; Secure"));
}

#[test]
fn openapi_describes_the_token_where_there_is_one() {
    let bearer = format!("Bearer {TOKEN}");
    let api = get(&protected(), "/openapi.json", &[(AUTHORIZATION, &bearer)]).body;
    assert_eq!(api["components"]["securitySchemes"]["token"]["scheme"], "bearer");
    assert_eq!(api["security"], serde_json::json!([{"token": []}, {"session": []}]));
    assert!(api["paths"]["/v1/session"]["post"].is_object());
    assert_eq!(api["paths"]["/healthz"]["get"]["security"], serde_json::json!([{}]));
    let open = service("127.0.0.1:1", AccessOptions::default());
    let api = get(&open, "/openapi.json", &[]).body;
    assert!(api["security"].is_null() && api["paths"]["/v1/session"].is_null());
}

#[test]
fn a_page_that_rebinds_its_name_to_loopback_is_refused() {
    let app = service("127.0.0.2:8787", AccessOptions { allowed_hosts: vec!["map.lan".into()], ..Default::default() });
    let asked = |path: &str, host: &str| get(&app, path, &[(HOST, host)]);
    for known in ["localhost:8787", "LOCALHOST", "127.0.0.1:8787", "[::1]:8787", "127.0.0.2:8787", "map.lan"] {
        assert_eq!(asked("/v1/layers", known).status, 200, "{known}");
    }
    for other in
        ["evil.example", "evil.example:8787", "localhost.evil.example", "127.0.0.1.evil.example", "192.168.0.1", ""]
    {
        for path in ["/v1/layers", "/", "/metrics", "/no/such"] {
            assert_eq!(asked(path, other).code(), (403, "host_not_allowed"), "{other:?} {path}");
        }
    }
    // A target in absolute form counts before the header.
    assert_eq!(get(&app, "http://evil.example/v1/layers", &[(HOST, "localhost")]).status, 403);
    assert_eq!(asked("/healthz", "evil.example").status, 200);
    assert_eq!(get(&app, "/v1/layers", &[]).status, 200, "no browser leaves the host out");
    // A forwarded host is for addresses in answers only.
    let forwarded = [(HOST, "evil.example"), ("x-forwarded-host".parse().unwrap(), "localhost")];
    assert_eq!(get(&app, "/v1/layers", &forwarded).status, 403);
}

#[test]
fn pages_of_other_origins_send_nothing() {
    let app = service("127.0.0.1:8787", AccessOptions::default());
    let form = (CONTENT_TYPE, "multipart/form-data; boundary=b");
    let sent = |method: Method, path: &str, host: &str, origin: &str| {
        send(&app, method, path, &[form.clone(), (HOST, host), (ORIGIN, origin)])
    };
    for other in ["https://evil.example", "null", "http://localhost:1", "http://127.0.0.1:8787", "localhost:8787", ""] {
        for (method, path) in [
            (Method::POST, "/v1/fixes"),
            (Method::POST, "/v1/motions"),
            (Method::POST, "/v1/exports"),
            (Method::DELETE, "/v1/exports/a"),
        ] {
            let reply = sent(method, path, "localhost:8787", other);
            assert_eq!(reply.code(), (403, "cross_origin"), "{other:?} {path}");
        }
        assert_eq!(
            sent(Method::GET, "/v1/layers", "localhost:8787", other).status,
            200,
            "{other:?} reads nothing of it"
        );
    }
    assert_eq!(sent(Method::POST, "/v1/fixes", "localhost:8787", "http://localhost:8787").code().0, 400);
    assert_eq!(sent(Method::POST, "/v1/fixes", "localhost", "http://localhost:80").code().0, 400);
    let behind = [
        form.clone(),
        (HOST, "127.0.0.1:8787"),
        ("x-forwarded-host".parse().unwrap(), "maps.org"),
        (ORIGIN, "https://maps.org"),
    ];
    assert_eq!(send(&app, Method::POST, "/v1/fixes", &behind).code().0, 400, "the proxy's own page");
    let reply = sent(Method::GET, "/v1/layers", "localhost", "https://evil.example");
    assert!(!reply.headers.contains_key(ACCESS_CONTROL_ALLOW_ORIGIN));
}

#[test]
fn an_allowed_origin_reads_and_sends_with_the_token() {
    let options = AccessOptions {
        token: Token::parse(TOKEN).ok(),
        allowed_origins: vec!["https://maps.org".into()],
        ..Default::default()
    };
    let app = service("0.0.0.0:1", options);
    let asked = [
        (ORIGIN, "https://maps.org"),
        (ACCESS_CONTROL_REQUEST_METHOD, "POST"),
        (ACCESS_CONTROL_REQUEST_HEADERS, "authorization"),
    ];
    let preflight = send(&app, Method::OPTIONS, "/v1/fixes", &asked);
    assert_eq!(
        (preflight.status, &preflight.headers[ACCESS_CONTROL_ALLOW_ORIGIN]),
        (200, &"https://maps.org".parse().unwrap())
    );
    assert!(preflight.headers[ACCESS_CONTROL_ALLOW_HEADERS].to_str().unwrap().contains("authorization"));
    let refused = get(&app, "/v1/layers", &[(ORIGIN, "https://maps.org")]);
    assert_eq!(
        (refused.status, &refused.headers[ACCESS_CONTROL_ALLOW_ORIGIN]),
        (401, &"https://maps.org".parse().unwrap())
    );
    let bearer = format!("Bearer {TOKEN}");
    let with = |method, path, origin| send(&app, method, path, &[(ORIGIN, origin), (AUTHORIZATION, &bearer)]);
    assert_eq!(
        with(Method::GET, "/v1/layers", "https://maps.org").headers[ACCESS_CONTROL_ALLOW_ORIGIN],
        "https://maps.org"
    );
    assert_eq!(with(Method::POST, "/v1/fixes", "https://maps.org").status, 415, "a form is missing, nothing else");
    assert_eq!(with(Method::POST, "/v1/fixes", "https://evil.example").code(), (403, "cross_origin"));
    let other = with(Method::GET, "/v1/layers", "https://evil.example");
    assert!(!other.headers.contains_key(ACCESS_CONTROL_ALLOW_ORIGIN));
}

#[test]
fn tilejson_has_the_address_that_the_caller_asked() {
    let app = service("127.0.0.1:8787", AccessOptions::default());
    let headers = [
        (HOST, "localhost:8787"),
        ("x-forwarded-proto".parse().unwrap(), "https"),
        ("x-forwarded-host".parse().unwrap(), "maps.org"),
    ];
    let tiles = |headers: &[_]| {
        get(&app, "/v1/tiles/ortho/tilejson.json", headers).body["tiles"][0].as_str().unwrap().to_owned()
    };
    assert!(tiles(&headers).starts_with("https://maps.org/v1/tiles/ortho/"));
    assert!(tiles(&headers[..1]).starts_with("http://localhost:8787/v1/tiles/ortho/"));
}

#[test]
fn what_others_reach_does_not_start_without_a_token() {
    let folder = tempfile::tempdir().unwrap();
    let token = folder.path().join("token");
    let refused = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
        command.args(["serve", "--db"]).arg(drawn_store().path()).args(arguments);
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let message = refused(&["--listen", "0.0.0.0:0"]);
    assert!(message.starts_with("error[unprotected]"), "{message}");
    assert!(message.contains("`--token-file FILE`") && message.contains("`--insecure`"), "{message}");
    std::fs::write(&token, "short\n").unwrap();
    let path = token.to_str().unwrap();
    let message = refused(&["--listen", "0.0.0.0:0", "--token-file", path]);
    assert!(message.starts_with("error[not_a_token]") && message.contains(path), "{message}");
    for other in ["/dev/zero", "/no/such"] {
        let message = refused(&["--token-file", other]);
        assert!(message.starts_with("error[unreadable]") && message.contains(other), "{message}");
    }
    assert!(refused(&["--allow-origin", "*"]).starts_with("error[origin]"));
    assert!(refused(&["--allowed-host", "a:80"]).starts_with("error[host]"));
    assert!(refused(&["--insecure", "--token-file", path]).starts_with("error[usage]"));
}
