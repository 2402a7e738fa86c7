//! The failures of the commands before the flight.

use crate::cli::failure::Failure;
use crate::cli::preflight::remedy::{explain_rejected, spell};
use overfly_ingest::build::{BuildError, MergeError};
use overfly_ingest::export::ExportError;
use overfly_ingest::plan::PlanError;
use overfly_store::StoreError;

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        let mut error = match error {
            BuildError::Store(error) => return of_store(error),
            error => error,
        };
        if let BuildError::NothingUsable { rejected } = &mut error {
            explain_rejected(rejected);
        }
        let (code, remedy) = (error.code(), error.remedy().as_ref().map(spell));
        let failure = if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) };
        failure.with_remedy(remedy)
    }
}

/// The failure of a build with its store: the store is what the build makes, and another run continues it.
fn of_store(error: StoreError) -> Failure {
    let remedy = match &error {
        StoreError::NotAStore { .. } => Some("--db names the store that is made: give a new name, as in map.gpkg"),
        StoreError::DiskFull { .. } => {
            Some("free space on the disk and run the same command again: the build continues where it stopped")
        }
        StoreError::CutOff { .. } => Some("or build into another file"),
        _ => None,
    };
    let failure = Failure::from(error);
    if remedy.is_some() { failure.with_remedy(remedy) } else { failure }
}

impl From<MergeError> for Failure {
    fn from(error: MergeError) -> Self {
        match error {
            MergeError::Store(error) => error.into(),
            error => {
                let (code, remedy) = (error.code(), error.remedy().as_ref().map(spell));
                Self::unusable(code, error).with_remedy(remedy)
            }
        }
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Store(error) => error.into(),
            error => {
                let (code, remedy) = (error.code(), error.remedy().as_ref().map(spell));
                Self::unusable(code, error).with_remedy(remedy)
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
                let (code, remedy) = (error.code(), error.remedy().as_ref().map(spell));
                Self::unusable(code, error).with_remedy(remedy)
            }
        }
    }
}
