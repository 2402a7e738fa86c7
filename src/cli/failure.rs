//! `Failure`: why a command failed, with its exit code and code word.

use crate::cli::exit::Exit;
use crate::cli::remedy::{locate_remedy, spell, spell_for_crew};
use overfly_flight::frame::FrameError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_store::StoreError;
use overfly_store::package::PackageError;

/// A command that could not do its work.
#[derive(Debug)]
pub struct Failure {
    /// What the program exits with.
    pub exit: Exit,
    /// A stable word for scripts.
    pub code: &'static str,
    /// What happened, and to which file.
    pub error: anyhow::Error,
    /// What the user can do, if that is known.
    pub remedy: Option<String>,
}

impl Failure {
    /// A failure of the input: exit code 2.
    pub fn unusable(code: &'static str, error: impl Into<anyhow::Error>) -> Self {
        Self { exit: Exit::Unusable, code, error: error.into(), remedy: None }
    }

    /// A failure of the work: exit code 1.
    pub fn failed(code: &'static str, error: impl Into<anyhow::Error>) -> Self {
        Self { exit: Exit::Failed, code, error: error.into(), remedy: None }
    }

    /// The failure of a command that a crew runs, with what a crew can do: it has no imagery, secret key or map.
    pub fn of_crew(error: impl Into<PackageError>) -> Self {
        let error = error.into();
        let remedy = error.remedy().map(spell_for_crew);
        Self::from(error).with_remedy(remedy)
    }

    /// The failure with the remedy, if there is one.
    pub fn with_remedy(self, remedy: Option<impl Into<String>>) -> Self {
        Self { remedy: remedy.map(Into::into), ..self }
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let (code, remedy) = (error.code(), error.remedy().map(spell));
        let failure = if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) };
        failure.with_remedy(remedy)
    }
}

impl From<PackageError> for Failure {
    fn from(error: PackageError) -> Self {
        let (code, remedy) = (error.code(), error.remedy().map(spell));
        let failure = if error.is_unusable_input() { Self::unusable(code, error) } else { Self::failed(code, error) };
        failure.with_remedy(remedy)
    }
}

impl From<CandidatesError> for Failure {
    fn from(error: CandidatesError) -> Self {
        let remedy = match &error {
            CandidatesError::Store(error) => error.remedy().map(spell_for_crew),
            CandidatesError::LayerNotStated { .. } => Some("name one with --layer"),
            CandidatesError::AnyLayer { .. } => Some("name one with --layer; `overfly fix` searches any"),
            _ => None,
        };
        Self::unusable(error.code(), error).with_remedy(remedy)
    }
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        let remedy = match &error {
            FrameError::Unreadable { path, .. } if path.is_dir() => Some("name one image, not a folder"),
            FrameError::Unreadable { .. } => Some("check the name"),
            FrameError::NotAnImage { .. } => Some("name a PNG, JPEG or WebP image"),
            FrameError::Damaged { .. } | FrameError::TooLarge { .. } => None,
        };
        Self::unusable(error.code(), error).with_remedy(remedy)
    }
}

impl From<LocateError> for Failure {
    fn from(error: LocateError) -> Self {
        let remedy = locate_remedy(&error);
        Self::unusable(error.code(), error).with_remedy(remedy)
    }
}
