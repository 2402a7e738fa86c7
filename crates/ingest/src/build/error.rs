//! `BuildError`: why a build cannot go on; `Rejected`: one source that was left out.

use crate::raster::RasterError;
use crate::remedy::Remedy;
use overfly_core::tile::MAX_ZOOM;
use overfly_store::StoreError;
use overfly_store::package::Date;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A source that a build left out, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejected {
    /// The file or folder.
    pub path: PathBuf,
    /// A stable code word.
    pub code: &'static str,
    /// What is wrong with it.
    pub message: String,
    /// What the user can do, where that is known.
    #[serde(skip)]
    pub remedy: Option<Remedy>,
}

impl From<(&Path, &RasterError)> for Rejected {
    fn from((path, error): (&Path, &RasterError)) -> Self {
        Self { path: path.into(), code: error.code(), message: error.to_string(), remedy: error.remedy() }
    }
}

/// Why a build cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// No source was given, and no build of the layer is unfinished.
    #[error("no source given, and layer {layer} has no unfinished build to resume{}", elsewhere(unfinished))]
    NoSources {
        /// The layer.
        layer: String,
        /// Other layers of the store that have one.
        unfinished: Vec<String>,
    },
    /// Every source was left out.
    #[error("no usable source:{}", list(rejected))]
    NothingUsable {
        /// Each source with its reason.
        rejected: Vec<Rejected>,
    },
    /// The sources hold no valid pixel.
    #[error(
        "no source gives a valid pixel at zoom {zoom}: all is masked, transparent or nodata, or smaller than one pixel there: {paths}"
    )]
    NothingValid {
        /// Their paths.
        paths: String,
        /// The base zoom.
        zoom: u8,
    },
    /// A source that a changed tile needs again is missing or altered.
    #[error("{path}: a source of layer {layer} that overlaps the changed tiles {how}", path = path.display())]
    SourceGone {
        /// Where the source was.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// What happened to the source.
        how: String,
    },
    /// The layer has no such source to remove.
    #[error("layer {layer} has no source {name:?}")]
    NoSuchSource {
        /// The layer.
        layer: String,
        /// Path or hash as given.
        name: String,
    },
    /// Removing the source would leave the layer without any.
    #[error("that would leave layer {layer} without a source")]
    LastSource {
        /// The layer.
        layer: String,
    },
    /// Not a date.
    #[error("{date:?} is not a date in the form YYYY-MM-DD or YYYY-MM-DDTHH:MM:SSZ")]
    Date {
        /// The text given.
        date: String,
    },
    /// A date of the future.
    #[error("an acquisition date of {day} is in the future: today is {today} (UTC)")]
    FutureDate {
        /// The day given.
        day: Date,
        /// The day of the clock.
        today: Date,
    },
    /// One date for all sources of the layer would change which of them covers which.
    #[error("sources of layer {layer} that overlap have different dates, and with one date others would cover")]
    DateChangesCover {
        /// The layer.
        layer: String,
    },
    /// A parameter out of its range.
    #[error("{name} = {value}: expected {expected}")]
    Parameter {
        /// The parameter's name, as the request's field.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The values that are accepted.
        expected: &'static str,
    },
    /// Heights above a surface that nothing states, or that is not known.
    #[error("{}: {}", path.display(), datum_missing(named.as_deref()))]
    NoDatum {
        /// The file.
        path: PathBuf,
        /// The vertical system that it states, where it states one.
        named: Option<String>,
    },
    /// A source of heights that a killed build left, without the surface that they are above.
    #[error("{}: a build that was cut off left these heights, and not what they are above", path.display())]
    DatumLost {
        /// The file.
        path: PathBuf,
    },
    /// Heights above another surface than the stated one, or than the terrain that the store has.
    #[error("{says}, not above {stated}")]
    OtherDatum {
        /// Who says what.
        says: String,
        /// The surface stated.
        stated: &'static str,
    },
    /// Files whose heights are above different surfaces.
    #[error("{says}, and {} that its are above {stated}", first.display())]
    MixedDatums {
        /// Who says what.
        says: String,
        /// The file that was read first.
        first: PathBuf,
        /// What that states.
        stated: &'static str,
    },
    /// A source that needs more tiles than [`MAX_TILES`].
    #[error(
        "{path}: it spans {tiles:.0} tiles at zoom {zoom}, more than {MAX_TILES} (the finest zoom is {MAX_ZOOM})",
        path = path.display()
    )]
    TooManyTiles {
        /// The source.
        path: PathBuf,
        /// How many tiles.
        tiles: f64,
        /// At which zoom.
        zoom: u8,
    },
    /// The caller stopped the build.
    #[error("stopped before the build was complete")]
    Cancelled,
}

/// The most tiles of a base level in one source's extent: 10^12 pixels, and some 250 bytes of plan for each tile.
pub const MAX_TILES: u32 = 4_000_000;

impl BuildError {
    /// A stable code word.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(error) => error.code(),
            Self::NoSources { .. } => "no_sources",
            Self::NothingUsable { .. } => "nothing_usable",
            Self::NothingValid { .. } => "nothing_valid",
            Self::SourceGone { .. } => "source_gone",
            Self::NoSuchSource { .. } => "no_such_source",
            Self::LastSource { .. } => "last_source",
            Self::Date { .. } => "date",
            Self::FutureDate { .. } => "future_date",
            Self::DateChangesCover { .. } => "date_changes_cover",
            Self::Parameter { .. } => "parameter",
            Self::NoDatum { .. } | Self::DatumLost { .. } => "no_vertical_datum",
            Self::OtherDatum { .. } | Self::MixedDatums { .. } => "other_vertical_datum",
            Self::TooManyTiles { .. } => "too_many_tiles",
            Self::Cancelled => "cancelled",
        }
    }

    /// What the user can do, where that is known. Errors of the store have remedies of their own.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Store(_) | Self::NothingUsable { .. } | Self::Date { .. } | Self::Parameter { .. } => None,
            Self::FutureDate { .. } => Some(Remedy::CheckDate),
            Self::NoSources { .. } => Some(Remedy::NameSources),
            Self::NothingValid { .. } => Some(Remedy::FinerZoom),
            Self::SourceGone { path, .. } => Some(Remedy::RestoreSource { path: path.clone() }),
            Self::NoSuchSource { .. } => Some(Remedy::ListSources),
            Self::LastSource { .. } => Some(Remedy::RemoveLayer),
            Self::DateChangesCover { .. } => Some(Remedy::StateDatesInBuild),
            Self::NoDatum { .. } => Some(Remedy::StateTerrainDatum),
            Self::DatumLost { .. } => Some(Remedy::NameHeightsAgain),
            Self::OtherDatum { .. } | Self::MixedDatums { .. } => Some(Remedy::OneTerrainDatum),
            Self::TooManyTiles { .. } => Some(Remedy::FewerTiles),
            Self::Cancelled => Some(Remedy::ResumeBuild),
        }
    }

    /// Whether the input is at fault rather than the work on it.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(error) => error.is_unusable_input(),
            Self::SourceGone { .. } | Self::Cancelled => false,
            _ => true,
        }
    }
}

fn datum_missing(named: Option<&str>) -> String {
    match named {
        Some(named) => {
            format!("it says that its heights are above {named}, which is none of egm96, egm2008, ellipsoid")
        }
        None => "it does not say what its heights are above".into(),
    }
}

fn elsewhere(unfinished: &[String]) -> String {
    match unfinished {
        [] => String::new(),
        [one] => format!(" (layer {one} has one)"),
        several => format!(" (layers {} have one)", several.join(", ")),
    }
}

/// Rejected sources that a message names one by one.
const NAMED: usize = 20;

fn list(rejected: &[Rejected]) -> String {
    let mut text: String = rejected.iter().take(NAMED).map(|one| format!("\n  {}", one.message)).collect();
    if rejected.len() > NAMED {
        text.push_str(&format!("\n  and {} more", rejected.len() - NAMED));
    }
    text
}
