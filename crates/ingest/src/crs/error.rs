//! `CrsError`: why a coordinate reference system cannot be used.

/// Why a coordinate reference system, or a point in it, cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CrsError {
    /// The code names nothing that is known here.
    #[error("EPSG:{code} is not a horizontal coordinate reference system that overfly knows{hint}")]
    UnknownCode {
        /// The code.
        code: u32,
        /// What it is instead, where that is known; starts with a separator.
        hint: &'static str,
    },
    /// It is known, and would come out wrong.
    #[error("{name} is refused: {reason}")]
    Refused {
        /// Its code and name.
        name: String,
        /// Why.
        reason: String,
    },
    /// A parameter makes no projection.
    #[error("{name} cannot be projected: {reason}")]
    Parameter {
        /// What was being defined.
        name: String,
        /// Which parameter, and why.
        reason: String,
    },
    /// A point that the projection does not have.
    #[error("the point ({x}, {y}) lies outside what {name} can project")]
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
}
