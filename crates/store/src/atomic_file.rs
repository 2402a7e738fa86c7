//! `AtomicFile`: a file that is replaced as a whole or not at all. It is written beside its target, synced and renamed; then the
//! folder is synced.

use super::StoreError;
use super::disk_space::free_bytes;
use super::file_header::{is_export, is_geopackage};
use super::side_files::{refuse_side_files, side_files};
use std::fs::{File, TryLockError};
use std::io::Read;
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::{Path, PathBuf};

/// The kind of a file: what it may take the place of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A store that was built or merged. It takes the place of no other file.
    Map,
    /// An export, which takes the place of an export only: no map is lost to a slip of the name.
    Export,
    /// A patch between stores, which takes the place of a patch only.
    Patch,
}

impl FileKind {
    /// Returns the kind of a file that begins with `head`: `None` for a file of another program.
    fn from_head(head: &[u8]) -> Option<Self> {
        match head {
            _ if is_export(head) => Some(Self::Export),
            _ if is_geopackage(head) => Some(Self::Map),
            _ => head.starts_with(PATCH_MAGIC).then_some(Self::Patch),
        }
    }

    /// Whether a file of this kind takes the place of one of the other kind.
    fn replaces(self, found: Option<Self>) -> bool {
        found == Some(self) && self != Self::Map
    }

    fn name(self) -> &'static str {
        match self {
            Self::Map => "a map",
            Self::Export => "an export",
            Self::Patch => "a patch",
        }
    }
}

/// The first bytes of a patch.
pub const PATCH_MAGIC: &[u8; 16] = b"overfly patch 1\n";

/// A file being written beside its target. Dropped before [`AtomicFile::persist`], it is removed, and the target is unchanged.
///
/// # Example
/// ```
/// use overfly_store::{AtomicFile, FileKind, PATCH_MAGIC};
///
/// let folder = tempfile::tempdir()?;
/// let target = folder.path().join("flight.patch");
/// let file = AtomicFile::create(&target, FileKind::Patch, &[])?;
/// std::fs::write(file.temporary_path(), PATCH_MAGIC)?;
/// assert!(!target.exists());
/// file.persist()?;
/// assert_eq!(std::fs::read(&target)?, PATCH_MAGIC);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    temporary: PathBuf,
    /// An exclusive lock on the temporary file. The system releases it when the process ends, however it ends.
    lock: File,
    persisted: bool,
}

/// Suffixes of the file that is being written, and of a draft that the writer may need.
const NEW: &str = ".overfly-new";
const DRAFT: &str = ".overfly-draft";

impl AtomicFile {
    /// Creates the temporary file: the name of `target` (if it is a link, of the file it links to) with the suffix `.overfly-new`. A
    /// file that a killed run left under that name is overwritten. An existing target must be empty, or an export or patch if that is
    /// written, and must not be one of `inputs`, the files that the new content is made from.
    ///
    /// # Errors
    /// [`StoreError::SameFile`], [`StoreError::InTheWay`], [`StoreError::Occupied`] if another process writes the same file, or
    /// where the folder does not exist or cannot be written.
    pub fn create(target: &Path, kind: FileKind, inputs: &[&Path]) -> Result<Self, StoreError> {
        Self::beside(target, Some(kind), inputs)
    }

    /// As [`AtomicFile::create`], for the next state of the store at `target`: the caller has read it, and knows what it is.
    ///
    /// # Errors
    /// As [`AtomicFile::create`].
    pub fn create_in_place(target: &Path, inputs: &[&Path]) -> Result<Self, StoreError> {
        Self::beside(target, None, inputs)
    }

    fn beside(target: &Path, kind: Option<FileKind>, inputs: &[&Path]) -> Result<Self, StoreError> {
        let target = &std::fs::canonicalize(target).unwrap_or_else(|_| target.into());
        let temporaries = [NEW, DRAFT].map(|suffix| with_suffix(target, suffix));
        for input in inputs {
            if temporaries.iter().chain([target]).any(|path| is_same_file(input, path)) {
                return Err(StoreError::SameFile { path: target.into() });
            }
        }
        require_regular(target)?;
        kind.map_or(Ok(()), |kind| require_kind(target, kind))?;
        temporaries.iter().try_for_each(|path| require_regular(path))?;
        let fail = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => StoreError::NoFolder { path: target.into() },
            _ => StoreError::io(target, e),
        };
        let [temporary, _] = temporaries;
        loop {
            let lock =
                File::options().create(true).truncate(false).write(true).read(true).open(&temporary).map_err(fail)?;
            match lock.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(StoreError::Occupied { path: target.into() }),
                Err(TryLockError::Error(e)) => return Err(fail(e)),
                Ok(()) => {}
            }
            // The previous holder of the lock may have renamed or removed the file that was opened here.
            let same = |m: std::fs::Metadata| m.ino() == lock.metadata().map_or(0, |l| l.ino());
            if std::fs::symlink_metadata(&temporary).is_ok_and(same) {
                let file = Self { target: target.into(), temporary, lock, persisted: false };
                file.truncate()?;
                return Ok(file);
            }
        }
    }

    /// Checks, before anything is written, that the disk has room for a draft and a file of at least `bytes` each.
    ///
    /// # Errors
    /// [`StoreError::DiskFull`] with what is needed and what is free.
    pub fn require_room(&self, bytes: u64) -> Result<(), StoreError> {
        let needed = bytes.saturating_mul(2);
        match free_bytes(&self.target) {
            Some(free) if free < needed => {
                Err(StoreError::DiskFull { path: self.target.clone(), needed: Some(needed), free: Some(free) })
            }
            _ => Ok(()),
        }
    }

    /// The path to write to.
    pub fn temporary_path(&self) -> &Path {
        &self.temporary
    }

    /// The path of a draft, for a writer that needs a second file.
    pub fn draft_path(&self) -> PathBuf {
        with_suffix(&self.target, DRAFT)
    }

    /// Truncates the temporary file.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn truncate(&self) -> Result<(), StoreError> {
        self.lock.set_len(0).map_err(|e| StoreError::io(&self.temporary, e))
    }

    /// Syncs the file, renames it to its target, and syncs the folder.
    ///
    /// # Errors
    /// [`StoreError::SideFile`] if the target has a journal: SQLite would apply it to the new file. Where the system fails: then the
    /// target is unchanged, or (if only the sync of the folder failed) is the new file.
    pub fn persist(mut self) -> Result<(), StoreError> {
        let fail = |e| StoreError::io(&self.target, e);
        refuse_side_files(&self.target)?;
        self.copy_permissions().map_err(fail)?;
        self.lock.sync_all().map_err(fail)?;
        std::fs::rename(&self.temporary, &self.target).map_err(fail)?;
        self.persisted = true;
        let folder = self.target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| StoreError::io(folder, e))
    }
}

impl AtomicFile {
    /// Copies mode and, if permitted, owner of the file that is replaced.
    fn copy_permissions(&self) -> std::io::Result<()> {
        let Ok(old) = std::fs::metadata(&self.target) else { return Ok(()) };
        // Changing the owner needs a privilege. The mode is what protects the file.
        let _ = fchown(&self.lock, Some(old.uid()), Some(old.gid()));
        self.lock.set_permissions(old.permissions())
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if !self.persisted {
            // The failure that led here is already reported.
            let _ = std::fs::remove_file(&self.temporary);
            for side in side_files(&self.temporary) {
                let _ = std::fs::remove_file(side);
            }
        }
    }
}

/// Rejects a target that is not replaced by a file of the kind.
fn require_kind(target: &Path, kind: FileKind) -> Result<(), StoreError> {
    let mut head = Vec::new();
    match File::open(target) {
        Ok(file) => file.take(100).read_to_end(&mut head).map_err(|e| StoreError::io(target, e))?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(StoreError::io(target, e)),
    };
    let found = FileKind::from_head(&head);
    if head.is_empty() || kind.replaces(found) {
        return Ok(());
    }
    let found = found.map_or_else(|| format!("a file that is not {}", kind.name()), |found| found.name().to_owned());
    Err(StoreError::InTheWay { path: target.into(), found })
}

/// Rejects a path at which something exists that is not a regular file.
fn require_regular(path: &Path) -> Result<(), StoreError> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => Err(StoreError::InTheWay { path: path.into(), found: "a folder".into() }),
        Ok(found) if !found.is_file() => {
            Err(StoreError::InTheWay { path: path.into(), found: "a link, a device or a pipe".into() })
        }
        _ => Ok(()),
    }
}

/// Whether two paths lead to the same existing file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    std::fs::canonicalize(a).ok().zip(std::fs::canonicalize(b).ok()).is_some_and(|(a, b)| a == b)
}

/// Returns the size of a file, bytes.
///
/// # Errors
/// Where the system fails.
pub fn file_len(path: &Path) -> Result<u64, StoreError> {
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
    fn the_target_is_unchanged_or_complete() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.gpkg");
        let names = || {
            let names = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name());
            names.collect::<Vec<_>>()
        };
        std::fs::write(with_suffix(&target, NEW), b"left by a killed run").unwrap();
        let file = AtomicFile::create(&target, FileKind::Patch, &[]).unwrap();
        assert_eq!(std::fs::read(file.temporary_path()).unwrap(), b"");
        assert_eq!(AtomicFile::create(&target, FileKind::Patch, &[]).unwrap_err().code(), "export_under_way");
        drop(file);
        assert!(names().is_empty());
        let file = AtomicFile::create(&target, FileKind::Patch, &[]).unwrap();
        std::fs::write(file.temporary_path(), PATCH_MAGIC).unwrap();
        file.persist().unwrap();
        assert_eq!((names(), std::fs::read(&target).unwrap()), (vec!["a.gpkg".into()], PATCH_MAGIC.to_vec()));
        assert_eq!(
            AtomicFile::create(&folder.path().join("no/a.gpkg"), FileKind::Patch, &[]).unwrap_err().code(),
            "no_such_folder"
        );
        assert_eq!(AtomicFile::create(folder.path(), FileKind::Patch, &[]).unwrap_err().code(), "in_the_way");
    }

    #[test]
    fn overwrites_only_its_own_kind() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let refused =
            |target: &Path, inputs: &[&Path]| AtomicFile::create(target, FileKind::Export, inputs).unwrap_err().code();
        std::fs::write(at("key"), b"-----BEGIN PRIVATE KEY-----").unwrap();
        std::fs::write(at("old.patch"), PATCH_MAGIC).unwrap();
        assert_eq!(refused(&at("key"), &[]), "in_the_way");
        assert_eq!(refused(&at("old.patch"), &[]), "in_the_way");
        let mut map = [0; 100];
        map[..16].copy_from_slice(b"SQLite format 3\0");
        map[68..72].copy_from_slice(b"GPKG");
        std::fs::write(at("map.gpkg"), map).unwrap();
        assert_eq!(refused(&at("map.gpkg"), &[]), "in_the_way");
        map[20] = 144;
        std::fs::write(at("flight.gpkg"), map).unwrap();
        let create = |name: &str, kind: FileKind| AtomicFile::create(&at(name), kind, &[]).map(drop);
        assert!(create("flight.gpkg", FileKind::Export).is_ok());
        for name in ["map.gpkg", "flight.gpkg"] {
            for kind in [FileKind::Map, FileKind::Patch] {
                assert_eq!(create(name, kind).unwrap_err().code(), "in_the_way", "{name}, {kind:?}");
            }
            assert!(AtomicFile::create_in_place(&at(name), &[]).is_ok());
        }
        assert_eq!(refused(Path::new("/dev/null"), &[]), "in_the_way");
        // Neither an input, nor what a temporary name links to, is overwritten.
        std::fs::write(at("a"), b"").unwrap();
        assert_eq!(refused(&at("a"), &[&at("a")]), "same_file");
        std::fs::write(at("a.overfly-draft"), b"").unwrap();
        assert_eq!(refused(&at("a"), &[&at("a.overfly-draft")]), "same_file");
        std::os::unix::fs::symlink(at("key"), at("b.overfly-new")).unwrap();
        assert_eq!(refused(&at("b"), &[]), "in_the_way");
        assert_eq!(std::fs::read(at("key")).unwrap(), b"-----BEGIN PRIVATE KEY-----");
    }

    #[test]
    fn too_little_room_is_told_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = AtomicFile::create(&folder.path().join("a.gpkg"), FileKind::Export, &[]).unwrap();
        file.require_room(1).unwrap();
        let refused = file.require_room(1 << 60).unwrap_err();
        assert_eq!(refused.code(), "disk_full");
        let text = refused.to_string();
        assert!(
            text.contains("2305843009213.7 MB are needed, ") && text.contains(" MB are free; the previous"),
            "{text}"
        );
    }

    #[test]
    fn keeps_links_and_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        std::fs::write(&real, PATCH_MAGIC).unwrap();
        std::fs::set_permissions(&real, std::fs::Permissions::from_mode(0o600)).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let file = AtomicFile::create(&link, FileKind::Patch, &[]).unwrap();
        std::fs::write(file.temporary_path(), b"new").unwrap();
        file.persist().unwrap();
        assert!(link.is_symlink() && std::fs::read(&real).unwrap() == b"new");
        assert_eq!(std::fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
