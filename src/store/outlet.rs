//! `Outlet`: a file that comes into being whole. It is written beside its place, synced and renamed; the folder is synced too.

use super::StoreError;
use super::connection::{refuse_side_files, side_files};
use std::fs::{File, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A file being written beside its place. Dropped before [`Outlet::publish`], it is removed, and the place is as it was.
#[derive(Debug)]
pub struct Outlet {
    place: PathBuf,
    beside: PathBuf,
    /// Held so that nobody else writes to the same file: locks end with the process, however it ends.
    lock: File,
    published: bool,
}

impl Outlet {
    /// Takes the name `place` with `-new` behind it; what a killed run left there is overwritten.
    ///
    /// # Errors
    /// [`StoreError::Occupied`] where another process writes there; where the folder is absent or may not be written.
    pub fn at(place: &Path) -> Result<Self, StoreError> {
        let fail = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => StoreError::NoFolder { path: place.into() },
            _ => StoreError::io(place, e),
        };
        if place.is_dir() {
            return Err(fail(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
        }
        let beside = with_suffix(place, "-new");
        loop {
            let lock =
                File::options().create(true).truncate(false).write(true).read(true).open(&beside).map_err(fail)?;
            match lock.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(StoreError::Occupied { path: place.into() }),
                Err(TryLockError::Error(e)) => return Err(fail(e)),
                Ok(()) => {}
            }
            // Whoever held the lock before may have renamed or removed the file that was opened here.
            let same = |m: std::fs::Metadata| m.ino() == lock.metadata().map_or(0, |l| l.ino());
            if std::fs::symlink_metadata(&beside).is_ok_and(same) {
                let outlet = Self { place: place.into(), beside, lock, published: false };
                outlet.clear()?;
                return Ok(outlet);
            }
        }
    }

    /// Where to write.
    pub fn beside(&self) -> &Path {
        &self.beside
    }

    /// A second name for what is needed on the way.
    pub fn draft(&self) -> PathBuf {
        with_suffix(&self.place, "-draft")
    }

    /// Empties it again.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn clear(&self) -> Result<(), StoreError> {
        self.lock.set_len(0).map_err(|e| StoreError::io(&self.beside, e))
    }

    /// Syncs it, gives it its name, and syncs the folder.
    ///
    /// # Errors
    /// Where a side file of another store stands beside the place (SQLite would take it for the new one's). Where the system fails; the place is then as it was, or (where only the folder's sync failed) holds the new file.
    pub fn publish(mut self) -> Result<(), StoreError> {
        let fail = |e| StoreError::io(&self.place, e);
        refuse_side_files(&self.place)?;
        self.lock.sync_all().map_err(fail)?;
        std::fs::rename(&self.beside, &self.place).map_err(fail)?;
        self.published = true;
        let folder = self.place.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| StoreError::io(folder, e))
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        if !self.published {
            // What was begun is worthless; what went wrong was reported.
            let _ = std::fs::remove_file(&self.beside);
            for side in side_files(&self.beside) {
                let _ = std::fs::remove_file(side);
            }
        }
    }
}

/// Whether two names lead to one file that exists: nothing is written over what it is made from.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    std::fs::canonicalize(a).ok().zip(std::fs::canonicalize(b).ok()).is_some_and(|(a, b)| a == b)
}

/// Size of a file, bytes.
///
/// # Errors
/// Where the system fails.
pub fn size_of(path: &Path) -> Result<u64, StoreError> {
    Ok(std::fs::metadata(path).map_err(|e| StoreError::io(path, e))?.len())
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(suffix);
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_is_as_it_was_or_holds_all_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.gpkg");
        let names = || {
            let names = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name());
            names.collect::<Vec<_>>()
        };
        std::fs::write(with_suffix(&place, "-new"), b"left by a killed run").unwrap();
        let outlet = Outlet::at(&place).unwrap();
        assert_eq!(std::fs::read(outlet.beside()).unwrap(), b"");
        assert_eq!(Outlet::at(&place).unwrap_err().code(), "export_under_way");
        drop(outlet);
        assert!(names().is_empty());
        let outlet = Outlet::at(&place).unwrap();
        std::fs::write(outlet.beside(), b"whole").unwrap();
        outlet.publish().unwrap();
        assert_eq!((names(), std::fs::read(&place).unwrap()), (vec!["a.gpkg".into()], b"whole".to_vec()));
        assert_eq!(Outlet::at(&folder.path().join("no/a.gpkg")).unwrap_err().code(), "no_such_folder");
        assert!(Outlet::at(folder.path()).is_err());
    }
}
