//! The words of a problem document: what happened and what to do, without the server's own paths.

use super::error::ServerError;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_store::StoreError;

/// What a caller reads of an error.
pub(super) fn detail(error: &ServerError) -> String {
    match error {
        ServerError::Store(error)
        | ServerError::Candidates(CandidatesError::Store(error))
        | ServerError::Locate(LocateError::Store(error)) => store_detail(error),
        other => other.to_string(),
    }
}

fn store_detail(error: &StoreError) -> String {
    // SQLite's own message holds the path.
    if matches!(error, StoreError::Denied { .. }) {
        return "no permission to read the store's file".to_owned();
    }
    let text = error.to_string();
    text.split_once(": ").map_or(text.clone(), |(_, rest)| rest.to_owned())
}
