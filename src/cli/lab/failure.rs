//! The failures of trials.

use crate::cli::failure::Failure;
use crate::cli::preflight::remedy::spell as spell_ingest;
use crate::cli::remedy::{locate_remedy, spell};
use overfly_lab::trial::TrialError;

impl From<TrialError> for Failure {
    fn from(error: TrialError) -> Self {
        let remedy = match &error {
            TrialError::Store(error) => error.remedy().map(|remedy| spell(remedy).to_owned()),
            TrialError::Imagery(error) => error.remedy().as_ref().map(spell_ingest),
            TrialError::Locate { cause, .. } => locate_remedy(cause).map(str::to_owned),
            TrialError::Unreadable { path, .. } if path.ends_with("flight.csv") => {
                Some("a flight is a folder with flight.csv, camera.toml and images".into())
            }
            TrialError::NoPlace { .. } => Some("take larger images, or a smaller `--edge-px`".into()),
            TrialError::NoStorePath { .. } => Some("state it, or name the store with `--db`".into()),
            TrialError::Option { name: "images", .. } => {
                Some("`overfly calibrate` takes five images for each of its `--pairs`".into())
            }
            _ => None,
        };
        let code = error.code();
        let failure = if error.is_input() { Self::unusable(code, error) } else { Self::failed(code, error) };
        failure.with_remedy(remedy)
    }
}
