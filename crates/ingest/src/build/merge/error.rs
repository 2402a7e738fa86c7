//! `MergeError`: why stores cannot be merged.

use super::super::BuildError;
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
    /// One store or none.
    #[error("merging takes two stores or more")]
    TooFew,
    /// An exported store lacks what a layer is made of.
    #[error("{path}: is an exported store, cut to one flight: merge the stores that were built, and export from the result", path = path.display())]
    Exported {
        /// The store.
        path: PathBuf,
    },
    /// Layers of one name and different zooms.
    #[error("layer {layer}: {first} has zoom {first_zoom} and {other} has zoom {other_zoom}: build one of them anew with `--zoom {first_zoom} --layer {layer}`, or under another name", first = first.display(), other = other.display())]
    Zooms {
        /// The layer.
        layer: String,
        /// A store.
        first: PathBuf,
        /// Its base zoom.
        first_zoom: u8,
        /// Another.
        other: PathBuf,
        /// Its base zoom.
        other_zoom: u8,
    },
    /// One orthophoto that is said to be two.
    #[error("layer {layer}: {source_path} has another date, CRS, stretch or error in {other} than in the stores before: build it anew there as it is in the others", source_path = source_path.display(), other = other.display())]
    Declared {
        /// The layer.
        layer: String,
        /// The orthophoto.
        source_path: PathBuf,
        /// The store that declares it otherwise.
        other: PathBuf,
    },
    /// Tiles that differ, where that is to be refused.
    #[error(
        "layer {layer}: {tiles} tiles are not the same in all stores, the first of them {first}: let the newest cover (--on-conflict newest) or the store that is named first (first)"
    )]
    Conflict {
        /// The layer.
        layer: String,
        /// How many.
        tiles: usize,
        /// The first.
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
            Self::Declared { .. } => "other_declaration",
            Self::Conflict { .. } => "tile_conflict",
        }
    }

    /// Whether what was given is at fault, and not the work on it: exit code 2.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(error) => error.is_unusable_input(),
            _ => true,
        }
    }
}
