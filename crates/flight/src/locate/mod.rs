//! Absolute registration: from a frame and a prior to a fix, or to no fix and why.
//!
//! A registration is a chain of values: prepared frame, coarse peaks, refined places, verdict, answer. [`locate`] returns the answer,
//! [`locate_traced`] also the values on the way.

mod answer;
mod answering;
mod area;
mod camera_pose;
mod cancellation;
pub mod candidates;
mod coarse_peaks;
mod coarse_search;
pub mod coverage;
mod domain;
mod epochs;
mod error;
mod fix_covariance;
mod frame_pyramid;
mod hard_refine;
mod held_vote;
mod hints;
mod hypotheses;
mod in_parallel;
mod levels;
mod locate_frame;
mod map;
mod measured_place;
mod near_maxima;
mod observation;
mod parameters;
mod place_estimate;
mod prepare;
mod refine;
mod refined_place;
mod refusal;
mod request;
mod rival_votes;
mod rivals;
mod search_context;
mod search_extent;
mod search_region;
mod search_steps;
mod searched_ground;
mod soft_refine;
mod surface_maximum;
mod tilt_freedom;
mod trace;
mod verify;
mod weighed_place;
mod wide;
mod window_pass;

pub use answer::{Answer, Fix, NoFix, PositionOf, Reason, SearchedMap};
pub use camera_pose::CameraPose;
pub use cancellation::CancellationToken;
pub use epochs::requested_layer;
pub use error::LocateError;
pub use hints::{Hint, Hints, hints};
pub use hypotheses::Hypothesis;
pub use levels::{CellLevel, Levels};
pub use locate_frame::{locate, locate_cancellable, locate_traced, locate_weighed};
pub use map::PixelWindow;
pub use observation::Observation;
pub use parameters::{FixParameters, ViewParameters};
pub use request::{FixRequest, HeadingPrior, PositionPrior};
pub use search_region::attitude_reach_m;
pub use trace::{Decision, Trace, TracedPeak, TracedPlace, TracedSurface, TracedWindows};
pub use weighed_place::WeighedPlace;
