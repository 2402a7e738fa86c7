//! `FileStamp`: tells whether a file is still the one that was opened, without opening it.

use super::StoreError;
use super::bounded_file::require_regular;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Device, inode, size and modification time of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileStamp {
    device: u64,
    inode: u64,
    bytes: u64,
    modified_s: i64,
    modified_ns: i64,
}

impl FileStamp {
    /// Reads the stamp of the file at `path`.
    ///
    /// # Errors
    /// Where the file does not exist, is not a regular file, or the system fails.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        let metadata = std::fs::metadata(path).map_err(|e| StoreError::io(path, e))?;
        if !metadata.is_dir() {
            // SQLite says what a folder is. Opening a pipe would wait for its writer.
            require_regular(path).map_err(|e| StoreError::io(path, e))?;
        }
        Ok(Self {
            device: metadata.dev(),
            inode: metadata.ino(),
            bytes: metadata.len(),
            modified_s: metadata.mtime(),
            modified_ns: metadata.mtime_nsec(),
        })
    }

    /// Whether both stamps belong to the same file, even if it was written in between.
    pub fn same_file(&self, other: &Self) -> bool {
        (self.device, self.inode) == (other.device, other.inode)
    }

    /// Size of the file, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
