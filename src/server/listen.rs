//! `serve`: listens, answers requests, and stops gracefully.

use super::connections::answer;
use super::router::router;
use super::state::ServiceState;
use super::supervisor::Supervisor;
use std::fmt;
use std::future::Future;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;
use tokio::net::{TcpListener, UnixListener, UnixStream};

/// The longest time that open requests may take once the service is told to stop.
const GRACE: Duration = Duration::from_secs(10);

/// Where to listen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Listen {
    /// An IP address and port; port 0 takes a free one.
    Tcp(SocketAddr),
    /// A Unix socket.
    Unix(PathBuf),
}

impl FromStr for Listen {
    type Err = ListenError;

    fn from_str(text: &str) -> Result<Self, ListenError> {
        match text.strip_prefix("unix:") {
            Some("") => Err(ListenError::Address { text: text.to_owned() }),
            Some(path) => Ok(Self::Unix(path.into())),
            None => {
                let text = text.strip_prefix("http://").unwrap_or(text).replace("localhost:", "127.0.0.1:");
                text.parse().map(Self::Tcp).map_err(|_| ListenError::Address { text })
            }
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => write!(f, "http://{address}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

/// Why the service cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Not an address.
    #[error("{text} is not an address: expected IP:PORT, such as 127.0.0.1:8787, or unix:/path/to/socket")]
    Address {
        /// What was given.
        text: String,
    },
    /// The service cannot listen on the address.
    #[error("cannot listen on {at}: {cause}")]
    Bind {
        /// Where.
        at: Listen,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The path is in use, or is not a socket.
    #[error("{path}: is in use, or is not a socket: remove it or choose another path", path = path.display())]
    Occupied {
        /// The path.
        path: PathBuf,
    },
}

impl ListenError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Address { .. } => "address",
            Self::Bind { .. } => "cannot_listen",
            Self::Occupied { .. } => "socket_occupied",
        }
    }
}

/// Serves until `stop` is ready, then finishes open requests. Calls `started` with the address in use, and notifies `supervisor` when
/// the service is ready, while it is alive, and when it stops.
///
/// # Errors
/// [`ListenError`].
pub async fn serve(
    listen: &Listen,
    state: ServiceState,
    supervisor: Supervisor,
    started: impl FnOnce(&Listen),
    stop: impl Future<Output = ()> + Send + 'static,
) -> Result<(), ListenError> {
    let bind = |cause| ListenError::Bind { at: listen.clone(), cause };
    let metrics = state.metrics.clone();
    let keep_up = tokio::spawn(async move {
        loop {
            tokio::time::sleep(Duration::from_secs(5)).await;
            metrics.keep_up();
        }
    });
    let app = router(state);
    let watch = tokio::spawn(supervisor.clone().watch(app.clone()));
    let (told, tell) = tokio::sync::oneshot::channel::<()>();
    let stopping = supervisor.clone();
    let stop = async move {
        stop.await;
        stopping.stopping().await;
        tracing::info!("stopping: no new connections, open requests have {} s", GRACE.as_secs());
        let _ = told.send(());
    };
    match listen {
        Listen::Tcp(address) => {
            let listener = TcpListener::bind(address).await.map_err(bind)?;
            started(&Listen::Tcp(listener.local_addr().map_err(bind)?));
            supervisor.ready().await;
            graceful(answer(listener, app, stop), tell).await;
        }
        Listen::Unix(path) => {
            free(path).await?;
            let listener = UnixListener::bind(path).map_err(bind)?;
            started(listen);
            supervisor.ready().await;
            graceful(answer(listener, app, stop), tell).await;
            // If this fails, the next service that binds the path reports it.
            let _ = std::fs::remove_file(path);
        }
    }
    keep_up.abort();
    watch.abort();
    Ok(())
}

/// Waits for the service, but no longer than the grace period after it was told to stop.
async fn graceful(service: impl Future<Output = ()>, told: tokio::sync::oneshot::Receiver<()>) {
    let deadline = async {
        if told.await.is_err() {
            std::future::pending::<()>().await;
        }
        tokio::time::sleep(GRACE).await;
    };
    tokio::select! {
        () = service => {}
        () = deadline => tracing::warn!("some requests were not finished in time and were dropped"),
    }
}

/// Removes a socket that a dead service left; refuses a socket in use, and anything that is not a socket.
async fn free(path: &Path) -> Result<(), ListenError> {
    use std::os::unix::fs::FileTypeExt;
    let occupied = || ListenError::Occupied { path: path.into() };
    match std::fs::symlink_metadata(path) {
        Err(_) => Ok(()),
        Ok(found) if found.file_type().is_socket() && UnixStream::connect(path).await.is_err() => {
            std::fs::remove_file(path).map_err(|_| occupied())
        }
        Ok(_) => Err(occupied()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_both_kinds_of_address() {
        assert_eq!("127.0.0.1:8787".parse::<Listen>().unwrap().to_string(), "http://127.0.0.1:8787");
        assert_eq!("localhost:1".parse::<Listen>().unwrap().to_string(), "http://127.0.0.1:1");
        assert_eq!("unix:/run/o.sock".parse::<Listen>().unwrap(), Listen::Unix("/run/o.sock".into()));
        for wrong in ["", "8787", "unix:", "example.org:80", "127.0.0.1:99999"] {
            assert_eq!(wrong.parse::<Listen>().unwrap_err().code(), "address", "{wrong}");
        }
    }
}
