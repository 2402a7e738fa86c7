//! Reading small files that users name, such as cameras, routes and tokens: a device, a pipe or a huge file is refused, not read.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Most bytes of a small file: a camera, an aircraft, a token.
const SMALL_BYTES: u64 = 1 << 20;

/// Reads a regular file of at most `most_bytes`; links to it are followed.
///
/// # Errors
/// Where the path is not a regular file, the file is larger, or cannot be read.
pub fn read_bounded(path: &Path, most_bytes: u64) -> Result<Vec<u8>> {
    require_regular(path)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    let too_large = |bytes: u64| Error::other(format!("{bytes} bytes, at most {most_bytes} are read"));
    if metadata.len() > most_bytes {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::new();
    file.take(most_bytes + 1).read_to_end(&mut bytes)?;
    // Some files have no size before they are read, as in /proc.
    if bytes.len() as u64 > most_bytes { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

/// Reads a regular file of at most `most_bytes` as text; see [`read_bounded`].
///
/// # Errors
/// As [`read_bounded`], and where the file is not UTF-8.
pub fn read_bounded_text(path: &Path, most_bytes: u64) -> Result<String> {
    String::from_utf8(read_bounded(path, most_bytes)?)
        .map_err(|_| Error::new(ErrorKind::InvalidData, "it is not text (UTF-8)"))
}

/// Reads a regular file of at most 1 MiB as text; see [`read_bounded`].
///
/// # Errors
/// As [`read_bounded_text`].
pub fn read_small_text(path: &Path) -> Result<String> {
    read_bounded_text(path, SMALL_BYTES)
}

/// Checks that a path leads to a regular file. A device may have no end, and opening a pipe waits for its writer.
///
/// # Errors
/// Where it leads to something else, or to nothing.
pub fn require_regular(path: &Path) -> Result<()> {
    if std::fs::metadata(path)?.is_file() { Ok(()) } else { Err(Error::other("it is not a regular file")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_regular_files_within_the_bound_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(read_bounded(&path, 3).unwrap(), b"abc");
        assert_eq!(read_small_text(&path).unwrap(), "abc");
        let refused = |path: &Path| read_bounded(path, 2).unwrap_err().to_string();
        assert_eq!(refused(&path), "3 bytes, at most 2 are read");
        for other in [folder.path(), Path::new("/dev/zero"), Path::new("/dev/stdin")] {
            let reason = refused(other);
            assert!(reason == "it is not a regular file" || other.ends_with("stdin"), "{other:?}: {reason}");
        }
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        assert_eq!(read_small_text(&path).unwrap_err().to_string(), "it is not text (UTF-8)");
    }

    #[test]
    fn a_pipe_is_refused_without_waiting_for_its_writer() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert_eq!(read_small_text(&pipe).unwrap_err().to_string(), "it is not a regular file");
    }
}
