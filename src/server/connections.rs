//! Connections: HTTP/1.1 on accepted streams, with bounds on how many there are and on how long a silent one is kept.

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

/// Connections at once; more wait to be accepted.
const CONNECTIONS: u32 = 512;
/// How long a client may take over the head of a request, and how long a connection may be idle between two.
const HEAD_TIME: Duration = Duration::from_secs(15);

/// Answers on every connection until `stop`, then ends when open requests have their answers.
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
        tokio::spawn(converse(stream, app.clone(), ending.subscribe(), place));
    }
    drop(listener);
    ending.send_replace(true);
    // Every place is free again once every connection has ended.
    let _all = places.acquire_many(CONNECTIONS).await.expect("the semaphore is never closed");
}

async fn converse<S>(stream: S, app: Router, mut ending: watch::Receiver<bool>, _place: OwnedSemaphorePermit)
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
        () = told(&mut ending) => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = outcome {
        tracing::debug!(%error, "a connection broke off");
    }
}

/// Ready once the service ends.
async fn told(ending: &mut watch::Receiver<bool>) {
    // The sender gone is the end as well.
    let _ = ending.wait_for(|ending| *ending).await;
}
