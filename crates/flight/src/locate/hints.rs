//! Hints: at which other heading, scale or layer a frame matches that was not located. A hint is never a fix: it says which
//! statement of the request to check.

use super::answer::{Answer, Fix};
use super::cancellation::CancellationToken;
use super::epochs::searched_layers;
use super::error::LocateError;
use super::locate_frame::locate_cancellable;
use super::request::{FixRequest, HeadingPrior};
use overfly_core::camera::{Camera, View};
use overfly_core::pixels::Gray;
use overfly_store::Reader;
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Metres in a foot.
const FOOT_M: f64 = 0.3048;
/// The scales that are tried, as ratios to the stated one: steps of a factor of 1.26 cover half to twice with their standard
/// deviation. Large ones first: they are searched faster.
const SCALES: [f64; 6] = [1.26, 1.59, 2.0, 0.79, 0.63, 0.5];
/// One trial takes at most this part of the time limit.
const TRIAL_SHARE: u32 = 4;
/// The standard deviation of a scale that is tried, as a ratio.
const SCALE_SIGMA: f64 = 0.06;

/// A change of the request with which the frame matches.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Hint {
    /// The stated heading is right in radians.
    HeadingInRadians {
        /// The stated heading, as degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// Another heading matches.
    Heading {
        /// The stated heading, degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// The stated height is right in feet.
    HeightInFeet {
        /// The stated height, as metres.
        stated_m: f64,
        /// The height that matches, metres.
        height_m: f64,
    },
    /// Another scale matches.
    Scale {
        /// The scale that matches over the stated one: the height, or the ground sample distance.
        ratio: f64,
    },
    /// The frame matches in another layer.
    Layer {
        /// The layer.
        layer: String,
        /// Date of its imagery there, if known.
        map_epoch: Option<String>,
    },
}

/// Searches for hints about a request that gave no fix, until `limit` has passed: first what people confuse most often. An empty list
/// means that nothing was found in that time.
///
/// # Errors
/// [`LocateError`] where the request or the store cannot be used.
pub fn hints(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    limit: Duration,
) -> Result<Vec<Hint>, LocateError> {
    let start = Instant::now();
    let mut found: Vec<Hint> = Vec::new();
    for trial in trials(store, request) {
        let left = limit.saturating_sub(start.elapsed());
        if left.is_zero() {
            break;
        }
        if trial.is_scale() && found.iter().any(|hint| matches!(hint, Hint::Scale { .. })) {
            continue;
        }
        let most = left.min(limit / TRIAL_SHARE);
        let Some(Answer::Fix(fix)) = locate_within(store, frame, &trial.request, threads, most)? else { continue };
        let hint = trial.hint(request, frame, &fix);
        // The confusion of a heading or a unit explains everything.
        let explains = !matches!(hint, Hint::Scale { .. } | Hint::Layer { .. });
        found.push(hint);
        if explains {
            break;
        }
    }
    Ok(found)
}

/// The answer, if it is found in time. A scale or a layer that cannot be searched has none.
fn locate_within(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    most: Duration,
) -> Result<Option<Answer>, LocateError> {
    let cancellation = CancellationToken::new();
    let (done, wait) = channel::<()>();
    let outcome = std::thread::scope(|scope| {
        let timer = cancellation.clone();
        scope.spawn(move || {
            if wait.recv_timeout(most) == Err(RecvTimeoutError::Timeout) {
                timer.cancel();
            }
        });
        let outcome = locate_cancellable(store, frame, request, threads, &cancellation);
        drop(done);
        outcome
    });
    match outcome {
        Ok(answer) => Ok(Some(answer)),
        Err(error @ LocateError::Store(_)) => Err(error),
        Err(_) => Ok(None),
    }
}

/// A changed request.
struct Trial {
    request: FixRequest,
    change: Change,
}

/// What is changed.
enum Change {
    Radians(f64),
    AnyHeading(f64),
    Feet(f64),
    Scale,
    Layer,
}

impl Trial {
    fn is_scale(&self) -> bool {
        matches!(self.change, Change::Scale)
    }

    fn hint(&self, stated: &FixRequest, frame: &Gray, fix: &Fix) -> Hint {
        let heading_deg = fix.heading.degrees();
        match self.change {
            Change::Radians(stated_deg) => Hint::HeadingInRadians { stated_deg, heading_deg },
            Change::AnyHeading(stated_deg) => Hint::Heading { stated_deg, heading_deg },
            Change::Feet(stated_m) => Hint::HeightInFeet { stated_m, height_m: stated_m * FOOT_M },
            Change::Scale => Hint::Scale { ratio: fix.gsd_m_per_px / gsd_m_per_px(&stated.view, frame) },
            Change::Layer => Hint::Layer { layer: self.request.layer.clone(), map_epoch: fix.map_epoch.clone() },
        }
    }
}

/// The requests that are tried, the likeliest confusion first.
fn trials(store: &Reader, request: &FixRequest) -> Vec<Trial> {
    let mut trials = Vec::new();
    let scaled = |ratio: f64| FixRequest {
        view: scaled_view(request.view.clone(), ratio),
        scale_sigma_ratio: request.scale_sigma_ratio.max(SCALE_SIGMA),
        ..request.clone()
    };
    if let Some(heading) = request.heading {
        let stated_deg = heading.heading_rad.to_degrees();
        if (0.0..TAU).contains(&stated_deg) {
            let heading = Some(HeadingPrior { heading_rad: stated_deg, ..heading });
            trials.push(Trial {
                request: FixRequest { heading, ..request.clone() },
                change: Change::Radians(stated_deg),
            });
        }
    }
    if let View::Posed { height_agl_m, .. } = request.view {
        trials.push(Trial { request: scaled(FOOT_M), change: Change::Feet(height_agl_m) });
    }
    if let Some(heading) = request.heading {
        let stated_deg = heading.heading_rad.to_degrees();
        let request = FixRequest { heading: None, ..request.clone() };
        trials.push(Trial { request, change: Change::AnyHeading(stated_deg) });
    }
    let searched = searched_layers(store, &request.layer).unwrap_or_default();
    for layer in store.finished_layers().filter(|layer| !searched.iter().any(|s| s.name == layer.name)) {
        let request = FixRequest { layer: layer.name.clone(), ..request.clone() };
        trials.push(Trial { request, change: Change::Layer });
    }
    trials.extend(SCALES.map(|ratio| Trial { request: scaled(ratio), change: Change::Scale }));
    trials
}

fn scaled_view(view: View, ratio: f64) -> View {
    match view {
        View::Nadir { gsd_m_per_px } => View::Nadir { gsd_m_per_px: gsd_m_per_px * ratio },
        View::Posed { intrinsics, height_agl_m, attitude } => {
            View::Posed { intrinsics, height_agl_m: height_agl_m * ratio, attitude }
        }
    }
}

/// The ground sample distance that a view states for a frame, metres per pixel.
fn gsd_m_per_px(view: &View, frame: &Gray) -> f64 {
    let camera = Camera::new(view, frame.width_px() as u32, frame.height_px() as u32);
    camera.map_or(f64::NAN, |camera| camera.gsd_m_per_px())
}
