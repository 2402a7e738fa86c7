//! Connections: HTTP/1.1 on accepted streams, with limits on their number and on their idle time.

use super::error::ServerError;
use axum::Router;
use axum::extract::Request;
use axum::http::Method;
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use axum::serve::Listener;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio_io_timeout::TimeoutStream;

/// Most connections at the same time; on further ones only what an operator or an aircraft cannot wait for is answered.
const CONNECTIONS: u32 = 512;
/// The longest time for the head of a request, and the longest idle time between two requests.
const HEAD_TIME: Duration = Duration::from_secs(15);
/// The longest time in which a reader takes nothing of an answer.
const STALLED_TIME: Duration = Duration::from_secs(30);
/// Largest head of a request, and what is held of answers that nobody takes, bytes.
const BUFFER_BYTES: usize = 64 << 10;
/// Connections beyond [`CONNECTIONS`], each for one request; further ones wait to be accepted.
const RESERVED: u32 = 64;
/// The longest time for the head of a request on a reserved connection, and in which its reader takes nothing.
const RESERVED_TIME: Duration = Duration::from_secs(2);
/// What is answered on a reserved connection, without a body of the request.
const ESSENTIAL: [&str; 3] = ["/healthz", "/readyz", "/v1/candidates"];

/// How a connection is served.
struct Terms {
    app: Router,
    head_time: Duration,
    stalled_time: Duration,
    is_kept: bool,
}

/// Answers on every connection until `stop` is ready; returns when all open requests are answered.
pub(super) async fn answer<L: Listener>(mut listener: L, app: Router, stop: impl Future<Output = ()>) {
    let (ending, _) = watch::channel(false);
    let places = Arc::new(Semaphore::new(CONNECTIONS as usize));
    let reserve = Arc::new(Semaphore::new(RESERVED as usize));
    let essential = app.clone().layer(from_fn(essential_only));
    let app = app.layer(from_fn(in_turn));
    let mut stop = pin!(stop);
    loop {
        let next = async {
            let (place, is_reserved) = tokio::select! {
                biased;
                place = places.clone().acquire_owned() => (place, false),
                place = reserve.clone().acquire_owned() => (place, true),
            };
            let place = place.expect("the semaphores are never closed");
            (listener.accept().await.0, place, is_reserved)
        };
        let (stream, place, is_reserved) = tokio::select! {
            () = &mut stop => break,
            next = next => next,
        };
        let terms = if is_reserved {
            let app = essential.clone();
            Terms { app, head_time: RESERVED_TIME, stalled_time: RESERVED_TIME, is_kept: false }
        } else {
            Terms { app: app.clone(), head_time: HEAD_TIME, stalled_time: STALLED_TIME, is_kept: true }
        };
        tokio::spawn(serve_connection(stream, terms, ending.subscribe(), place));
    }
    drop(listener);
    ending.send_replace(true);
    // All places are free once all connections have ended.
    let _all = places.acquire_many(CONNECTIONS).await.expect("the semaphore is never closed");
    let _rest = reserve.acquire_many(RESERVED).await.expect("the semaphore is never closed");
}

/// Lets all other connections go first. A connection with many requests in its buffer would answer them all before its thread turns to
/// another one.
async fn in_turn(request: Request, next: Next) -> Response {
    tokio::task::yield_now().await;
    next.run(request).await
}

/// Refuses what can wait.
async fn essential_only(request: Request, next: Next) -> Response {
    if request.method() != Method::POST && ESSENTIAL.contains(&request.uri().path()) {
        next.run(request).await
    } else {
        ServerError::Crowded.into_response()
    }
}

async fn serve_connection<S>(stream: S, terms: Terms, mut ending: watch::Receiver<bool>, _place: OwnedSemaphorePermit)
where
    S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin + Send + 'static,
{
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(terms.stalled_time));
    let mut connection = pin!(
        http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(terms.head_time)
            .max_buf_size(BUFFER_BYTES)
            .keep_alive(terms.is_kept)
            .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(terms.app))
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
