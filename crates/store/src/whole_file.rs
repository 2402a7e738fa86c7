//! Whether a file is as long as its header states: half a copy is not.

use super::bounded_file::require_regular;
use super::error::StoreError;
use super::file_header::{HEADER_LEN, SQLITE_MAGIC, stated_len};
use super::side_files::side_files;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Checks that a file is as long as its header states. Half a copy is not, unless an unfinished write explains it. A file that cannot be
/// read, or is no SQLite file, is left to the checks that follow.
///
/// # Errors
/// [`StoreError::CutOff`].
pub fn require_whole(path: &Path) -> Result<(), StoreError> {
    if require_regular(path).is_err() || side_files(path).iter().any(|s| s.metadata().is_ok_and(|m| m.len() > 0)) {
        return Ok(());
    }
    let Ok(mut file) = File::open(path) else { return Ok(()) };
    let Ok(found) = file.metadata().map(|metadata| metadata.len()) else { return Ok(()) };
    let mut head = Vec::new();
    if file.by_ref().take(HEADER_LEN as u64).read_to_end(&mut head).is_err() {
        return Ok(());
    }
    let cut_off = |stated| Err(StoreError::CutOff { path: path.into(), found, stated });
    match <&[u8; HEADER_LEN]>::try_from(&head[..]) {
        Ok(header) => match stated_len(header) {
            Some(stated) if stated > found => cut_off(Some(stated)),
            _ => Ok(()),
        },
        // The beginning of a header, or nothing at all.
        Err(_) if head.starts_with(&SQLITE_MAGIC[..head.len().min(SQLITE_MAGIC.len())]) => cut_off(None),
        Err(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::file_header::header_of_8_megabytes as header;
    use super::*;

    #[test]
    fn half_a_copy_is_cut_off_and_another_file_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gpkg");
        for (bytes, said) in [
            (&header()[..], Some("0.0 of 8.4 MB")),
            (&header()[..50], Some("only 50 bytes")),
            (&header()[..3], Some("only 3 bytes")),
            (b"", Some("an empty file")),
            (b"hello", None),
            (&[0; 200], None),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let text = require_whole(&path).err().map(|e| (e.code(), e.to_string()));
            assert_eq!(text.as_ref().map(|(code, _)| *code), said.map(|_| "cut_off"), "{bytes:?}");
            assert!(said.is_none_or(|said| text.unwrap().1.contains(said)), "{bytes:?}");
        }
        std::fs::write(&path, header()).unwrap();
        std::fs::write(folder.path().join("a.gpkg-journal"), "x").unwrap();
        assert!(require_whole(&path).is_ok(), "an unfinished write explains it");
        assert!(require_whole(&folder.path().join("none")).is_ok() && require_whole(folder.path()).is_ok());
    }
}
