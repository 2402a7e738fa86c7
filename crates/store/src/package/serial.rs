//! Serials: a store of a lower number never replaces one of a higher number, and is not flown where a least number is demanded.

use super::{Manifest, PackageError};
use crate::Reader;
use std::path::Path;

/// Checks that an exported store has at least a serial. A store without one counts as older than any that has one.
///
/// # Errors
/// [`PackageError::OlderSerial`].
pub fn require_serial(path: &Path, manifest: Option<&Manifest>, least: Option<u64>) -> Result<(), PackageError> {
    let Some(least) = least else { return Ok(()) };
    match manifest.and_then(|manifest| manifest.serial) {
        Some(found) if found >= least => Ok(()),
        found => Err(PackageError::OlderSerial { path: path.into(), found, least }),
    }
}

/// The serial that a stored manifest states: `None` for a built store.
pub(super) fn serial_of(manifest: Option<&str>) -> Option<u64> {
    manifest.and_then(|text| Manifest::from_text(text).ok()).and_then(|manifest| manifest.serial)
}

/// Returns the serial that the export at a path states: `None` where there is none, or another file. Nothing is proved.
pub fn stated_serial(path: &Path) -> Option<u64> {
    serial_of(Reader::open(path).ok()?.manifest())
}
