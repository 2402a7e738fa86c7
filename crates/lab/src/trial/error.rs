//! Errors of trials.

use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_flight::navigate::NavigateError;
use overfly_ingest::build::BuildError;
use overfly_ingest::raster::ImageryError;
use overfly_store::StoreError;
use std::path::PathBuf;

/// The reason why a trial cannot run. Lines are counted from 1; the header is line 1.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file cannot be read.
    #[error("{path}: {cause}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        cause: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {cause}")]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        cause: std::io::Error,
    },
    /// A file is not a CSV table.
    #[error("{path} line {line}: {reason}")]
    NotATable {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// What is wrong with the file.
        reason: String,
    },
    /// The header lacks a column.
    #[error("{path}: the header has no column {column}; it needs {needed}")]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// All needed columns, separated by commas.
        needed: String,
    },
    /// A cell has an invalid value.
    #[error("{path} line {line}: {column} = {found:?}: {expected}")]
    BadCell {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: &'static str,
        /// The value of the cell.
        found: String,
        /// What the cell must hold.
        expected: &'static str,
    },
    /// A table has no rows.
    #[error("{path} has a header but no rows")]
    NoRows {
        /// The file.
        path: PathBuf,
    },
    /// A row names an image that does not exist.
    #[error("{path} line {line}: there is no image {image}")]
    MissingImage {
        /// The table.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The image's path.
        image: PathBuf,
    },
    /// A row has no truth, but scoring needs it.
    #[error(
        "{path} line {line}: true_latitude_deg or true_longitude_deg is empty; scoring needs the truth of every frame"
    )]
    NoTruth {
        /// The table.
        path: PathBuf,
        /// The line.
        line: u64,
    },
    /// Not a valid camera file.
    #[error("{path} does not describe a camera: {reason}")]
    NotACamera {
        /// The file.
        path: PathBuf,
        /// What is wrong with the file.
        reason: String,
    },
    /// Not a valid simulation file.
    #[error("{path} does not describe a simulation: {reason}")]
    NotASimulation {
        /// The file.
        path: PathBuf,
        /// The variation and the field, and what is wrong with it.
        reason: String,
    },
    /// A scenario flies over a store whose path is not stated.
    #[error("{path} does not describe a simulation: {scenario}: store.path is not stated")]
    NoStorePath {
        /// The file.
        path: PathBuf,
        /// Name of the scenario.
        scenario: String,
    },
    /// The store cannot be read.
    #[error(transparent)]
    Store(Box<StoreError>),
    /// The store of a drawn map cannot be built.
    #[error("the store of a drawn map cannot be built: {0}")]
    World(Box<BuildError>),
    /// A layer has no imagery under any frame of a flight.
    #[error("{path}: no frame was taken over the layer's imagery")]
    OffTheMap {
        /// The flight.
        path: PathBuf,
    },
    /// The store has no default layer.
    #[error(transparent)]
    Candidates(Box<CandidatesError>),
    /// A frame cannot be decoded.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A frame cannot be written in a format.
    #[error("the frame cannot be encoded: {reason}")]
    Encode {
        /// The encoder's message.
        reason: String,
    },
    /// A photo or orthophoto cannot be read.
    #[error(transparent)]
    Imagery(Box<ImageryError>),
    /// An image is too small for the views that are cut from it.
    #[error(
        "{path}: its {width_px} x {height_px} px have no place without missing pixels for two views of {edge_px} px that share a tenth"
    )]
    NoPlace {
        /// The image.
        path: PathBuf,
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
        /// Edge of a view, pixels.
        edge_px: usize,
    },
    /// A frame cannot be located.
    #[error("{image}: {cause}")]
    Locate {
        /// The frame.
        image: String,
        /// The cause.
        cause: LocateError,
    },
    /// Navigation fails at an image.
    #[error("{image}: {cause}")]
    Navigate {
        /// The image.
        image: String,
        /// The cause.
        cause: NavigateError,
    },
    /// An option is out of range.
    #[error("{name} = {value}: {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// The given value.
        value: f64,
        /// The accepted values.
        expected: &'static str,
    },
}

impl From<ImageryError> for TrialError {
    fn from(error: ImageryError) -> Self {
        Self::Imagery(Box::new(error))
    }
}

impl TrialError {
    /// A stable code for scripts.
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
            Self::NotASimulation { .. } | Self::NoStorePath { .. } => "not_a_simulation",
            Self::Store(e) => e.code(),
            Self::World(_) => "not_built",
            Self::OffTheMap { .. } => "off_the_map",
            Self::Candidates(e) => e.code(),
            Self::Frame(e) => e.code(),
            Self::Encode { .. } => "not_encoded",
            Self::Imagery(e) => e.code(),
            Self::NoPlace { .. } => "no_place_for_views",
            Self::Locate { cause, .. } => cause.code(),
            Self::Navigate { cause, .. } => cause.code(),
            Self::Option { .. } => "bad_option",
        }
    }

    /// Whether the input is to blame, and not the processing.
    pub fn is_input(&self) -> bool {
        if let Self::Store(error) = self {
            return error.is_unusable_input();
        }
        !matches!(self, Self::Unwritable { .. } | Self::World(_) | Self::Locate { .. } | Self::Navigate { .. })
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
