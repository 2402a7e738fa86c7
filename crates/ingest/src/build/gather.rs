//! Finding and declaring the sources that a request names.

use super::declare::{DeclaredSource, declare};
use super::error::{BuildError, Rejected};
use super::request::Request;
use crate::raster::find_sources;
use overfly_store::LayerState;

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
    if resumes || !request.remove_sources.is_empty() { Ok(()) } else { Err(BuildError::NoSources) }
}
