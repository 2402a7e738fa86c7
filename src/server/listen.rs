//! `serve`: listens, answers requests, and stops gracefully.

use super::address::{Listen, ListenError};
use super::connections::answer;
use super::router::router;
use super::state::ServiceState;
use super::supervisor::Supervisor;
use rustix::net::sockopt::set_socket_send_buffer_size;
use std::fs::Permissions;
use std::future::Future;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::Duration;
use tokio::net::{TcpListener, UnixListener, UnixSocket, UnixStream};

/// The longest time that open requests may take once the service is told to stop.
const GRACE: Duration = Duration::from_secs(10);
/// What the system holds of an answer that its reader has not taken, bytes for each connection. By default it is some megabytes: hundreds
/// of readers that take nothing would keep the service writing to them.
const SEND_BUFFER_BYTES: usize = 128 << 10;
/// Most connections to a Unix socket that wait to be accepted.
const BACKLOG: u32 = 1024;

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
            // Every connection inherits it.
            set_socket_send_buffer_size(&listener, SEND_BUFFER_BYTES).map_err(|e| bind(e.into()))?;
            started(&Listen::Tcp(listener.local_addr().map_err(bind)?));
            supervisor.ready().await;
            graceful(answer(listener, app, stop), tell).await;
        }
        Listen::Unix(path) => {
            free(path).await?;
            let listener = bind_for_owner(path).map_err(bind)?;
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

/// Listens on a socket that only its owner can connect to. Nobody can connect before its mode is set.
fn bind_for_owner(path: &Path) -> std::io::Result<UnixListener> {
    let socket = UnixSocket::new_stream()?;
    socket.bind(path)?;
    std::fs::set_permissions(path, Permissions::from_mode(0o600))?;
    socket.listen(BACKLOG)
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
