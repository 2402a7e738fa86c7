//! `ServerError`: every way in which a request can fail, and the only place where failures become status codes.

use super::export_failure::ExportFailure;
use super::form_error::FormError;
use super::query::QueryError;
use super::refusal::Refusal;
use super::store_refusal::StoreRefusal;
use axum::http::StatusCode;
use overfly_core::tile::TileError;
use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_store::StoreError;

/// Why a request fails.
#[derive(Debug, thiserror::Error)]
pub(super) enum ServerError {
    #[error(transparent)]
    Query(#[from] QueryError),
    #[error(transparent)]
    Candidates(#[from] CandidatesError),
    #[error(transparent)]
    Locate(#[from] LocateError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Form(#[from] FormError),
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error("{error}")]
    Frame { part: &'static str, error: FrameError },
    #[error("{name}: {reason}")]
    Parameter { name: &'static str, reason: String },
    #[error("the path does not name a tile: {0}")]
    TileName(TileError),
    #[error("the path does not name a tile: {what} = {found:?} is not a whole number")]
    TileIndex { what: &'static str, found: String },
    #[error("layer {layer} has no tile {z}/{x}/{y}")]
    NoTile { layer: String, z: u8, x: u32, y: u32 },
    #[error("tile {z}/{x}/{y} of layer {layer} has no descriptors: only tiles of the base level have descriptors")]
    NoDescriptors { layer: String, z: u8, x: u32, y: u32 },
    #[error("{0}")]
    Path(String),
    #[error("no such path; /openapi.json lists all paths")]
    NoRoute,
    #[error("exports are made on the ground only: this is the service of an aircraft, and it writes nothing")]
    OnGroundOnly,
    #[error("this path does not take this method; /openapi.json lists its methods")]
    Method,
    #[error("the file of the store was replaced or removed, and what is there now is refused ({code}): {reason}; it is tried again soon", code = .0.code, reason = .0.reason)]
    Replaced(StoreRefusal),
    #[error("not ready: {reason}")]
    NotReady { code: &'static str, reason: String },
    #[error("too many uploads are in progress: try again")]
    Busy,
    #[error("all connections are taken: only /healthz, /readyz and /v1/candidates are answered; try again")]
    Crowded,
    #[error("another export is being written: try again when it is finished")]
    Exporting,
    #[error("the export is being written: delete it when it has ended")]
    ExportUnderWay,
    #[error("no such export; POST /v1/exports begins one")]
    NoExport,
    #[error("{}", .0.detail)]
    Export(ExportFailure),
    #[error("no answer within {limit_s} s: ask for less, or try again when the service is less busy")]
    TimeLimit { limit_s: f64 },
    #[error("the service failed unexpectedly; its log has the details")]
    Panicked,
}

impl ServerError {
    /// The HTTP status. The match is exhaustive, so that every new failure chooses one.
    pub(super) fn status(&self) -> StatusCode {
        match self {
            Self::Query(error) => match error {
                QueryError::Unknown { .. }
                | QueryError::Repeated { .. }
                | QueryError::NotANumber { .. }
                | QueryError::NotFinite { .. }
                | QueryError::NotWhole { .. }
                | QueryError::Empty { .. } => StatusCode::BAD_REQUEST,
            },
            Self::Candidates(error) => candidates_status(error),
            Self::Locate(error) => locate_status(error),
            Self::Store(error) => store_status(error),
            Self::Form(error) => match error {
                FormError::NotMultipart { .. } => StatusCode::UNSUPPORTED_MEDIA_TYPE,
                FormError::TooLarge { .. } => StatusCode::PAYLOAD_TOO_LARGE,
                FormError::TooSlow { .. } | FormError::Stalled { .. } => StatusCode::REQUEST_TIMEOUT,
                FormError::Broken { .. }
                | FormError::Missing { .. }
                | FormError::Repeated { .. }
                | FormError::Unknown { .. }
                | FormError::NotJson { .. } => StatusCode::BAD_REQUEST,
            },
            Self::Refused(refusal) => match refusal {
                Refusal::Host { .. } | Refusal::Origin { .. } => StatusCode::FORBIDDEN,
                Refusal::NoToken | Refusal::NotBearer | Refusal::WrongToken => StatusCode::UNAUTHORIZED,
            },
            Self::Frame { error, .. } => match error {
                FrameError::NotAnImage { .. } => StatusCode::UNSUPPORTED_MEDIA_TYPE,
                FrameError::Damaged { .. } => StatusCode::UNPROCESSABLE_ENTITY,
                FrameError::TooLarge { .. } => StatusCode::PAYLOAD_TOO_LARGE,
                FrameError::Unreadable { .. } => StatusCode::INTERNAL_SERVER_ERROR,
            },
            Self::Parameter { .. } | Self::TileName(_) | Self::TileIndex { .. } | Self::Path(_) => {
                StatusCode::BAD_REQUEST
            }
            Self::NoTile { .. } | Self::NoDescriptors { .. } | Self::NoRoute | Self::OnGroundOnly | Self::NoExport => {
                StatusCode::NOT_FOUND
            }
            Self::Export(failure) => failure.status,
            Self::ExportUnderWay => StatusCode::CONFLICT,
            Self::Method => StatusCode::METHOD_NOT_ALLOWED,
            Self::Busy
            | Self::Crowded
            | Self::Exporting
            | Self::TimeLimit { .. }
            | Self::NotReady { .. }
            | Self::Replaced(_) => StatusCode::SERVICE_UNAVAILABLE,
            Self::Panicked => StatusCode::INTERNAL_SERVER_ERROR,
        }
    }

    /// A stable code word.
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::Query(error) => error.code(),
            Self::Candidates(error) => error.code(),
            // As in the query of a GET.
            Self::Locate(LocateError::Parameter { .. }) => "parameter_out_of_range",
            Self::Locate(LocateError::Missing { .. }) => "parameter_missing",
            Self::Locate(LocateError::Conflict { .. }) => "parameter_conflict",
            Self::Locate(error) => error.code(),
            Self::Store(error) => error.code(),
            Self::Form(error) => error.code(),
            Self::Refused(refusal) => refusal.code(),
            Self::Frame { error, .. } => error.code(),
            Self::Parameter { .. } => "parameter_out_of_range",
            Self::TileName(_) | Self::TileIndex { .. } => "tile_name",
            Self::NoTile { .. } => "no_such_tile",
            Self::NoDescriptors { .. } => "no_descriptors",
            Self::Path(_) => "path",
            Self::NoRoute | Self::OnGroundOnly => "no_such_route",
            Self::Method => "method_not_allowed",
            Self::Busy | Self::Crowded | Self::Exporting => "busy",
            Self::NoExport => "no_such_export",
            Self::Export(failure) => failure.code,
            Self::ExportUnderWay => "export_under_way",
            Self::NotReady { code, .. } => code,
            Self::Replaced(_) => "store_changed",
            Self::TimeLimit { .. } => "time_limit",
            Self::Panicked => "internal",
        }
    }

    /// The parameter or form part that is not valid, if there is one.
    pub(super) fn parameter(&self) -> Option<String> {
        match self {
            Self::Query(error) => Some(error.parameter().to_owned()),
            Self::Candidates(error) => error.parameter().map(str::to_owned),
            Self::Locate(error) => error.parameter().map(str::to_owned),
            Self::Form(error) => error.part().map(str::to_owned),
            Self::Frame { part, .. } => Some((*part).to_owned()),
            Self::Parameter { name, .. } => Some((*name).to_owned()),
            Self::TileIndex { what, .. } => Some((*what).to_owned()),
            _ => None,
        }
    }
}

fn candidates_status(error: &CandidatesError) -> StatusCode {
    match error {
        CandidatesError::Missing { .. }
        | CandidatesError::OutOfRange { .. }
        | CandidatesError::Conflict { .. }
        | CandidatesError::UnknownMode { .. }
        | CandidatesError::LayerNotStated { .. }
        | CandidatesError::AnyLayer { .. }
        | CandidatesError::RegionTooLarge { .. }
        | CandidatesError::TooManyTiles { .. } => StatusCode::BAD_REQUEST,
        CandidatesError::Store(error) => store_status(error),
    }
}

fn locate_status(error: &LocateError) -> StatusCode {
    match error {
        LocateError::Store(error) => store_status(error),
        LocateError::Cancelled => StatusCode::SERVICE_UNAVAILABLE,
        LocateError::Camera(_)
        | LocateError::Parameter { .. }
        | LocateError::Missing { .. }
        | LocateError::Conflict { .. }
        | LocateError::TooWide { .. }
        | LocateError::TooManyTiles { .. }
        | LocateError::MemoryLimit { .. } => StatusCode::BAD_REQUEST,
    }
}

fn store_status(error: &StoreError) -> StatusCode {
    match error {
        StoreError::NoLayer { .. } | StoreError::Heights { .. } => StatusCode::NOT_FOUND,
        StoreError::LayerName { .. } | StoreError::LayerExists { .. } => StatusCode::BAD_REQUEST,
        StoreError::Unfinished { .. } => StatusCode::CONFLICT,
        StoreError::Busy { .. }
        | StoreError::Occupied { .. }
        | StoreError::HotJournal { .. }
        | StoreError::SideFile { .. }
        | StoreError::LeftInWal { .. }
        | StoreError::Changed { .. } => StatusCode::SERVICE_UNAVAILABLE,
        StoreError::Missing { .. }
        | StoreError::NotAStore { .. }
        | StoreError::NoLayers { .. }
        | StoreError::NewerFormat { .. }
        | StoreError::OlderFormat { .. }
        | StoreError::OtherContract { .. }
        | StoreError::Denied { .. }
        | StoreError::DiskFull { .. }
        | StoreError::DiskError { .. }
        | StoreError::NoJournal { .. }
        | StoreError::Superseded { .. }
        | StoreError::CutOff { .. }
        | StoreError::Damaged { .. }
        | StoreError::ForeignSchema { .. }
        | StoreError::DamagedTile { .. }
        | StoreError::Encode { .. }
        | StoreError::Io { .. }
        | StoreError::NoFolder { .. }
        | StoreError::InTheWay { .. }
        | StoreError::SameFile { .. }
        | StoreError::Sealed { .. }
        | StoreError::Sqlite { .. } => StatusCode::INTERNAL_SERVER_ERROR,
    }
}
