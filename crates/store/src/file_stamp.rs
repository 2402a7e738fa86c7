//! `FileStamp`: tells whether a file is still the one that was opened, without opening it.

use super::StoreError;
use super::bounded_file::require_regular;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

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

    /// Whether the file was last written at least so long ago, by the clock of this machine. A clock that was set back says no.
    pub fn is_older_than(&self, age: Duration) -> bool {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let modified = u64::try_from(self.modified_s).ok().zip(u32::try_from(self.modified_ns).ok());
        modified.is_none_or(|(s, ns)| since_epoch.checked_sub(Duration::new(s, ns)).is_some_and(|found| found >= age))
    }

    /// Size of the file, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_how_long_ago_a_file_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let file = std::fs::File::create(&path).unwrap();
        let is_old = |age_s: u64| FileStamp::read(&path).unwrap().is_older_than(Duration::from_secs(age_s));
        assert!(!is_old(3_600));
        file.set_modified(SystemTime::now() - Duration::from_secs(60)).unwrap();
        assert!(is_old(50) && !is_old(70));
        file.set_modified(SystemTime::now() + Duration::from_secs(60)).unwrap();
        assert!(!is_old(0), "written in the future");
        file.set_modified(UNIX_EPOCH - Duration::from_secs(60)).unwrap();
        assert!(is_old(50));
    }
}
