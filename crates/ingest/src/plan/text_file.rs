//! Reading what a user wrote: routes, aircraft, calibrations.

use std::path::Path;

/// The largest file that is read, bytes.
const MOST_BYTES: u64 = 64 << 20;

/// The text of a plain file of no absurd size.
///
/// # Errors
/// Where it is none, is too large, is not text in UTF-8, or cannot be read.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        // Pipes and devices may have no end.
        return Err(std::io::Error::other("it is no regular file"));
    }
    if metadata.len() > MOST_BYTES {
        return Err(std::io::Error::other(format!("{} bytes, at most {MOST_BYTES} are read", metadata.len())));
    }
    std::fs::read_to_string(path)
}
