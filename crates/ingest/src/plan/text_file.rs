//! Reading text files that users write: routes, aircraft, calibrations.

use std::path::Path;

/// The largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Reads a regular file of at most 64 MiB as text.
///
/// # Errors
/// Where the path is not a regular file, the file is too large or not UTF-8, or cannot be read.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        // Pipes and devices may have no end.
        return Err(std::io::Error::other("it is not a regular file"));
    }
    if metadata.len() > MAX_BYTES {
        return Err(std::io::Error::other(format!("{} bytes, at most {MAX_BYTES} are read", metadata.len())));
    }
    std::fs::read_to_string(path)
}
