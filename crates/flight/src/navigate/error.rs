//! Why a flight cannot go on.

use crate::locate::LocateError;
use overfly_core::camera::CameraError;
use overfly_core::geodesy::GeodesyError;

/// Why an image gives no position.
#[derive(Debug, thiserror::Error)]
pub enum NavigateError {
    /// The store or the question is at fault.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// The camera cannot have taken such an image.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A position is none.
    #[error(transparent)]
    Position(#[from] GeodesyError),
    /// Time does not go backwards.
    #[error("an image of {time_s} s follows one of {last_s} s: images must come in order of time")]
    OutOfOrder {
        /// Of the image.
        time_s: f64,
        /// Of the one before.
        last_s: f64,
    },
}

impl NavigateError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Locate(error) => error.code(),
            Self::Camera(error) => error.code(),
            Self::Position(_) => "position_out_of_range",
            Self::OutOfOrder { .. } => "out_of_order",
        }
    }
}
