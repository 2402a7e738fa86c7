//! `Outlet`: a file that comes into being whole. It is written beside its place, synced and renamed; the folder is synced too.

use super::StoreError;
use super::connection::{refuse_side_files, side_files};
use std::fs::{File, TryLockError};
use std::io::Read;
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::{Path, PathBuf};

/// What is written, and so what of an older run may be overwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A store.
    Store,
    /// A patch between stores.
    Patch,
}

impl Kind {
    /// Whether a file that begins so is one of these.
    fn begins(self, head: &[u8]) -> bool {
        match self {
            Self::Store => head.starts_with(b"SQLite format 3\0") && head.get(68..72) == Some(b"GPKG"),
            Self::Patch => head.starts_with(PATCH_MAGIC),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Store => "a store",
            Self::Patch => "a patch",
        }
    }
}

/// The first bytes of a patch.
pub const PATCH_MAGIC: &[u8; 16] = b"overfly patch 1\n";

/// A file being written beside its place. Dropped before [`Outlet::publish`], it is removed, and the place is as it was.
#[derive(Debug)]
pub struct Outlet {
    place: PathBuf,
    beside: PathBuf,
    /// Held so that nobody else writes to the same file: locks end with the process, however it ends.
    lock: File,
    published: bool,
}

/// What is put behind the name of a file that is being written, and of what is needed on the way.
const NEW: &str = ".overfly-new";
const DRAFT: &str = ".overfly-draft";

impl Outlet {
    /// Takes the name `place` with `.overfly-new` behind it (of a link's target, where `place` is a link); what a killed run left
    /// there is overwritten. What stands at the place may be of the same kind, or empty, and none of `inputs`, which are read.
    ///
    /// # Errors
    /// [`StoreError::SameFile`], [`StoreError::InTheWay`]; [`StoreError::Occupied`] where another process writes there; where the
    /// folder is absent or may not be written.
    pub fn at(place: &Path, kind: Kind, inputs: &[&Path]) -> Result<Self, StoreError> {
        let place = &std::fs::canonicalize(place).unwrap_or_else(|_| place.into());
        let on_the_way = [NEW, DRAFT].map(|suffix| with_suffix(place, suffix));
        for input in inputs {
            if on_the_way.iter().chain([place]).any(|path| is_same_file(input, path)) {
                return Err(StoreError::SameFile { path: place.into() });
            }
        }
        refuse_other(place, kind)?;
        on_the_way.iter().try_for_each(|path| refuse_no_file(path))?;
        let fail = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => StoreError::NoFolder { path: place.into() },
            _ => StoreError::io(place, e),
        };
        let [beside, _] = on_the_way;
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
        with_suffix(&self.place, DRAFT)
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
    /// Where a side file of another store stands beside the place (SQLite would take it for the new one's). Where the system
    /// fails; the place is then as it was, or (where only the folder's sync failed) holds the new file.
    pub fn publish(mut self) -> Result<(), StoreError> {
        let fail = |e| StoreError::io(&self.place, e);
        refuse_side_files(&self.place)?;
        self.take_over_rights().map_err(fail)?;
        self.lock.sync_all().map_err(fail)?;
        std::fs::rename(&self.beside, &self.place).map_err(fail)?;
        self.published = true;
        let folder = self.place.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| StoreError::io(folder, e))
    }
}

impl Outlet {
    /// Mode and, where that is allowed, owner of what is replaced.
    fn take_over_rights(&self) -> std::io::Result<()> {
        let Ok(old) = std::fs::metadata(&self.place) else { return Ok(()) };
        // Giving away takes rights that few have; the mode is what protects.
        let _ = fchown(&self.lock, Some(old.uid()), Some(old.gid()));
        self.lock.set_permissions(old.permissions())
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

/// Refuses to write over what is not of the kind.
fn refuse_other(place: &Path, kind: Kind) -> Result<(), StoreError> {
    refuse_no_file(place)?;
    let mut head = Vec::new();
    match File::open(place) {
        Ok(file) => file.take(100).read_to_end(&mut head).map_err(|e| StoreError::io(place, e))?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(StoreError::io(place, e)),
    };
    if head.is_empty() || kind.begins(&head) {
        return Ok(());
    }
    Err(StoreError::InTheWay { path: place.into(), found: format!("a file that is not {}", kind.name()) })
}

/// Refuses a name at which something stands that is no plain file.
fn refuse_no_file(path: &Path) -> Result<(), StoreError> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => Err(StoreError::InTheWay { path: path.into(), found: "a folder".into() }),
        Ok(found) if !found.is_file() => {
            Err(StoreError::InTheWay { path: path.into(), found: "a link, a device or a pipe".into() })
        }
        _ => Ok(()),
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
        std::fs::write(with_suffix(&place, NEW), b"left by a killed run").unwrap();
        let outlet = Outlet::at(&place, Kind::Patch, &[]).unwrap();
        assert_eq!(std::fs::read(outlet.beside()).unwrap(), b"");
        assert_eq!(Outlet::at(&place, Kind::Patch, &[]).unwrap_err().code(), "export_under_way");
        drop(outlet);
        assert!(names().is_empty());
        let outlet = Outlet::at(&place, Kind::Patch, &[]).unwrap();
        std::fs::write(outlet.beside(), PATCH_MAGIC).unwrap();
        outlet.publish().unwrap();
        assert_eq!((names(), std::fs::read(&place).unwrap()), (vec!["a.gpkg".into()], PATCH_MAGIC.to_vec()));
        assert_eq!(
            Outlet::at(&folder.path().join("no/a.gpkg"), Kind::Patch, &[]).unwrap_err().code(),
            "no_such_folder"
        );
        assert_eq!(Outlet::at(folder.path(), Kind::Patch, &[]).unwrap_err().code(), "in_the_way");
    }

    #[test]
    fn nothing_is_written_over_but_its_own_kind() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let refused = |place: &Path, inputs: &[&Path]| Outlet::at(place, Kind::Store, inputs).unwrap_err().code();
        std::fs::write(at("key"), b"-----BEGIN PRIVATE KEY-----").unwrap();
        std::fs::write(at("old.patch"), PATCH_MAGIC).unwrap();
        assert_eq!(refused(&at("key"), &[]), "in_the_way");
        assert_eq!(refused(&at("old.patch"), &[]), "in_the_way");
        assert_eq!(refused(Path::new("/dev/null"), &[]), "in_the_way");
        // Neither is what is read, nor what a name on the way leads to.
        std::fs::write(at("a"), b"").unwrap();
        assert_eq!(refused(&at("a"), &[&at("a")]), "same_file");
        std::fs::write(at("a.overfly-draft"), b"").unwrap();
        assert_eq!(refused(&at("a"), &[&at("a.overfly-draft")]), "same_file");
        std::os::unix::fs::symlink(at("key"), at("b.overfly-new")).unwrap();
        assert_eq!(refused(&at("b"), &[]), "in_the_way");
        assert_eq!(std::fs::read(at("key")).unwrap(), b"-----BEGIN PRIVATE KEY-----");
    }

    #[test]
    fn a_link_stays_one_and_rights_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        std::fs::write(&real, PATCH_MAGIC).unwrap();
        std::fs::set_permissions(&real, std::fs::Permissions::from_mode(0o600)).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let outlet = Outlet::at(&link, Kind::Patch, &[]).unwrap();
        std::fs::write(outlet.beside(), b"new").unwrap();
        outlet.publish().unwrap();
        assert!(link.is_symlink() && std::fs::read(&real).unwrap() == b"new");
        assert_eq!(std::fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
