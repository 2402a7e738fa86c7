//! The words of a problem document: what happened and what to do, without the server's own paths.

use super::error::ServerError;
use super::remedy::spell;
use overfly_flight::locate::LocateError;
use overfly_flight::locate::candidates::CandidatesError;
use overfly_store::StoreError;

/// What a caller reads of an error.
pub(super) fn detail(error: &ServerError) -> String {
    match error {
        ServerError::Store(error)
        | ServerError::Candidates(CandidatesError::Store(error))
        | ServerError::Locate(LocateError::Store(error)) => store_detail(error),
        ServerError::Candidates(error @ CandidatesError::LayerNotStated { .. }) => {
            format!("{error}; state it as `layer`, or in POST /v1/fixes `any` for all of them")
        }
        ServerError::Candidates(error @ CandidatesError::AnyLayer { .. }) => {
            format!("{error}; state one as `layer`, or ask POST /v1/fixes")
        }
        other => other.to_string(),
    }
}

fn store_detail(error: &StoreError) -> String {
    let fact = match error {
        // SQLite's own message holds the path.
        StoreError::Denied { .. } => "no permission to read the store's file".to_owned(),
        other => {
            let text = other.to_string();
            text.split_once(": ").map_or(text.clone(), |(_, rest)| rest.to_owned())
        }
    };
    let remedy = match error {
        StoreError::NoLayer { .. } => Some("GET /v1/layers lists the layers"),
        other => other.remedy().and_then(spell),
    };
    remedy.map_or(fact.clone(), |remedy| format!("{fact}; {remedy}"))
}
