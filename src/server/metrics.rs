//! `Metrics`: counts and times of requests, for `/metrics`. Each service has its own.

use super::problem::Panicked;
use ::metrics::{Recorder, counter, gauge, histogram, with_local_recorder};
use axum::extract::{MatchedPath, Request, State};
use axum::middleware::Next;
use axum::response::Response;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle, PrometheusRecorder};
use std::sync::Arc;
use std::time::Instant;

/// Upper bounds of the histogram's buckets, seconds.
const BUCKETS_S: [f64; 12] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 1.0, 3.0, 10.0, 30.0, 60.0];

/// A metrics recorder and the handle that renders it.
#[derive(Clone)]
pub(super) struct Metrics {
    recorder: Arc<PrometheusRecorder>,
    handle: PrometheusHandle,
}

impl std::fmt::Debug for Metrics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Metrics").finish_non_exhaustive()
    }
}

impl Metrics {
    pub(super) fn new() -> Self {
        let builder = PrometheusBuilder::new().set_buckets(&BUCKETS_S).expect("the buckets are not empty");
        let recorder = builder.build_recorder();
        let handle = recorder.handle();
        Self { recorder: Arc::new(recorder), handle }
    }

    fn record(&self, act: impl FnOnce()) {
        let recorder: &dyn Recorder = &*self.recorder;
        with_local_recorder(recorder, act);
    }

    /// The metrics in Prometheus's text format.
    pub(super) fn render(&self, layers: usize, tiles: u64) -> String {
        self.record(|| {
            gauge!("overfly_store_layers").set(layers as f64);
            gauge!("overfly_store_tiles").set(tiles as f64);
        });
        self.handle.render()
    }

    /// Moves recorded samples into their buckets; otherwise they accumulate until the metrics are rendered.
    pub(super) fn keep_up(&self) {
        self.handle.run_upkeep();
    }
}

/// Counts a request and its time under its route. (Raw paths would be unbounded labels.)
pub(super) async fn observe(State(metrics): State<Metrics>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let route = request.extensions().get::<MatchedPath>().map_or("none".to_owned(), |p| p.as_str().to_owned());
    let method = match request.method().as_str() {
        known @ ("GET" | "HEAD" | "POST" | "PUT" | "DELETE" | "OPTIONS" | "PATCH") => known.to_owned(),
        _ => "other".to_owned(),
    };
    let response = next.run(request).await;
    let panicked = response.extensions().get::<Panicked>().is_some();
    let status = response.status();
    let elapsed_s = start.elapsed().as_secs_f64();
    tracing::debug!(%method, %route, status = status.as_u16(), elapsed_s, "answered");
    metrics.record(|| {
        counter!("overfly_http_requests_total", "method" => method, "route" => route.clone(), "status" => status.as_u16().to_string())
            .increment(1);
        counter!("overfly_panics_total").increment(u64::from(panicked));
        histogram!("overfly_http_request_seconds", "route" => route).record(elapsed_s);
    });
    response
}
