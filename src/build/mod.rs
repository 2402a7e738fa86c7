//! Orthophotos to store, in parallel, resumable.
