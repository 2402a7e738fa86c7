//! From a prior to a fix: region, candidate tiles, registration, `Fix` or `NoFix`.

mod answer;
pub mod candidates;

pub use answer::{Answer, Fix, NoFix, Point, Reason};

use crate::camera::View;
use crate::geodesy::Geodetic;
use crate::pixels::Gray;
use crate::store::{Reader, StoreError};

/// Why the question itself cannot be asked.
#[derive(Debug, thiserror::Error)]
pub enum LocateError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A parameter is out of range.
    #[error("{name} = {value}: {expected}")]
    Parameter {
        /// Its name as callers spell it.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
}

impl LocateError {
    /// A stable word for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(e) => e.code(),
            Self::Parameter { .. } => "bad_parameter",
        }
    }
}

/// Where the aircraft is thought to be. The camera's nadir lies inside with the stated certainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PositionPrior {
    /// A Gaussian: the 99.7 % ellipse is searched.
    Gaussian {
        /// Most likely nadir.
        centre: Geodetic,
        /// One standard deviation towards east, metres.
        sigma_east_m: f64,
        /// One standard deviation towards north, metres.
        sigma_north_m: f64,
        /// Correlation of both, in (-1, 1).
        correlation: f64,
    },
    /// Anywhere in a north-up square.
    Square {
        /// Its middle.
        centre: Geodetic,
        /// Half its edge, metres.
        half_width_m: f64,
    },
    /// Anywhere on the layer.
    WholeLayer,
}

/// A stated heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingPrior {
    /// Radians clockwise from true north.
    pub heading_rad: f64,
    /// One standard deviation, radians.
    pub sigma_rad: f64,
}

/// One absolute registration to make.
#[derive(Debug, Clone, PartialEq)]
pub struct FixRequest {
    /// Layer to search.
    pub layer: String,
    /// Where.
    pub position: PositionPrior,
    /// Heading, or `None` for a full turn.
    pub heading: Option<HeadingPrior>,
    /// How the camera looked.
    pub view: View,
    /// One standard deviation of the height's (or GSD's) relative error.
    pub scale_sigma_ratio: f64,
    /// When the image was taken, seconds; echoed in the answer.
    pub time_s: Option<f64>,
}

/// Locates a frame. `threads` bounds the parallelism.
///
/// # Errors
/// Only where the question or the store is at fault: "no fix" is an answer.
pub fn locate(_store: &Reader, _frame: &Gray, _request: &FixRequest, _threads: usize) -> Result<Answer, LocateError> {
    unimplemented!()
}
