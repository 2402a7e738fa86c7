//! `Supervisor`: whoever started the service and watches it, told by systemd's protocol (sd_notify(3)): when it answers, that it
//! still does, and that it stops.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::Arc;
use std::time::Duration;

/// How often the service asks itself where nobody states how often it must.
const UNWATCHED: Duration = Duration::from_secs(10);
/// Most of a reason that is passed on, bytes.
const MOST_REASON: usize = 500;

/// Where to tell, and how often; nowhere where the service was started by hand.
#[derive(Debug, Clone, Default)]
pub struct Supervisor {
    socket: Option<Arc<(UnixDatagram, SocketAddr)>>,
    watchdog: Option<Duration>,
}

/// What the environment of a service says of who watches it; each as the variable of that name.
#[derive(Debug, Clone, Default)]
pub struct Environment {
    /// `NOTIFY_SOCKET`: a path, or `@` and an abstract name.
    pub notify_socket: Option<OsString>,
    /// `WATCHDOG_USEC`: within this many microseconds the service must say that it lives.
    pub watchdog_usec: Option<String>,
    /// `WATCHDOG_PID`: which process that is meant for.
    pub watchdog_pid: Option<String>,
}

impl Supervisor {
    /// As the environment says; `pid` is this process. What cannot be understood or reached is as if it were not there: a
    /// service is not refused for want of somebody to tell.
    pub fn of(environment: &Environment, pid: u32) -> Self {
        let address = environment.notify_socket.as_deref().and_then(address);
        let socket = address.and_then(|a| Some(Arc::new((UnixDatagram::unbound().ok()?, a))));
        if let Some(socket) = &socket {
            // A supervisor that does not read must not hold the service up.
            let _ = socket.0.set_nonblocking(true);
        }
        let meant = environment.watchdog_pid.as_deref().is_none_or(|p| p.trim() == pid.to_string());
        let period_us = environment.watchdog_usec.as_deref().and_then(|t| t.trim().parse::<u64>().ok());
        let watchdog = period_us.filter(|us| *us > 0 && meant && socket.is_some()).map(Duration::from_micros);
        Self { socket, watchdog }
    }

    /// It answers.
    pub(super) fn ready(&self) {
        self.tell("READY=1\nSTATUS=ready\n");
    }

    /// It takes no more requests.
    pub(super) fn stopping(&self) {
        self.tell("STOPPING=1\nSTATUS=stopping\n");
    }

    /// For ever: asks the service whether it is ready, through all its layers, twice in each period that the supervisor allows,
    /// and says that it lives where it is. Where it is not, or does not answer, nothing is said but why.
    pub(super) async fn watch(self, app: Router) {
        if self.socket.is_none() {
            return;
        }
        let beat = self.watchdog.map_or(UNWATCHED, |period| period / 2);
        let mut last = None;
        loop {
            tokio::time::sleep(beat).await;
            let asked = tokio::time::timeout(beat, ask(&app)).await;
            let found = asked.unwrap_or_else(|_| Err("it does not answer itself in time".into()));
            if found.is_ok() && self.watchdog.is_some() {
                self.tell("WATCHDOG=1\n");
            }
            if last.as_ref() != Some(&found) {
                match &found {
                    Ok(()) => self.tell("STATUS=ready\n"),
                    Err(reason) => self.tell(&format!("STATUS=not ready: {reason}\n")),
                }
                last = Some(found);
            }
        }
    }

    fn tell(&self, text: &str) {
        let Some(socket) = &self.socket else { return };
        if let Err(error) = socket.0.send_to_addr(text.as_bytes(), &socket.1) {
            tracing::debug!(%error, "the supervisor was not told: {text:?}");
        }
    }
}

/// The address that `NOTIFY_SOCKET` states.
fn address(text: &OsStr) -> Option<SocketAddr> {
    match text.as_bytes() {
        [b'@', name @ ..] => abstract_address(name),
        [b'/', ..] => SocketAddr::from_pathname(text).ok(),
        _ => None,
    }
}

#[cfg(target_os = "linux")]
fn abstract_address(name: &[u8]) -> Option<SocketAddr> {
    use std::os::linux::net::SocketAddrExt;
    SocketAddr::from_abstract_name(name).ok()
}

#[cfg(not(target_os = "linux"))]
fn abstract_address(_: &[u8]) -> Option<SocketAddr> {
    None
}

/// Whether the service is ready; else why not.
async fn ask(app: &Router) -> Result<(), String> {
    let request = Request::get("/readyz").body(Body::empty()).map_err(|e| e.to_string())?;
    let Ok(response) = TowerToHyperService::new(app.clone()).call(request).await;
    let status = response.status();
    if status == StatusCode::OK {
        return Ok(());
    }
    let body = to_bytes(response.into_body(), 1 << 16).await.unwrap_or_default();
    let problem: serde_json::Value = serde_json::from_slice(&body).unwrap_or_default();
    let reason = problem["detail"].as_str().unwrap_or(status.as_str()).replace(['\n', '\r'], " ");
    Err(reason.chars().take(MOST_REASON).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::response::IntoResponse;
    use axum::routing::get;
    use std::sync::atomic::{AtomicBool, Ordering};

    fn listener() -> (tempfile::TempDir, UnixDatagram, Environment) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let environment = Environment {
            notify_socket: Some(path.into()),
            watchdog_usec: Some("20000".into()),
            watchdog_pid: Some("7".into()),
        };
        (folder, socket, environment)
    }

    fn heard(socket: &UnixDatagram) -> String {
        let mut bytes = [0; 1000];
        let n = socket.recv(&mut bytes).unwrap();
        String::from_utf8(bytes[..n].to_vec()).unwrap()
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn tells_whether_by_a_path_or_an_abstract_name() {
        let (_folder, socket, environment) = listener();
        Supervisor::of(&environment, 7).ready();
        assert_eq!(heard(&socket), "READY=1\nSTATUS=ready\n");
        let name = format!("overfly-test-{}", std::process::id());
        let abstract_socket = UnixDatagram::bind_addr(&abstract_address(name.as_bytes()).unwrap()).unwrap();
        let environment = Environment { notify_socket: Some(format!("@{name}").into()), ..Environment::default() };
        Supervisor::of(&environment, 7).stopping();
        assert_eq!(heard(&abstract_socket), "STOPPING=1\nSTATUS=stopping\n");
    }

    #[test]
    fn is_nobody_where_nothing_usable_is_stated() {
        let (_folder, _socket, environment) = listener();
        assert!(Supervisor::of(&environment, 7).watchdog.is_some());
        assert!(Supervisor::of(&environment, 8).watchdog.is_none(), "another process is meant");
        for text in ["", "x", "-3", "0"] {
            let other = Environment { watchdog_usec: Some(text.into()), ..environment.clone() };
            assert!(Supervisor::of(&other, 7).watchdog.is_none(), "{text:?}");
        }
        for text in ["", "relative", "vsock:2:3"] {
            let other = Environment { notify_socket: Some(text.into()), ..environment.clone() };
            assert!(Supervisor::of(&other, 7).socket.is_none(), "{text:?}");
        }
        // Nobody reads there: telling is no failure.
        let gone = Environment { notify_socket: Some("/nowhere/notify".into()), ..environment };
        Supervisor::of(&gone, 7).ready();
    }

    #[test]
    fn says_that_it_lives_only_while_it_is_ready() {
        let (_folder, socket, environment) = listener();
        let ready = Arc::new(AtomicBool::new(true));
        let state = ready.clone();
        let app = Router::new().route(
            "/readyz",
            get(move || {
                let is = state.load(Ordering::SeqCst);
                async move {
                    if is {
                        "ready".into_response()
                    } else {
                        (StatusCode::SERVICE_UNAVAILABLE, r#"{"detail":"the card\nis gone"}"#).into_response()
                    }
                }
            }),
        );
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.spawn(Supervisor::of(&environment, 7).watch(app));
        assert_eq!([heard(&socket), heard(&socket)], ["WATCHDOG=1\n", "STATUS=ready\n"]);
        assert_eq!(heard(&socket), "WATCHDOG=1\n");
        ready.store(false, Ordering::SeqCst);
        let mut next = heard(&socket);
        while next == "WATCHDOG=1\n" {
            next = heard(&socket);
        }
        assert_eq!(next, "STATUS=not ready: the card is gone\n");
        socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        assert!(socket.recv(&mut [0; 100]).is_err(), "silent while it is not");
        ready.store(true, Ordering::SeqCst);
        socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        assert_eq!([heard(&socket), heard(&socket)], ["WATCHDOG=1\n", "STATUS=ready\n"]);
    }
}
