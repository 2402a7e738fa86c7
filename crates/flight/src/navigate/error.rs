//! Why a filter step fails, and why a flight cannot go on.

use crate::locate::LocateError;
use overfly_core::camera::CameraError;
use overfly_core::geodesy::GeodesyError;

/// Why the navigation filter cannot take a step. The filter is unchanged where an update fails with
/// [`FilterError::SingularInnovation`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilterError {
    /// The innovation covariance has no inverse: state and measurement are both stated to be exact.
    #[error("the innovation covariance of the {measurement} is singular")]
    SingularInnovation {
        /// Which measurement: "fix" or "sensor reading".
        measurement: &'static str,
    },
    /// The position leaves the local frame.
    #[error(transparent)]
    Position(#[from] GeodesyError),
}

/// Why an image gives no position.
#[derive(Debug, thiserror::Error)]
pub enum NavigateError {
    /// The store or the request cannot be used.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// The camera cannot have taken this image.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The navigation filter cannot take a step.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// A position is out of range.
    #[error(transparent)]
    Position(#[from] GeodesyError),
}

impl NavigateError {
    /// The stable error code for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Locate(error) => error.code(),
            Self::Camera(error) => error.code(),
            Self::Filter(FilterError::SingularInnovation { .. }) => "singular_innovation",
            Self::Filter(FilterError::Position(_)) | Self::Position(_) => "position_out_of_range",
        }
    }
}
