//! Finding and declaring the sources that a request names.

use super::declare::{DeclaredSource, declare};
use super::error::{BuildError, Rejected};
use super::request::Request;
use crate::raster::find_sources;
use overfly_store::{LayerState, Reader, StoreError};
use std::path::Path;

/// Finds and declares the sources of a request; unusable ones go to `rejected`.
pub fn gather(request: &Request, rejected: &mut Vec<Rejected>) -> Vec<DeclaredSource> {
    let mut given: Vec<DeclaredSource> = Vec::new();
    for path in &request.sources {
        let found = match find_sources(std::slice::from_ref(path)) {
            Ok(found) => found,
            Err(error) => {
                rejected.push(Rejected::from((path.as_path(), &error)));
                continue;
            }
        };
        rejected.extend(found.unreadable.iter().map(|(path, error)| Rejected::from((path.as_path(), error))));
        for file in found.files {
            match declare(&file, request) {
                Ok(one) => {
                    given.retain(|g| g.source.content_hash != one.source.content_hash);
                    given.push(one);
                }
                Err(bad) => rejected.push(bad),
            }
        }
    }
    given
}

/// Checks that there is something to do.
///
/// # Errors
/// [`BuildError::NothingUsable`], [`BuildError::NoSources`].
pub fn require_work(
    request: &Request,
    draft: &LayerState,
    given: &[DeclaredSource],
    rejected: &[Rejected],
) -> Result<(), BuildError> {
    if !given.is_empty() {
        return Ok(());
    }
    if !rejected.is_empty() {
        return Err(BuildError::NothingUsable { rejected: rejected.to_vec() });
    }
    let resumes = draft.pending && !request.replace_layer;
    if resumes || !request.remove_sources.is_empty() {
        return Ok(());
    }
    Err(BuildError::NoSources { layer: request.layer.clone(), unfinished: unfinished_layers(&request.db) })
}

/// The layers of a store whose build is unfinished; none where there is no store.
fn unfinished_layers(db: &Path) -> Vec<String> {
    let store = match Reader::open(db) {
        Ok(store) => store,
        Err(StoreError::Unfinished { layer, .. }) => return layer.split(", ").map(str::to_owned).collect(),
        Err(_) => return Vec::new(),
    };
    let is_pending = |name: &str| LayerState::read(db, name).is_ok_and(|state| state.pending);
    let layers = store.layers().iter().filter(|layer| !layer.complete || is_pending(&layer.name));
    layers.map(|layer| layer.name.clone()).collect()
}
