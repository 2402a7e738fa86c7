//! `BuildError`: why a build cannot go on; `Rejected`: one source that was left out.

use crate::raster::RasterError;
use overfly_core::tile::MAX_ZOOM;
use overfly_store::StoreError;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A source that was left out of a build, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejected {
    /// The file or folder.
    pub path: PathBuf,
    /// A stable code word.
    pub code: &'static str,
    /// What is wrong with it, and the remedy.
    pub message: String,
}

impl Rejected {
    /// From what reading it said.
    pub fn raster(path: &Path, error: &RasterError) -> Self {
        Self { path: path.into(), code: error.code(), message: error.to_string() }
    }
}

/// Why a build cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Nothing was given and nothing is under way.
    #[error("no source given and no unfinished build to go on with; name files or folders of orthophotos")]
    NoSources,
    /// Every source was left out.
    #[error("no usable source:{}", list(rejected))]
    NothingUsable {
        /// Each with its reason.
        rejected: Vec<Rejected>,
    },
    /// The sources hold no valid pixel.
    #[error(
        "no source gives a valid pixel at zoom {zoom}: all is masked, transparent or nodata, or so small that it fills no pixel there (then give a finer --zoom): {paths}"
    )]
    NothingValid {
        /// Their paths.
        paths: String,
        /// The base zoom.
        zoom: u8,
    },
    /// A source that is needed again is not there as it was.
    #[error(
        "{path}: a source of layer {layer} that overlaps what changes {how}; put it back, or take it out with --remove-source {path}, or build the layer from other sources with --replace-layer",
        path = path.display()
    )]
    SourceGone {
        /// Where it was.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// What became of it.
        how: String,
    },
    /// A source to remove that the layer does not have.
    #[error("layer {layer} has no source {name:?}; `overfly info --json` lists its sources")]
    NoSuchSource {
        /// The layer.
        layer: String,
        /// Path or hash as given.
        name: String,
    },
    /// Removing it would leave a layer of nothing.
    #[error("that would leave layer {layer} without a source; take it out whole with --remove-layer")]
    LastSource {
        /// The layer.
        layer: String,
    },
    /// Not a date.
    #[error("{date:?} is not a date: use YYYY-MM-DD or YYYY-MM-DDTHH:MM:SSZ")]
    Date {
        /// As given.
        date: String,
    },
    /// Not a number that makes sense there.
    #[error("{name} = {value}: {expected}")]
    Parameter {
        /// As the command line spells it.
        name: &'static str,
        /// As given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
    /// A source that would need an absurd number of tiles.
    #[error(
        "{path}: it spans {tiles:.0} tiles at zoom {zoom}, more than {MAX_TILES}; check its georeference (finest zoom is {MAX_ZOOM}), give --zoom, or build it into a layer of its own",
        path = path.display()
    )]
    TooManyTiles {
        /// The source.
        path: PathBuf,
        /// How many.
        tiles: f64,
        /// At which zoom.
        zoom: u8,
    },
    /// The caller asked to stop.
    #[error("stopped; run the same build again, it goes on where it stopped")]
    Cancelled,
}

/// The most tiles of a base level in one source's extent: a million million pixels, and some 250 bytes of plan each.
pub const MAX_TILES: u32 = 4_000_000;

impl BuildError {
    /// A stable code word.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(error) => error.code(),
            Self::NoSources => "no_sources",
            Self::NothingUsable { .. } => "nothing_usable",
            Self::NothingValid { .. } => "nothing_valid",
            Self::SourceGone { .. } => "source_gone",
            Self::NoSuchSource { .. } => "no_such_source",
            Self::LastSource { .. } => "last_source",
            Self::Date { .. } => "date",
            Self::Parameter { .. } => "parameter",
            Self::TooManyTiles { .. } => "too_many_tiles",
            Self::Cancelled => "cancelled",
        }
    }

    /// Whether the input is at fault, and not the work: exit code 2.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(error) => error.is_unusable_input(),
            Self::SourceGone { .. } | Self::Cancelled => false,
            _ => true,
        }
    }
}

fn list(rejected: &[Rejected]) -> String {
    let mut text = String::new();
    for one in rejected.iter().take(20) {
        text.push_str("\n  ");
        text.push_str(&one.message);
    }
    if rejected.len() > 20 {
        text.push_str(&format!("\n  and {} more", rejected.len() - 20));
    }
    text
}
