//! `ExportFolder`: the temporary folder of the exports. It is locked while the service lives, so that what a killed service left can
//! be told from what another one uses.

use parking_lot::Mutex;
use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use tempfile::TempDir;

/// How the names of these folders begin.
const PREFIX: &str = "overfly-exports-";

/// A temporary folder that is removed when dropped.
#[derive(Debug)]
pub(super) struct ExportFolder {
    folder: TempDir,
    /// The system releases it when the process ends, however it ends.
    lock: Mutex<File>,
}

impl ExportFolder {
    /// Makes a new folder in `parent`, and removes the folders that killed services left there.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn within(parent: &Path) -> io::Result<Self> {
        loop {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
            // Between both steps another service may take the folder for a leftover.
            if let Some(lock) = locked(folder.path())? {
                remove_leftovers(parent, folder.path());
                return Ok(Self { folder, lock: Mutex::new(lock) });
            }
        }
    }

    /// The folder; makes it again if something has cleared the temporary files.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn path(&self) -> io::Result<&Path> {
        let path = self.folder.path();
        if !path.exists() {
            std::fs::create_dir_all(path)?;
            if let Some(lock) = locked(path)? {
                *self.lock.lock() = lock;
            }
        }
        Ok(path)
    }
}

/// Opens and locks a folder; `None` if another process has the lock, or has removed the folder.
fn locked(folder: &Path) -> io::Result<Option<File>> {
    let file = match File::open(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        other => other?,
    };
    match file.try_lock() {
        Ok(()) => Ok(folder.exists().then_some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(e)) => Err(e),
    }
}

/// Removes the folders of this user that nobody has locked.
fn remove_leftovers(parent: &Path, own: &Path) {
    let (Ok(entries), Ok(user)) = (std::fs::read_dir(parent), std::fs::metadata(own).map(|m| m.uid())) else { return };
    for path in entries.flatten().map(|entry| entry.path()).filter(|path| path != own) {
        let is_named = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX));
        let is_folder = is_named && std::fs::symlink_metadata(&path).is_ok_and(|m| m.is_dir() && m.uid() == user);
        if !is_folder {
            continue;
        }
        if let Ok(Some(_lock)) = locked(&path) {
            match std::fs::remove_dir_all(&path) {
                Ok(()) => tracing::info!("removed exports that a killed service left"),
                Err(error) => tracing::warn!(%error, "exports that a killed service left cannot be removed"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_service_left_is_removed_and_nothing_else() {
        let parent = tempfile::tempdir().unwrap();
        let at = |name: &str| parent.path().join(name);
        std::fs::create_dir(at("overfly-exports-dead")).unwrap();
        std::fs::write(at("overfly-exports-dead").join("a.gpkg"), b"left").unwrap();
        std::fs::create_dir(at("other")).unwrap();
        std::fs::write(at("overfly-exports-file"), b"no folder").unwrap();
        std::os::unix::fs::symlink(at("other"), at("overfly-exports-link")).unwrap();
        let first = ExportFolder::within(parent.path()).unwrap();
        assert!(!at("overfly-exports-dead").exists());
        let second = ExportFolder::within(parent.path()).unwrap();
        assert!(first.folder.path().exists() && second.folder.path().exists(), "both services live");
        for kept in ["other", "overfly-exports-file", "overfly-exports-link"] {
            assert!(at(kept).exists(), "{kept}");
        }
        // Cleared under the service, the folder is made and locked again.
        std::fs::remove_dir(first.folder.path()).unwrap();
        assert!(first.path().unwrap().exists());
        let _third = ExportFolder::within(parent.path()).unwrap();
        assert!(first.folder.path().exists());
    }
}
