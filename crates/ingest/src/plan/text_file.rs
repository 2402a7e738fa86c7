//! Reading text files that users write: routes, aircraft, calibrations.

use overfly_store::read_bounded_text;
use std::path::Path;

/// The largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Reads a regular file of at most 64 MiB as text.
///
/// # Errors
/// Where the path is not a regular file, the file is too large or not UTF-8, or cannot be read.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    read_bounded_text(path, MAX_BYTES)
}
