//! Reads and writes the seal of a file.

use super::PackageError;
use super::digest::file_digest;
use super::key::SecretKey;
use super::seal::{SEAL_LEN, Seal, position};
use crate::file_header::HEADER_LEN;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// The change counter of a file that was written once.
const EXPORTED_COUNTER: [u8; 4] = [0, 0, 0, 1];

/// Reads the seal of a file and its position: `None` if the file has no seal.
///
/// # Errors
/// Where the file cannot be read.
pub fn read_seal(path: &Path) -> Result<Option<(Seal, Range<u64>)>, PackageError> {
    let fail = |e| PackageError::io(path, e);
    let file = File::open(path).map_err(fail)?;
    let mut header = [0; HEADER_LEN];
    let mut bytes = [0; SEAL_LEN];
    let short = |e: &std::io::Error| e.kind() == std::io::ErrorKind::UnexpectedEof;
    match file.read_exact_at(&mut header, 0) {
        Err(e) if short(&e) => return Ok(None),
        other => other.map_err(fail)?,
    }
    let Some(range) = position(&header) else { return Ok(None) };
    match file.read_exact_at(&mut bytes, range.start) {
        Err(e) if short(&e) => return Ok(None),
        other => other.map_err(fail)?,
    }
    Ok(Seal::from_bytes(&bytes).map(|seal| (seal, range)))
}

/// Checks that no other program has opened a sealed file for writing: an export has the change counter 1 and a rollback journal (the
/// file format, 1.3.3 and 1.3.7), and whoever writes counts up, even where it only switches the journal mode. Content that was not
/// changed has another digest then.
///
/// # Errors
/// [`PackageError::OpenedForWriting`], or where the file cannot be read.
pub(super) fn require_unopened(path: &Path) -> Result<(), PackageError> {
    let fail = |e| PackageError::io(path, e);
    if read_seal(path)?.is_none() {
        return Ok(());
    }
    let mut header = [0; HEADER_LEN];
    File::open(path).map_err(fail)?.read_exact_at(&mut header, 0).map_err(fail)?;
    let uses_wal = header[18..20] != [1, 1];
    if !uses_wal && header[24..28] == EXPORTED_COUNTER {
        return Ok(());
    }
    Err(PackageError::OpenedForWriting { path: path.into(), uses_wal })
}

/// Seals a store that was written with [`SEAL_LEN`] reserved bytes a page and this manifest. Signs it if `key` is given.
///
/// # Errors
/// Where the file cannot be read or written.
pub fn write_seal(path: &Path, manifest: &str, key: Option<&SecretKey>) -> Result<Seal, PackageError> {
    let fail = |e| PackageError::io(path, e);
    let file = File::options().read(true).write(true).open(path).map_err(fail)?;
    let hole = hole_of(&file).map_err(fail)?;
    let digest = file_digest(path, hole.clone(), &|_| ()).map_err(fail)?;
    let mut seal = Seal { manifest: *blake3::hash(manifest.as_bytes()).as_bytes(), file: digest, signature: [0; 64] };
    if let Some(key) = key {
        seal.signature = key.sign(&seal.message());
    }
    file.write_all_at(&seal.to_bytes(), hole.start).map_err(fail)?;
    Ok(seal)
}

/// Writes an existing seal into a store that was written with [`SEAL_LEN`] reserved bytes a page.
///
/// # Errors
/// Where the file cannot be read or written.
pub(super) fn put_seal(path: &Path, seal: &Seal) -> Result<(), PackageError> {
    let fail = |e| PackageError::io(path, e);
    let file = File::options().read(true).write(true).open(path).map_err(fail)?;
    let hole = hole_of(&file).map_err(fail)?;
    file.write_all_at(&seal.to_bytes(), hole.start).map_err(fail)
}

/// Whether a file has this seal and the digest that it states.
///
/// # Errors
/// Where the file cannot be read.
pub(super) fn file_is_sealed_by(path: &Path, seal: &Seal) -> Result<bool, PackageError> {
    let Some((found, hole)) = read_seal(path)? else { return Ok(false) };
    let digest = file_digest(path, hole, &|_| ()).map_err(|e| PackageError::io(path, e))?;
    Ok(found == *seal && digest == seal.file)
}

/// Returns the position of the seal in a store that was written with space for it.
fn hole_of(file: &File) -> std::io::Result<Range<u64>> {
    let mut header = [0; HEADER_LEN];
    file.read_exact_at(&mut header, 0)?;
    position(&header).ok_or_else(|| std::io::Error::other("SQLite reserved no space for the seal"))
}
