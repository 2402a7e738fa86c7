//! `Metrics`: counts and times of requests, fixes and motions, for `/metrics`. Each service has its own.

use super::dto::{AnswerJson, MotionReply};
use super::problem::Panicked;
use ::metrics::{Recorder, Unit, counter, describe_counter, describe_histogram, gauge, histogram, with_local_recorder};
use axum::extract::{MatchedPath, Request, State};
use axum::middleware::Next;
use axum::response::Response;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle, PrometheusRecorder};
use std::sync::Arc;
use std::time::Instant;

/// Upper bounds of the histogram's buckets, seconds.
const BUCKETS_S: [f64; 12] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 1.0, 3.0, 10.0, 30.0, 60.0];

const FIXES: &str = "overfly_fixes_total";
const NO_FIXES: &str = "overfly_no_fixes_total";
const FIX_SECONDS: &str = "overfly_fix_seconds";
const MOTIONS: &str = "overfly_motions_total";
const NO_MOTIONS: &str = "overfly_no_motions_total";
const MOTION_SECONDS: &str = "overfly_motion_seconds";
const REQUESTS: &str = "overfly_http_requests_total";
const REQUEST_SECONDS: &str = "overfly_http_request_seconds";
const PANICS: &str = "overfly_panics_total";

/// The counters, as `/metrics` describes them.
const COUNTERS: [(&str, &str); 6] = [
    (FIXES, "Frames that were located"),
    (NO_FIXES, "Frames that were not located, by reason"),
    (MOTIONS, "Pairs of frames that were registered"),
    (NO_MOTIONS, "Pairs of frames that were not registered, by reason"),
    (REQUESTS, "Requests, by method, route and status"),
    (PANICS, "Requests that failed unexpectedly"),
];
/// The histograms, as `/metrics` describes them.
const HISTOGRAMS: [(&str, &str); 3] = [
    (FIX_SECONDS, "Time from a decoded frame to a fix or no fix"),
    (MOTION_SECONDS, "Time from two decoded frames to a motion or no motion"),
    (REQUEST_SECONDS, "Time from a request to its answer, by route"),
];

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
        let metrics = Self { recorder: Arc::new(recorder), handle };
        metrics.record(|| {
            for (name, description) in COUNTERS {
                describe_counter!(name, description);
            }
            for (name, description) in HISTOGRAMS {
                describe_histogram!(name, Unit::Seconds, description);
            }
            // Rates need a count from the start.
            for name in [FIXES, MOTIONS, PANICS] {
                counter!(name).increment(0);
            }
        });
        metrics
    }

    fn record(&self, act: impl FnOnce()) {
        let recorder: &dyn Recorder = &*self.recorder;
        with_local_recorder(recorder, act);
    }

    /// Counts an answer to a fix, and its time.
    pub(super) fn count_fix(&self, answer: &AnswerJson) {
        self.record(|| {
            match answer.no_fix_reason() {
                None => counter!(FIXES).increment(1),
                Some(reason) => counter!(NO_FIXES, "reason" => reason).increment(1),
            }
            histogram!(FIX_SECONDS).record(answer.elapsed_s());
        });
    }

    /// Counts an answer to a motion, and its time.
    pub(super) fn count_motion(&self, answer: &MotionReply) {
        self.record(|| {
            match answer.no_motion_reason() {
                None => counter!(MOTIONS).increment(1),
                Some(reason) => counter!(NO_MOTIONS, "reason" => reason).increment(1),
            }
            histogram!(MOTION_SECONDS).record(answer.elapsed_s());
        });
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
        counter!(REQUESTS, "method" => method, "route" => route.clone(), "status" => status.as_u16().to_string())
            .increment(1);
        counter!(PANICS).increment(u64::from(panicked));
        histogram!(REQUEST_SECONDS, "route" => route).record(elapsed_s);
    });
    response
}
