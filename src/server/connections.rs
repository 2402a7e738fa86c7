//! Connections: HTTP/1.1 on accepted streams, with limits on their number and on their idle time.

use axum::Router;
use axum::serve::Listener;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// Most connections at the same time; further ones wait to be accepted.
const CONNECTIONS: u32 = 512;
/// The longest time for the head of a request, and the longest idle time between two requests.
const HEAD_TIME: Duration = Duration::from_secs(15);

/// Answers on every connection until `stop` is ready; returns when all open requests are answered.
pub(super) async fn answer<L: Listener>(mut listener: L, app: Router, stop: impl Future<Output = ()>) {
    let (ending, _) = watch::channel(false);
    let places = Arc::new(Semaphore::new(CONNECTIONS as usize));
    let mut stop = pin!(stop);
    loop {
        let next = async {
            let place = places.clone().acquire_owned().await.expect("the semaphore is never closed");
            (listener.accept().await.0, place)
        };
        let (stream, place) = tokio::select! {
            () = &mut stop => break,
            next = next => next,
        };
        tokio::spawn(serve_connection(stream, app.clone(), ending.subscribe(), place));
    }
    drop(listener);
    ending.send_replace(true);
    // All places are free once all connections have ended.
    let _all = places.acquire_many(CONNECTIONS).await.expect("the semaphore is never closed");
}

async fn serve_connection<S>(stream: S, app: Router, mut ending: watch::Receiver<bool>, _place: OwnedSemaphorePermit)
where
    S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin + Send + 'static,
{
    let mut connection = pin!(
        http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(HEAD_TIME)
            .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app))
    );
    let outcome = tokio::select! {
        outcome = connection.as_mut() => outcome,
        () = stopped(&mut ending) => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = outcome {
        tracing::debug!(%error, "a connection was broken");
    }
}

/// Returns once the service stops.
async fn stopped(ending: &mut watch::Receiver<bool>) {
    // A dropped sender means the same.
    let _ = ending.wait_for(|ending| *ending).await;
}
