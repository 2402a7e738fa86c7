//! Why a question for candidates cannot be answered.

use overfly_core::region::{MAX_REACH_M, RegionError};
use overfly_store::StoreError;

/// Why there is no list of candidates. Parameters are named as callers spell them.
#[derive(Debug, thiserror::Error)]
pub enum CandidatesError {
    /// A parameter that must be given was not.
    #[error("{name} is missing: {expected}")]
    Missing {
        /// Its name.
        name: &'static str,
        /// What is expected.
        expected: &'static str,
    },
    /// A parameter is NaN, infinite or out of range.
    #[error("{name} = {value}: expected {expected}")]
    OutOfRange {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
    /// A parameter that means nothing beside the others.
    #[error("{name} does not go with {with}")]
    Conflict {
        /// Its name.
        name: &'static str,
        /// What it contradicts.
        with: &'static str,
    },
    /// `mode` is none of the three.
    #[error("mode = {mode}: expected sequential, parallel or combined")]
    UnknownMode {
        /// What was given.
        mode: String,
    },
    /// No layer was named and none stands out.
    #[error("name a layer: the store has {}", listed(layers))]
    LayerNotStated {
        /// What there is.
        layers: Vec<String>,
    },
    /// All layers were asked for.
    #[error("layer any stands for all layers, and only a fix searches them all: the store has {}", listed(layers))]
    AnyLayer {
        /// What there is.
        layers: Vec<String>,
    },
    /// The region reaches too far.
    #[error(
        "the region reaches {reach_m:.0} m from its centre, the limit is {MAX_REACH_M} m: state less drift, uncertainty, speed or time"
    )]
    RegionTooLarge {
        /// From the centre, metres.
        reach_m: f64,
    },
    /// The region may meet too many tiles.
    #[error(
        "the region may meet {tiles} tiles of zoom {zoom}, the limit is {most}: state less drift, or a coarser gsd_m_per_px"
    )]
    TooManyTiles {
        /// How many.
        tiles: u64,
        /// Of which zoom.
        zoom: u8,
        /// How many may be considered.
        most: u64,
    },
    /// The store failed, or has no such layer.
    #[error(transparent)]
    Store(#[from] StoreError),
}

fn listed(layers: &[String]) -> String {
    if layers.is_empty() { "none".to_owned() } else { layers.join(", ") }
}

impl CandidatesError {
    pub(super) fn out_of_range(name: &'static str, value: f64, expected: &'static str) -> Self {
        Self::OutOfRange { name, value, expected }
    }

    /// A stable word for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "parameter_missing",
            Self::OutOfRange { .. } => "parameter_out_of_range",
            Self::Conflict { .. } => "parameter_conflict",
            Self::UnknownMode { .. } => "mode_unknown",
            Self::LayerNotStated { .. } | Self::AnyLayer { .. } => "layer_not_stated",
            Self::RegionTooLarge { .. } => "region_too_large",
            Self::TooManyTiles { .. } => "too_many_tiles",
            Self::Store(error) => error.code(),
        }
    }

    /// The parameter at fault, where it is one.
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Missing { name, .. } | Self::OutOfRange { name, .. } | Self::Conflict { name, .. } => Some(name),
            Self::UnknownMode { .. } => Some("mode"),
            Self::LayerNotStated { .. } | Self::AnyLayer { .. } => Some("layer"),
            Self::RegionTooLarge { .. } | Self::TooManyTiles { .. } | Self::Store(_) => None,
        }
    }
}

impl From<RegionError> for CandidatesError {
    fn from(error: RegionError) -> Self {
        match error {
            RegionError::Parameter { name: "heading_rad", value, expected } => {
                Self::OutOfRange { name: "heading_deg", value: value.to_degrees(), expected }
            }
            RegionError::Parameter { name, value, expected } => Self::OutOfRange { name, value, expected },
            RegionError::Reach { reach_m } => Self::RegionTooLarge { reach_m },
            RegionError::Position(error) => error.into(),
        }
    }
}

impl From<overfly_core::geodesy::GeodesyError> for CandidatesError {
    fn from(error: overfly_core::geodesy::GeodesyError) -> Self {
        use overfly_core::geodesy::GeodesyError;
        match error {
            GeodesyError::Latitude { latitude_deg } => {
                Self::out_of_range("latitude_deg", latitude_deg, "degrees in [-85.051128, 85.051128]")
            }
            GeodesyError::BeyondMercator { latitude_deg } => Self::out_of_range(
                "latitude_deg",
                latitude_deg,
                "degrees in [-85.051128, 85.051128], where the tile matrix ends; overfly does not serve the poles",
            ),
            GeodesyError::Longitude { longitude_deg } => {
                Self::out_of_range("longitude_deg", longitude_deg, "degrees in [-180, 180]")
            }
            GeodesyError::OffLocalFrame { east_m, north_m } => Self::RegionTooLarge { reach_m: east_m.hypot(north_m) },
        }
    }
}
