//! `MergeRequest`: which stores to merge, and how.

use std::path::PathBuf;

/// Which store covers where two stores have different tiles at the same place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Conflict {
    /// The one with the newer source, as within a build; unknown dates are the oldest.
    #[default]
    Newest,
    /// The store that is named first.
    First,
    /// None: the merge is refused.
    Refuse,
}

/// A merge of several stores.
#[derive(Debug, Clone)]
pub struct MergeRequest {
    /// The stores.
    pub stores: Vec<PathBuf>,
    /// The file to write.
    pub out: PathBuf,
    /// Which store covers where tiles differ.
    pub conflict: Conflict,
}
