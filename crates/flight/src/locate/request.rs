//! What is asked of `locate`, and why a question can be refused.

use overfly_core::camera::{CameraError, View};
use overfly_core::geodesy::Geodetic;
use overfly_store::StoreError;

/// Why the question itself cannot be asked.
#[derive(Debug, thiserror::Error)]
pub enum LocateError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The camera cannot have taken this frame.
    #[error(transparent)]
    Camera(#[from] CameraError),
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
    /// The caller no longer waits for the answer.
    #[error("the search was given up")]
    GivenUp,
    /// The position left open is too wide for this frame.
    #[error(
        "the search would compare {pixels:.2e} coarse pixels under {hypotheses} headings and scales; narrow the position, heading or height (at most {limit:.0e} together), or build the layer again if it was built before stores had cells"
    )]
    TooWide {
        /// Coarse pixels left open.
        pixels: f64,
        /// Headings and scales left open.
        hypotheses: usize,
        /// The bound on their product.
        limit: f64,
    },
    /// What the search would have to hold in memory is more than it may.
    #[error(
        "the cells of layer {layer} at zoom {zoom} that the search needs do not fit into the memory allowed; narrow the position, state a heading, or allow more (serve --memory)"
    )]
    NoRoom {
        /// Of which layer.
        layer: String,
        /// Of which level.
        zoom: u8,
    },
}

impl LocateError {
    /// A stable word for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(error) => error.code(),
            Self::Camera(error) => error.code(),
            Self::Parameter { .. } => "bad_parameter",
            Self::GivenUp => "given_up",
            Self::TooWide { .. } => "search_too_wide",
            Self::NoRoom { .. } => "memory_too_small",
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

impl FixRequest {
    /// Refuses what is not finite or out of range.
    ///
    /// # Errors
    /// [`LocateError::Parameter`] naming it.
    pub fn check(&self) -> Result<(), LocateError> {
        const POSITIVE: &str = "must be a positive number of metres below 1e7";
        match self.position {
            PositionPrior::Gaussian { sigma_east_m, sigma_north_m, correlation, .. } => {
                within("sigma_east_m", sigma_east_m, 1e-3, 1e7, POSITIVE)?;
                within("sigma_north_m", sigma_north_m, 1e-3, 1e7, POSITIVE)?;
                within("correlation", correlation, -0.999, 0.999, "must lie between -0.999 and 0.999")?;
            }
            PositionPrior::Square { half_width_m, .. } => within("half_width_m", half_width_m, 0.0, 1e7, POSITIVE)?,
            PositionPrior::WholeLayer => {}
        }
        if let Some(HeadingPrior { heading_rad, sigma_rad }) = self.heading {
            within("heading_deg", heading_rad.to_degrees(), -720.0, 720.0, "must be a heading in degrees")?;
            let expected = "must lie between 0 and 180 degrees";
            within("heading_sigma_deg", sigma_rad.to_degrees(), 0.0, 180.0 + 1e-9, expected)?;
        }
        within("height_sigma_ratio", self.scale_sigma_ratio, 0.0, 0.3, "must lie between 0 and 0.3")?;
        match self.time_s {
            Some(time_s) if !time_s.is_finite() => {
                Err(LocateError::Parameter { name: "time_s", value: time_s, expected: "must be a finite number" })
            }
            _ => Ok(()),
        }
    }
}

fn within(name: &'static str, value: f64, from: f64, to: f64, expected: &'static str) -> Result<(), LocateError> {
    if (from..=to).contains(&value) { Ok(()) } else { Err(LocateError::Parameter { name, value, expected }) }
}
