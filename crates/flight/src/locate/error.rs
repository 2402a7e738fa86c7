//! `LocateError`: why a request cannot be answered. "No fix" is an answer, not an error.

use overfly_core::camera::CameraError;
use overfly_store::StoreError;

/// Why a request cannot be answered. Parameters are named as callers spell them.
#[derive(Debug, thiserror::Error)]
pub enum LocateError {
    /// The store failed, or has no such layer.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The camera cannot have taken this frame.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A parameter is NaN, infinite or out of range.
    #[error("{name} = {value}: {expected}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The values accepted.
        expected: &'static str,
    },
    /// A parameter that the others require is missing.
    #[error("{name} is missing: {expected}")]
    Missing {
        /// Name of the parameter.
        name: &'static str,
        /// What is expected.
        expected: &'static str,
    },
    /// A parameter has no meaning beside another one.
    #[error("{name} cannot be combined with {with}")]
    Conflict {
        /// Name of the parameter.
        name: &'static str,
        /// The parameters it contradicts.
        with: &'static str,
    },
    /// The work was cancelled by its [`super::CancellationToken`].
    #[error("the search was cancelled")]
    Cancelled,
    /// The region to search is too large for this frame.
    #[error(
        "the search would compare {pixels:.2e} coarse pixels under {hypotheses} headings and scales, at most {limit:.0e} together are allowed; narrow the position, heading or height, or build the layer again if its store has no cells"
    )]
    TooWide {
        /// Coarse pixels to search.
        pixels: f64,
        /// Headings and scales to search.
        hypotheses: usize,
        /// The bound on their product.
        limit: f64,
    },
    /// The tiles that a search would read are too many to be listed.
    #[error("the search may read more than {most} tiles, the limit of an answer; narrow the position")]
    TooManyTiles {
        /// How many may be listed.
        most: u64,
    },
    /// The search needs more memory than it may use.
    #[error(
        "the cells of layer {layer} at zoom {zoom} that the search needs do not fit into the memory allowed; narrow the position, state a heading, or allow more memory"
    )]
    MemoryLimit {
        /// Name of the layer.
        layer: String,
        /// Zoom of the level.
        zoom: u8,
    },
}

impl LocateError {
    /// The stable error code for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(error) => error.code(),
            Self::Camera(error) => error.code(),
            Self::Parameter { .. } | Self::Missing { .. } | Self::Conflict { .. } => "bad_parameter",
            Self::Cancelled => "given_up",
            Self::TooWide { .. } => "search_too_wide",
            Self::TooManyTiles { .. } => "too_many_tiles",
            Self::MemoryLimit { .. } => "memory_too_small",
        }
    }

    /// The parameter at fault, where it is one.
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Parameter { name, .. } | Self::Missing { name, .. } | Self::Conflict { name, .. } => Some(name),
            Self::Camera(error) => Some(match error {
                CameraError::NotPositive { name, .. } | CameraError::NotFinite { name, .. } => name,
                CameraError::TooFarOffNadir { pitch_deg, limit_deg, .. } if pitch_deg.abs() <= *limit_deg => "roll_deg",
                CameraError::TooFarOffNadir { .. } => "pitch_deg",
                CameraError::AttitudeSigma { .. } => "attitude_sigma_deg",
                CameraError::OtherAspect { .. } => "camera",
                CameraError::NoGround | CameraError::BelowGround { .. } => "height_msl_m",
            }),
            Self::Store(_)
            | Self::Cancelled
            | Self::TooWide { .. }
            | Self::TooManyTiles { .. }
            | Self::MemoryLimit { .. } => None,
        }
    }
}
