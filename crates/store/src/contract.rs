//! The descriptor contract: how the keypoints of a store's tiles are described.

use crate::StoreError;
use overfly_core::feature::keypoint::CONTRACT;
use rusqlite::Connection;
use std::path::Path;

/// Returns the descriptor contract of a store.
///
/// # Errors
/// [`StoreError::OtherContract`] if the store follows another contract than this program.
pub fn require_contract(connection: &Connection, path: &Path) -> Result<String, StoreError> {
    let found: String = connection
        .query_row("SELECT descriptor_contract FROM overfly_store WHERE id = 1", [], |row| row.get(0))
        .map_err(|e| match e {
            rusqlite::Error::QueryReturnedNoRows => {
                StoreError::Damaged { path: path.into(), reason: "it states no descriptor contract".into() }
            }
            other => StoreError::sqlite(path, other),
        })?;
    if found == CONTRACT {
        return Ok(found);
    }
    Err(StoreError::OtherContract { path: path.into(), found, expected: CONTRACT.into() })
}
