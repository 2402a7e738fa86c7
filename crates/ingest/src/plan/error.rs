//! Why nothing can be planned.

use overfly_core::coupling::CouplingError;
use overfly_core::region::RegionError;
use overfly_store::StoreError;
use std::path::PathBuf;

/// Why nothing can be planned.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A file cannot be read.
    #[error("{path}: cannot be read: {cause}; is the name right?")]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// Not an aircraft: what is missing, unknown or of the wrong kind.
    #[error("{path} does not describe an aircraft: {reason}")]
    NotAnAircraft {
        /// Which file.
        path: PathBuf,
        /// Which field, and what is wrong.
        reason: String,
    },
    /// Not a calibration.
    #[error("{path} is no calibration: {reason}")]
    NotACalibration {
        /// Which file.
        path: PathBuf,
        /// Which field, and what is wrong.
        reason: String,
    },
    /// Not a route.
    #[error("{path} is no route: {reason}; it needs GeoJSON lines, GPX or KML, in WGS84 degrees")]
    NotARoute {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Numbers that together lead where the models do not speak.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
    /// An image that no region can be made of.
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
}
