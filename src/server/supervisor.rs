//! `Supervisor`: systemd, told that the service is ready, that it still answers, and that it stops (sd_notify(3)).

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use sd_notify::NotifyState;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// How often the service checks itself if the supervisor demands no watchdog.
const UNWATCHED: Duration = Duration::from_secs(10);
/// Most bytes of a reason that are passed on.
const MOST_REASON: usize = 500;
/// The longest wait for a supervisor that does not read its messages.
const PATIENCE: Duration = Duration::from_secs(1);

type Notify = Arc<dyn Fn(&[NotifyState<'_>]) -> io::Result<()> + Send + Sync>;

/// Where to send notifications, and how often the watchdog wants one; nowhere if the service was started by hand.
#[derive(Clone, Default)]
pub struct Supervisor {
    notify: Option<Notify>,
    watchdog: Option<Duration>,
}

impl Supervisor {
    /// The supervisor that `NOTIFY_SOCKET`, `WATCHDOG_USEC` and `WATCHDOG_PID` name. A variable that is not valid counts as not
    /// set; a socket that cannot be reached is no error.
    pub fn from_environment() -> Self {
        match std::env::var_os("NOTIFY_SOCKET") {
            Some(socket) if !socket.is_empty() => Self {
                notify: Some(Arc::new(sd_notify::notify)),
                watchdog: sd_notify::watchdog_enabled().filter(|period| !period.is_zero()),
            },
            _ => Self::default(),
        }
    }

    /// Tells that the service answers.
    pub(super) async fn ready(&self) {
        self.tell(vec![NotifyState::Ready, NotifyState::Status("ready")]).await;
    }

    /// Tells that the service takes no more requests.
    pub(super) async fn stopping(&self) {
        self.tell(vec![NotifyState::Stopping, NotifyState::Status("stopping")]).await;
    }

    /// Runs until dropped: asks the service for `/readyz`, through all its layers, twice in each watchdog period, and feeds the
    /// watchdog if the service is ready. Otherwise only the status says why it is not.
    pub(super) async fn watch(self, app: Router) {
        if self.notify.is_none() {
            return;
        }
        let beat = self.watchdog.map_or(UNWATCHED, |period| period / 2);
        let mut last = None;
        loop {
            tokio::time::sleep(beat).await;
            let asked = tokio::time::timeout(beat, ask(&app)).await;
            let found = asked.unwrap_or_else(|_| Err("it does not answer itself in time".into()));
            if found.is_ok() && self.watchdog.is_some() {
                self.tell(vec![NotifyState::Watchdog]).await;
            }
            if last.as_ref() != Some(&found) {
                self.tell_status(
                    found.as_ref().map_or_else(|reason| format!("not ready: {reason}"), |()| "ready".into()),
                )
                .await;
                last = Some(found);
            }
        }
    }

    async fn tell_status(&self, status: String) {
        self.send(move |notify| notify(&[NotifyState::Status(&status)])).await;
    }

    async fn tell(&self, states: Vec<NotifyState<'static>>) {
        self.send(move |notify| notify(&states)).await;
    }

    /// Sends on a thread of its own: a supervisor that does not read must not stop the service.
    async fn send(&self, message: impl FnOnce(&Notify) -> io::Result<()> + Send + 'static) {
        let Some(notify) = self.notify.clone() else { return };
        let sent = tokio::task::spawn_blocking(move || message(&notify));
        match tokio::time::timeout(PATIENCE, sent).await {
            Ok(Ok(Ok(()))) => {}
            Ok(Ok(Err(error))) => tracing::debug!(%error, "the supervisor was not told"),
            Ok(Err(_)) | Err(_) => tracing::debug!("the supervisor does not read its messages"),
        }
    }
}

impl std::fmt::Debug for Supervisor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Supervisor").field("watchdog", &self.watchdog).finish_non_exhaustive()
    }
}

/// Asks the service whether it is ready.
///
/// # Errors
/// Why it is not.
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
    use std::sync::mpsc::{Receiver, channel};

    /// A supervisor and what it hears.
    fn supervisor(watchdog: Option<Duration>) -> (Supervisor, Receiver<String>) {
        let (sender, heard) = channel();
        let notify = move |states: &[NotifyState<'_>]| {
            let text: String = states.iter().map(|state| format!("{state}\n")).collect();
            sender.send(text).map_err(io::Error::other)
        };
        (Supervisor { notify: Some(Arc::new(notify)), watchdog }, heard)
    }

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap()
    }

    #[test]
    fn tells_that_the_service_is_ready_and_stops() {
        let (supervisor, heard) = supervisor(None);
        runtime().block_on(async {
            supervisor.ready().await;
            supervisor.stopping().await;
        });
        assert_eq!(heard.try_iter().collect::<Vec<_>>(), ["READY=1\nSTATUS=ready\n", "STOPPING=1\nSTATUS=stopping\n"]);
        drop(heard);
        // Nobody reads any more: telling is no failure.
        runtime().block_on(supervisor.ready());
    }

    #[test]
    fn feeds_the_watchdog_only_while_the_service_is_ready() {
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
        let (supervisor, messages) = supervisor(Some(Duration::from_millis(20)));
        let heard = || messages.recv_timeout(Duration::from_secs(20)).unwrap();
        let runtime = runtime();
        runtime.spawn(supervisor.watch(app));
        assert_eq!([heard(), heard()], ["WATCHDOG=1\n", "STATUS=ready\n"]);
        assert_eq!(heard(), "WATCHDOG=1\n");
        ready.store(false, Ordering::SeqCst);
        let mut next = heard();
        while next == "WATCHDOG=1\n" {
            next = heard();
        }
        assert_eq!(next, "STATUS=not ready: the card is gone\n");
        assert!(messages.recv_timeout(Duration::from_millis(200)).is_err(), "silent while it is not");
        ready.store(true, Ordering::SeqCst);
        assert_eq!([heard(), heard()], ["WATCHDOG=1\n", "STATUS=ready\n"]);
    }
}
