//! `PlanError`: why nothing can be planned.

use crate::remedy::Remedy;
use overfly_core::coupling::CouplingError;
use overfly_core::region::RegionError;
use overfly_store::StoreError;
use std::path::PathBuf;

/// Why nothing can be planned.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A file cannot be read.
    #[error("{path}: cannot be read: {cause}")]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// A field of an aircraft file is missing, unknown or of the wrong kind.
    #[error("{path} does not describe an aircraft: {reason}")]
    NotAnAircraft {
        /// Which file.
        path: PathBuf,
        /// Which field, and what is wrong.
        reason: String,
    },
    /// Not a valid calibration file.
    #[error("{path} is not a calibration: {reason}")]
    NotACalibration {
        /// Which file.
        path: PathBuf,
        /// Which field, and what is wrong.
        reason: String,
    },
    /// Not a valid route.
    #[error("{path} is not a route: {reason}")]
    NotARoute {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Parameters outside the domain of the coupling models.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
    /// An image that makes no search region.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl PlanError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "unreadable",
            Self::NotAnAircraft { .. } => "not_an_aircraft",
            Self::NotACalibration { .. } => "not_a_calibration",
            Self::NotARoute { .. } => "not_a_route",
            Self::Coupling(e) => e.code(),
            Self::Region(e) => e.code(),
            Self::Store(e) => e.code(),
        }
    }

    /// What the user can do, where that is known. Errors of the store have remedies of their own.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Unreadable { .. } => Some(Remedy::CheckPath),
            Self::NotARoute { .. } => Some(Remedy::UseRouteFormat),
            Self::NotAnAircraft { .. } | Self::NotACalibration { .. } => None,
            Self::Coupling(_) | Self::Region(_) | Self::Store(_) => None,
        }
    }
}
