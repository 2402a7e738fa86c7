//! Why a trial cannot be run.

use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_flight::navigate::NavigateError;
use overfly_ingest::raster::ImageryError;
use overfly_store::StoreError;
use std::path::PathBuf;

/// Why a trial cannot be run. Lines are counted from 1, the header being line 1.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file cannot be read.
    #[error("{path}: {cause}")]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {cause}")]
    Unwritable {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// Not a table at all.
    #[error("{path} line {line}: {reason}")]
    NotATable {
        /// Which file.
        path: PathBuf,
        /// Where.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// The header lacks a column.
    #[error("{path}: the header has no column {column}; it needs {needed}")]
    MissingColumn {
        /// Which file.
        path: PathBuf,
        /// Which column.
        column: &'static str,
        /// All that are needed, separated by commas.
        needed: String,
    },
    /// A cell does not hold what it must.
    #[error("{path} line {line}: {column} = {found:?}: {expected}")]
    BadCell {
        /// Which file.
        path: PathBuf,
        /// Where.
        line: u64,
        /// Which column.
        column: &'static str,
        /// What it holds.
        found: String,
        /// What it must hold.
        expected: &'static str,
    },
    /// A table without rows.
    #[error("{path} has a header but no rows")]
    NoRows {
        /// Which file.
        path: PathBuf,
    },
    /// A row names an image that is not there.
    #[error("{path} line {line}: there is no image {image}")]
    MissingImage {
        /// Which table.
        path: PathBuf,
        /// Where.
        line: u64,
        /// The image's path.
        image: PathBuf,
    },
    /// A row without truth, where truth is needed.
    #[error(
        "{path} line {line}: true_latitude_deg or true_longitude_deg is empty; scoring needs the truth of every frame"
    )]
    NoTruth {
        /// Which table.
        path: PathBuf,
        /// Where.
        line: u64,
    },
    /// A camera file that is none.
    #[error("{path} does not describe a camera: {reason}")]
    NotACamera {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A simulation that says too little, too much, or what cannot be.
    #[error("{path} does not describe a simulation: {reason}")]
    NotASimulation {
        /// Which file.
        path: PathBuf,
        /// Which variation and field, and what is wrong.
        reason: String,
    },
    /// The store to simulate over cannot be read.
    #[error(transparent)]
    Store(Box<StoreError>),
    /// Or has no layer by itself.
    #[error(transparent)]
    Candidates(Box<CandidatesError>),
    /// A frame cannot be decoded.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A photo or orthophoto cannot be read.
    #[error(transparent)]
    Imagery(Box<ImageryError>),
    /// An image without room for the views that are to be cut from it.
    #[error(
        "{path}: its {width_px} x {height_px} px have no place for two views of {edge_px} px that share a tenth; take larger \
         images without missing pixels, or a smaller --edge-px"
    )]
    NoPlace {
        /// Which image.
        path: PathBuf,
        /// Its columns.
        width_px: usize,
        /// Its rows.
        height_px: usize,
        /// Edge of a view.
        edge_px: usize,
    },
    /// A frame cannot be asked about.
    #[error("{image}: {cause}")]
    Locate {
        /// Which frame.
        image: String,
        /// Why.
        cause: LocateError,
    },
    /// An image gives no position.
    #[error("{image}: {cause}")]
    Navigate {
        /// Which image.
        image: String,
        /// Why.
        cause: NavigateError,
    },
    /// An option out of range.
    #[error("{name} = {value}: {expected}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
}

impl From<ImageryError> for TrialError {
    fn from(error: ImageryError) -> Self {
        Self::Imagery(Box::new(error))
    }
}

impl TrialError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "unreadable",
            Self::Unwritable { .. } => "unwritable",
            Self::NotATable { .. } => "not_a_table",
            Self::MissingColumn { .. } => "missing_column",
            Self::BadCell { .. } => "bad_cell",
            Self::NoRows { .. } => "no_rows",
            Self::MissingImage { .. } => "missing_image",
            Self::NoTruth { .. } => "no_truth",
            Self::NotACamera { .. } => "not_a_camera",
            Self::NotASimulation { .. } => "not_a_simulation",
            Self::Store(e) => e.code(),
            Self::Candidates(e) => e.code(),
            Self::Frame(e) => e.code(),
            Self::Imagery(e) => e.code(),
            Self::NoPlace { .. } => "no_place_for_views",
            Self::Locate { cause, .. } => cause.code(),
            Self::Navigate { cause, .. } => cause.code(),
            Self::Option { .. } => "bad_option",
        }
    }

    /// Whether the input is at fault (and not the work).
    pub fn is_input(&self) -> bool {
        if let Self::Store(error) = self {
            return error.is_unusable_input();
        }
        !matches!(self, Self::Unwritable { .. } | Self::Locate { .. } | Self::Navigate { .. })
    }
}

impl From<StoreError> for TrialError {
    fn from(error: StoreError) -> Self {
        Self::Store(Box::new(error))
    }
}

impl From<CandidatesError> for TrialError {
    fn from(error: CandidatesError) -> Self {
        Self::Candidates(Box::new(error))
    }
}
