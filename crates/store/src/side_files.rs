//! The `-wal` and `-journal` files beside a store.

use super::error::StoreError;
use std::path::{Path, PathBuf};

/// Returns the names of the `-wal` and `-journal` files of a store.
pub fn side_files(path: &Path) -> [PathBuf; 2] {
    ["-wal", "-journal"].map(|suffix| {
        let mut name = path.as_os_str().to_os_string();
        name.push(suffix);
        PathBuf::from(name)
    })
}

/// Rejects a store that has a non-empty journal or write-ahead log.
///
/// # Errors
/// [`StoreError::SideFile`].
pub fn refuse_side_files(path: &Path) -> Result<(), StoreError> {
    for side in side_files(path) {
        if std::fs::metadata(&side).is_ok_and(|m| m.len() > 0) {
            return Err(StoreError::SideFile { side });
        }
    }
    Ok(())
}
