//! `MergeError`: why stores cannot be merged.

use crate::build::error::BuildError;
use crate::remedy::Remedy;
use overfly_core::tile::TileId;
use overfly_store::StoreError;
use std::path::PathBuf;

/// Why stores cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The sources together make no layer.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Fewer than two stores were given.
    #[error("merging takes two stores or more")]
    TooFew,
    /// An exported store, which does not hold the sources of its layers.
    #[error("{path}: is an exported store, cut to one flight", path = path.display())]
    Exported {
        /// The store.
        path: PathBuf,
    },
    /// Layers of one name and different base zooms.
    #[error("layer {layer}: {first} has zoom {first_zoom} and {other} has zoom {other_zoom}", first = first.display(), other = other.display())]
    Zooms {
        /// The layer.
        layer: String,
        /// One store.
        first: PathBuf,
        /// Its base zoom.
        first_zoom: u8,
        /// The other store.
        other: PathBuf,
        /// Its base zoom.
        other_zoom: u8,
    },
    /// One orthophoto, declared differently in two stores.
    #[error("layer {layer}: {source_path} has another date, CRS, stretch or error in {other} than in the stores named before it", source_path = source_path.display(), other = other.display())]
    Declared {
        /// The layer.
        layer: String,
        /// The orthophoto.
        source_path: PathBuf,
        /// The store that declares it differently.
        other: PathBuf,
    },
    /// Heights above different surfaces, or heights and imagery.
    #[error("layer {layer}: {} and {} state different things of its heights", first.display(), other.display())]
    Terrain {
        /// The layer.
        layer: String,
        /// One store.
        first: PathBuf,
        /// The other store.
        other: PathBuf,
    },
    /// Tiles differ, and the request refuses that.
    #[error("layer {layer}: {tiles} tiles are not the same in all stores, the first of them {first}")]
    Conflict {
        /// The layer.
        layer: String,
        /// How many tiles.
        tiles: usize,
        /// The first one.
        first: TileId,
    },
}

impl MergeError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(error) => error.code(),
            Self::Build(error) => error.code(),
            Self::TooFew => "usage",
            Self::Exported { .. } => "sealed_store",
            Self::Zooms { .. } => "other_zoom",
            Self::Declared { .. } | Self::Terrain { .. } => "other_declaration",
            Self::Conflict { .. } => "tile_conflict",
        }
    }

    /// What the user can do, where that is known. Errors of the store have remedies of their own.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Store(_) | Self::TooFew => None,
            Self::Build(error) => error.remedy(),
            Self::Exported { .. } => Some(Remedy::MergeBuiltStores),
            Self::Zooms { layer, first_zoom, .. } => {
                Some(Remedy::RebuildAtZoom { layer: layer.clone(), zoom: *first_zoom })
            }
            Self::Declared { .. } | Self::Terrain { .. } => Some(Remedy::RebuildAsDeclared),
            Self::Conflict { .. } => Some(Remedy::ChooseCovering),
        }
    }

    /// Whether the input is at fault rather than the work on it.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(error) => error.is_unusable_input(),
            _ => true,
        }
    }
}
