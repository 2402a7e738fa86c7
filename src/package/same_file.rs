//! Nothing is written over what it is made from.

use super::PackageError;
use std::path::Path;

/// Refuses to write to a file that is read meanwhile.
///
/// # Errors
/// [`PackageError::SameFile`].
pub fn refuse_same_file(read: &Path, out: &Path) -> Result<(), PackageError> {
    let same = std::fs::canonicalize(read).ok().zip(std::fs::canonicalize(out).ok()).is_some_and(|(a, b)| a == b);
    if same { Err(PackageError::SameFile { path: out.into() }) } else { Ok(()) }
}
