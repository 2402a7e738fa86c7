//! `ExportError`: why nothing can be exported.

use crate::plan::PlanError;
use crate::remedy::Remedy;
use overfly_core::coupling::CouplingError;
use overfly_core::region::RegionError;
use overfly_store::StoreError;
use overfly_store::package::{Date, PackageError};
use std::path::PathBuf;

/// Why nothing can be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The route, the aircraft or the calibration cannot be used.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Parameters outside the domain of the coupling models.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
    /// A corridor that makes no region.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// A store cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The export cannot be sealed or signed.
    #[error(transparent)]
    Package(#[from] PackageError),
    /// A corridor whose width is not positive, or larger than the limit.
    #[error("a corridor of {half_width_m} m on each side: expected metres, more than 0 and at most {most_m}")]
    CorridorWidth {
        /// The half width given, or the one to which the corridor grew, metres.
        half_width_m: f64,
        /// The limit, metres.
        most_m: f64,
    },
    /// A route of too many or too long legs.
    #[error(
        "a route of {:.0} km in {pieces} pieces: at most {most} pieces of 2 km, or legs, are compared with the map",
        length_m / 1e3
    )]
    RouteTooLong {
        /// Length of all routes, metres.
        length_m: f64,
        /// Rectangles of their corridor.
        pieces: u64,
        /// The limit.
        most: u64,
    },
    /// A corridor that meets the same tiles over and over.
    #[error("{path}: the corridor was compared with {most} tiles, one by one, and is not done", path = path.display())]
    TooManyComparisons {
        /// The store.
        path: PathBuf,
        /// The limit.
        most: u64,
    },
    /// The last day of the export has passed.
    #[error("the last day {last_day} has passed, and today is {today} (UTC)")]
    LastDayPassed {
        /// The last day asked for.
        last_day: Date,
        /// The day of the clock.
        today: Date,
    },
    /// The map does not reach the route.
    #[error("{path}: no tile meets the corridor", path = path.display())]
    NothingInCorridor {
        /// The store.
        path: PathBuf,
    },
    /// The export cannot be made as small as asked.
    #[error("the export takes at least {least} bytes whatever is dropped, and {most} are allowed")]
    TooLarge {
        /// Bytes after everything has been dropped that may be.
        least: u64,
        /// Bytes that are allowed.
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
            Self::RouteTooLong { .. } => "route_too_long",
            Self::TooManyComparisons { .. } => "too_many_comparisons",
            Self::LastDayPassed { .. } => "expired_store",
            Self::NothingInCorridor { .. } => "no_tile_in_corridor",
            Self::TooLarge { .. } => "too_large",
        }
    }

    /// What the user can do, where that is known. Errors of the store and the package have remedies of their own.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Plan(e) => e.remedy(),
            Self::NothingInCorridor { .. } | Self::RouteTooLong { .. } => Some(Remedy::CheckRoute),
            Self::TooLarge { .. } | Self::TooManyComparisons { .. } => Some(Remedy::ReduceExport),
            Self::LastDayPassed { .. } => Some(Remedy::StateLastDay),
            Self::Coupling(_) | Self::Region(_) | Self::CorridorWidth { .. } => None,
            Self::Store(_) | Self::Package(_) => None,
        }
    }

    /// The error with the bytes that the work needed, if the disk was full.
    pub(super) fn needing(self, bytes: u64) -> Self {
        match self {
            Self::Store(error) => Self::Store(error.needing(bytes)),
            Self::Package(PackageError::Store(error)) => Self::Store(error.needing(bytes)),
            other => other,
        }
    }

    /// Whether the input is at fault rather than the work on it.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(e) => e.is_unusable_input(),
            Self::Package(e) => e.is_unusable_input(),
            _ => true,
        }
    }
}
