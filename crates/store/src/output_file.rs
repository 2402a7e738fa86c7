//! Writing files that users name: what exists there and is not a regular file is refused, not written to or through.

use super::file_header::{HEADER_LEN, is_geopackage};
use std::fs::File;
use std::io::{Error, Read, Result};
use std::path::Path;

/// Writes a file. A file that exists is replaced; a store, a secret key, a link, a device, a pipe or a folder is refused.
///
/// # Errors
/// Where something else than a regular file is at the path, or it cannot be written.
pub fn write_output(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    require_output(path)?;
    std::fs::write(path, bytes)
}

/// Checks that a file can be written at a path: nothing is there, or a regular file that is neither a store nor a key.
///
/// # Errors
/// Where something else is there: a link, a device, a pipe or a folder; a store or a secret key.
pub fn require_output(path: &Path) -> Result<()> {
    let kind = match std::fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(found) => found.file_type(),
    };
    let found = match () {
        () if kind.is_file() => match irreplaceable(path) {
            None => return Ok(()),
            Some(found) => found,
        },
        () if kind.is_dir() => "a folder",
        () if kind.is_symlink() => "a link",
        () => "a device, a pipe or a socket",
    };
    Err(Error::other(format!("{found} is in the way: choose another path")))
}

/// What a file is that no report or table takes the place of: `None` for any other file, and one that cannot be read.
fn irreplaceable(path: &Path) -> Option<&'static str> {
    let mut head = Vec::new();
    File::open(path).ok()?.take(HEADER_LEN as u64).read_to_end(&mut head).ok()?;
    match &head[..] {
        head if is_geopackage(head) => Some("a store"),
        head if head.starts_with(b"-----BEGIN PRIVATE KEY") => Some("a secret key"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_regular_files_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for text in ["new", "again"] {
            write_output(&at("a.csv"), text).unwrap();
            assert_eq!(std::fs::read(at("a.csv")).unwrap(), text.as_bytes());
        }
        std::os::unix::fs::symlink(at("a.csv"), at("link")).unwrap();
        std::os::unix::fs::symlink(at("none"), at("dangling")).unwrap();
        std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        for other in ["link", "dangling", "socket", "pipe", "."] {
            let reason = write_output(&at(other), "x").unwrap_err().to_string();
            assert!(reason.contains("is in the way"), "{other}: {reason}");
        }
        assert!(write_output(Path::new("/dev/null"), "x").is_err());
        let mut map = vec![0; 4096];
        map[..16].copy_from_slice(b"SQLite format 3\0");
        map[68..72].copy_from_slice(b"GPKG");
        for (precious, what) in [(map, "a store"), (b"-----BEGIN PRIVATE KEY-----".to_vec(), "a secret key")] {
            std::fs::write(at("precious"), &precious).unwrap();
            assert!(write_output(&at("precious"), "x").unwrap_err().to_string().starts_with(what));
            assert_eq!(std::fs::read(at("precious")).unwrap(), precious);
        }
        assert_eq!(std::fs::read(at("a.csv")).unwrap(), b"again");
        assert!(!at("none").exists());
    }
}
