//! The file of a patch: header, records, and the BLAKE3 hash of the whole file with these last 32 bytes as zeros.

use super::header::PatchHeader;
use super::record::{MalformedPatch, Records};
use crate::package::{PackageError, file_digest};
use std::fs::File;
use std::io::{BufReader, Read, Take};
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

const DIGEST_LEN: u64 = 32;

/// The records after the header of a patch.
pub type FileRecords = Records<Take<BufReader<File>>>;

/// Appends its digest to a patch.
///
/// # Errors
/// Where the file cannot be read or written.
pub fn append_digest(path: &Path) -> Result<(), PackageError> {
    let ended = || -> std::io::Result<()> {
        let file = File::options().read(true).write(true).open(path)?;
        let len = file.metadata()?.len();
        file.set_len(len + DIGEST_LEN)?;
        file.write_all_at(&file_digest(path, len..len + DIGEST_LEN, &|_| ())?, len)
    };
    ended().map_err(|e| PackageError::io(path, e))
}

/// Opens a patch and proves the digest of the whole file.
///
/// # Errors
/// [`PackageError::NotAPatch`], [`PackageError::AlteredPatch`], or where the file cannot be read.
pub fn open(path: &Path) -> Result<(PatchHeader, FileRecords), PackageError> {
    let fail = |e| PackageError::io(path, e);
    let refuse = |reason: &str| PackageError::NotAPatch { path: path.into(), reason: reason.into() };
    let metadata = std::fs::metadata(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => refuse("no such file"),
        _ => fail(e),
    })?;
    if !metadata.is_file() {
        return Err(refuse("not a regular file"));
    }
    let file = File::open(path).map_err(fail)?;
    let content = metadata.len().saturating_sub(DIGEST_LEN);
    let mut from = BufReader::new(file).take(content);
    let header = PatchHeader::read(&mut from).map_err(|e| malformed_error(path, e))?;
    if !is_whole(path, content..metadata.len()).map_err(fail)? {
        return Err(PackageError::AlteredPatch { path: path.into() });
    }
    let records = Records::new(from, header.store_format);
    Ok((header, records))
}

/// Whether a patch has the digest that it states.
fn is_whole(path: &Path, digest: Range<u64>) -> std::io::Result<bool> {
    let mut stated = [0; DIGEST_LEN as usize];
    File::open(path)?.read_exact_at(&mut stated, digest.start)?;
    Ok(file_digest(path, digest, &|_| ())? == stated)
}

/// Adds the path to what is wrong with a patch.
pub fn malformed_error(path: &Path, error: MalformedPatch) -> PackageError {
    match error {
        MalformedPatch::Content(reason) => PackageError::NotAPatch { path: path.into(), reason },
        MalformedPatch::Io(cause) => PackageError::io(path, cause),
    }
}
