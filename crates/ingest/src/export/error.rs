//! Why nothing can be exported.

use crate::plan::PlanError;
use overfly_core::coupling::CouplingError;
use overfly_core::region::RegionError;
use overfly_store::StoreError;
use overfly_store::package::PackageError;
use std::path::PathBuf;

/// Why nothing can be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Route, aircraft or calibration.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Numbers that together lead where the models do not speak.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
    /// A corridor that no region can be made of.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// A store cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The export cannot be sealed or signed.
    #[error(transparent)]
    Package(#[from] PackageError),
    /// A corridor of no width, or wider than any search.
    #[error("a corridor of {half_width_m} m on each side: expected metres, more than 0 and at most {most_m}")]
    CorridorWidth {
        /// What was given, or what it grew to.
        half_width_m: f64,
        /// The bound.
        most_m: f64,
    },
    /// The map does not reach the route.
    #[error("{path}: no tile meets the corridor; is it the right route, and are its positions longitude first?", path = path.display())]
    NothingInCorridor {
        /// The store.
        path: PathBuf,
    },
    /// It cannot be made small enough.
    #[error(
        "the export takes at least {least} bytes whatever is dropped, and {most} are allowed: narrow the corridor, shorten the route, or name fewer layers"
    )]
    TooLarge {
        /// With all dropped that may be.
        least: u64,
        /// What was asked.
        most: u64,
    },
}

impl ExportError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Plan(e) => e.code(),
            Self::Coupling(e) => e.code(),
            Self::Region(e) => e.code(),
            Self::Store(e) => e.code(),
            Self::Package(e) => e.code(),
            Self::CorridorWidth { .. } => "corridor_width",
            Self::NothingInCorridor { .. } => "no_tile_in_corridor",
            Self::TooLarge { .. } => "too_large",
        }
    }

    /// Whether what was given is at fault, and not the work on it: exit code 2.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(e) => e.is_unusable_input(),
            Self::Package(e) => e.is_unusable_input(),
            _ => true,
        }
    }
}
