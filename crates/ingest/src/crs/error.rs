//! `CrsError`: why a coordinate reference system cannot be used.

use crate::remedy::Remedy;

/// Why a coordinate reference system, or a point in it, cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CrsError {
    /// The code is not in the table of horizontal systems.
    #[error("EPSG:{code} is not a known horizontal coordinate reference system{hint}")]
    UnknownCode {
        /// The code.
        code: u32,
        /// What the code means instead, in parentheses after a space; empty where that is not known.
        hint: &'static str,
        /// What the user can do.
        remedy: Remedy,
    },
    /// The system is known, and its coordinates would come out wrong.
    #[error("{name} is refused: {reason}")]
    Refused {
        /// Its code and name.
        name: String,
        /// Why.
        reason: String,
        /// What the user can do.
        remedy: Remedy,
    },
    /// A parameter makes no projection.
    #[error("{name} cannot be projected: {reason}")]
    Parameter {
        /// The system that was being defined.
        name: String,
        /// Which parameter, and why.
        reason: String,
    },
    /// The projection has no such point.
    #[error("the point ({x}, {y}) lies outside the domain of {name}")]
    Outside {
        /// The CRS.
        name: String,
        /// First coordinate given: easting, or longitude in degrees.
        x: f64,
        /// Second coordinate given: northing, or latitude in degrees.
        y: f64,
    },
}

impl CrsError {
    /// A stable word for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::UnknownCode { .. } => "crs_unknown",
            Self::Refused { .. } => "crs_refused",
            Self::Parameter { .. } => "crs_parameter",
            Self::Outside { .. } => "crs_outside",
        }
    }

    /// What the user can do, where that is known.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::UnknownCode { remedy, .. } | Self::Refused { remedy, .. } => Some(remedy.clone()),
            Self::Parameter { .. } | Self::Outside { .. } => None,
        }
    }
}
