//! `MeteredBody`: a body whose memory is reserved as it arrives, and which must keep arriving. A client that holds its body back holds
//! no more memory than it has sent, no place of an upload, and is soon cut off.

use super::error::ServerError;
use super::form_error::FormError;
use super::limits::Limits;
use super::work::{ArrivingUpload, Upload, Work};
use axum::body::{Body, Bytes};
use hyper::body::{Frame, SizeHint};
use parking_lot::Mutex;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::time::{Instant, Sleep};

/// A body that reports to its meter.
struct MeteredBody {
    body: Body,
    meter: Arc<Mutex<Option<MeterState>>>,
    window: Window,
}

/// In each window of time, so many bytes must arrive, or the end.
struct Window {
    time: Duration,
    bytes: usize,
    received: usize,
    end: Pin<Box<Sleep>>,
}

/// What is known of a body.
struct MeterState {
    upload: ArrivingUpload,
    stopped: Option<Stop>,
}

/// Why a body is not read on.
#[derive(Debug, Clone, Copy)]
enum Stop {
    Busy,
    TooSlow,
}

/// What was counted of a body, and the memory that is reserved for it.
pub(super) struct Meter {
    state: Arc<Mutex<Option<MeterState>>>,
    limits: Limits,
}

impl Meter {
    /// Begins to count a body of about `bytes`. Returns the body to read in its place.
    ///
    /// # Errors
    /// [`ServerError::Busy`] if there is no room for it now.
    pub fn begin(work: &Work, limits: &Limits, bytes: usize, body: Body) -> Result<(Body, Self), ServerError> {
        let upload = work.begin_upload(bytes)?;
        let state = Arc::new(Mutex::new(Some(MeterState { upload, stopped: None })));
        let (time, least) = (limits.body_window, limits.body_window_bytes);
        let window = Window { time, bytes: least, received: 0, end: Box::pin(tokio::time::sleep(time)) };
        let metered = MeteredBody { body, meter: state.clone(), window };
        Ok((Body::new(metered), Self { state, limits: *limits }))
    }

    /// What was read, with its reserved memory.
    ///
    /// # Errors
    /// [`ServerError::Busy`] if there was or is no room, [`FormError::TooSlow`] if the body was cut off, or the error of the reading.
    pub fn finish<T>(self, read: Result<T, FormError>) -> Result<(T, Upload), ServerError> {
        let state = self.state.lock().take().expect("only this function takes it");
        match (state.stopped, read) {
            (Some(Stop::Busy), _) => Err(ServerError::Busy),
            (Some(Stop::TooSlow), _) => Err(FormError::Stalled {
                bytes: self.limits.body_window_bytes,
                window_s: self.limits.body_window.as_secs_f64(),
            }
            .into()),
            (None, Err(error)) => Err(error.into()),
            (None, Ok(value)) => Ok((value, state.upload.finish()?)),
        }
    }
}

impl MeteredBody {
    /// Counts what has arrived.
    fn count(&mut self, bytes: usize) -> Result<(), Stop> {
        self.window.count(bytes);
        match self.meter.lock().as_mut() {
            Some(state) => state.upload.grow(bytes).map_err(|_| Stop::Busy),
            // Nobody waits for the body any more.
            None => Err(Stop::Busy),
        }
    }

    fn stop(&self, stop: Stop) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if let Some(state) = self.meter.lock().as_mut() {
            state.stopped = Some(stop);
        }
        Poll::Ready(Some(Err(axum::Error::new(std::io::Error::other("the body is not read on")))))
    }
}

impl Window {
    fn count(&mut self, bytes: usize) {
        self.received += bytes;
        if self.received >= self.bytes {
            self.received = 0;
            self.end.as_mut().reset(Instant::now() + self.time);
        }
    }
}

impl hyper::body::Body for MeteredBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let this = self.get_mut();
        let frame = Pin::new(&mut this.body).poll_frame(context);
        if frame.is_pending() && this.window.end.as_mut().poll(context).is_ready() {
            return this.stop(Stop::TooSlow);
        }
        if let Poll::Ready(Some(Ok(frame))) = &frame
            && let Err(stop) = this.count(frame.data_ref().map_or(0, Bytes::len))
        {
            return this.stop(stop);
        }
        frame
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
