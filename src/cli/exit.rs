//! Exit codes and failures with their stable code words.

use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_ingest::build::MergeError;
use overfly_ingest::export::ExportError;
use overfly_ingest::plan::PlanError;
use overfly_lab::trial::TrialError;
use overfly_store::StoreError;
use overfly_store::package::PackageError;
use std::process::ExitCode;

/// How a command ended. Exit code 2 is also what clap uses for bad usage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// 0: done.
    Done,
    /// 1: failed, or only partly done.
    Failed,
    /// 2: bad usage, or nothing usable in the input.
    Unusable,
    /// 3: no fix, or verification failed.
    NoFix,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Done => 0,
            Exit::Failed => 1,
            Exit::Unusable => 2,
            Exit::NoFix => 3,
        })
    }
}

/// A command that could not do its work.
#[derive(Debug)]
pub struct Failure {
    /// What the program exits with.
    pub exit: Exit,
    /// A stable word for scripts.
    pub code: &'static str,
    /// What happened, the file, and the remedy.
    pub error: anyhow::Error,
}

impl Failure {
    /// A failure of the input: exit code 2.
    pub fn unusable(code: &'static str, error: impl Into<anyhow::Error>) -> Self {
        Self { exit: Exit::Unusable, code, error: error.into() }
    }

    /// A failure of the work: exit code 1.
    pub fn failed(code: &'static str, error: impl Into<anyhow::Error>) -> Self {
        Self { exit: Exit::Failed, code, error: error.into() }
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let code = error.code();
        if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) }
    }
}

impl From<MergeError> for Failure {
    fn from(error: MergeError) -> Self {
        let code = error.code();
        if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) }
    }
}

impl From<CandidatesError> for Failure {
    fn from(error: CandidatesError) -> Self {
        Self::unusable(error.code(), error)
    }
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        Self::unusable(error.code(), error)
    }
}

impl From<LocateError> for Failure {
    fn from(error: LocateError) -> Self {
        Self::unusable(error.code(), error)
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Store(error) => error.into(),
            error => Self::unusable(error.code(), error),
        }
    }
}

impl From<PackageError> for Failure {
    fn from(error: PackageError) -> Self {
        match error {
            PackageError::Store(error) => error.into(),
            error => {
                let code = error.code();
                if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) }
            }
        }
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Store(error) => error.into(),
            ExportError::Plan(error) => error.into(),
            ExportError::Package(error) => error.into(),
            error => {
                let code = error.code();
                if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) }
            }
        }
    }
}

impl From<TrialError> for Failure {
    fn from(error: TrialError) -> Self {
        let code = error.code();
        if error.is_input() { Self::unusable(code, error) } else { Self::failed(code, error) }
    }
}
