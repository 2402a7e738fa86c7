//! Verification of an exported or built store. The result lists every problem.

use super::freshness::check_freshness;
use super::onboard::{check_layers, proved_manifest};
use super::sealed_file::{read_seal, require_unopened};
use super::{Manifest, PackageError, PublicKey, file_digest};
use crate::whole_file::require_whole;
use crate::{Layer, Reader, StoreError, StoreRemedy, Verification, hex, verify};
use jiff::civil::Date;
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// A problem of a store.
#[derive(Debug, Clone)]
struct FoundProblem {
    /// A stable code word.
    code: &'static str,
    /// The problem as text.
    message: String,
    /// What helps.
    remedy: Option<StoreRemedy>,
}

/// The result of a verification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PackageVerification {
    /// The result for rows, tiles and digests.
    #[serde(flatten)]
    pub store: Verification,
    /// The code word of the first problem.
    pub code: Option<&'static str>,
    /// What helps against the first problem.
    #[serde(skip)]
    pub remedy: Option<StoreRemedy>,
    /// Whether the store is sealed, which means that it was exported.
    pub sealed: bool,
    /// The computed digest of the whole file, hexadecimal, for a sealed store.
    pub file_digest: Option<String>,
    /// The public key of the verified signature, hexadecimal.
    pub signed_by: Option<String>,
    /// The last day on which the store may be flown.
    pub valid_until: Option<String>,
    /// Whether every tile was read. This is needed if the digest of the file is wrong or there is none.
    pub tile_by_tile: bool,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// The proved manifest, if the store was exported.
    #[serde(skip)]
    pub manifest: Option<Manifest>,
    /// The layers of the store.
    #[serde(skip)]
    pub layers: Vec<Layer>,
}

/// Options of a verification.
#[derive(Debug, Clone, Copy)]
pub struct VerifyOptions<'a> {
    /// The key with which the store must be signed, if any.
    pub key: Option<&'a PublicKey>,
    /// The day on which the store must be valid.
    pub today: Date,
    /// Whether to read every tile even if the digest of the whole file is right.
    pub every_tile: bool,
}

/// Verifies a store. For an exported store: the digest of the whole file on all cores, seal, manifest, signature, last day and
/// every footprint; if the digest is wrong, every tile, so that the result names all bad ones. For a built store: every tile.
/// Calls `progress` with units done and all units: first bytes of the file, then tiles.
///
/// # Errors
/// Where the file cannot be opened as a store. Problems inside the store are in the result.
pub fn verify_package(
    path: &Path,
    options: &VerifyOptions<'_>,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<PackageVerification, PackageError> {
    let metadata = std::fs::metadata(path).map_err(|e| PackageError::io(path, e))?;
    if !metadata.is_file() {
        let found = if metadata.is_dir() { "a folder" } else { "not a regular file" };
        return Err(StoreError::NotAStore { path: path.into(), found: found.into() }.into());
    }
    if let Err(error) = require_whole(path) {
        return Ok(cut_off(&error, metadata.len()));
    }
    let reopened = require_unopened(path).err();
    // An immutable connection leaves no side files beside a file in WAL mode.
    let opened = if reopened.is_some() { Reader::open_onboard(path) } else { Reader::open(path) };
    let whole = WholeFile::read(path, progress)?;
    let reader = match opened {
        Ok(reader) => reader,
        Err(error) => return whole.unopened(error),
    };
    let is_reopened = reopened.is_some();
    let mut problems: Vec<PackageError> = Vec::new();
    let manifest = proved_manifest(&reader, options.key).map_err(|e| problems.push(e)).ok().flatten();
    if let Some(manifest) = &manifest {
        problems.extend(check_layers(&reader, manifest).err());
        problems.extend(check_freshness(path, reader.layers(), Some(manifest), &[], options.today).err());
    }
    problems.extend(reopened);
    let mut found: Vec<FoundProblem> = problems.iter().map(problem).collect();
    found.extend(whole.problem());
    let tile_by_tile = !is_reopened && (!whole.is_intact() || options.every_tile);
    let checked = if tile_by_tile { verify(path, &|a, b| progress(a, b)) } else { Ok(footprints_only(&reader, path)) };
    let mut store = match checked {
        Ok(store) => store,
        Err(error) => return whole.unopened(error),
    };
    let damaged = (!store.ok).then_some(("damaged_store", Some(StoreRemedy::RestoreOrRebuild)));
    let first = found.first().map(|p| (p.code, p.remedy)).or(damaged);
    store.problems.splice(0..0, found.into_iter().map(|p| p.message));
    store.ok = first.is_none();
    let (signed_by, valid_until) =
        manifest.as_ref().map_or((None, None), |m| (m.signed_by.clone(), m.valid_until.clone()));
    let layers = reader.layers().to_vec();
    Ok(PackageVerification {
        signed_by,
        valid_until,
        tile_by_tile,
        manifest,
        layers,
        ..whole.verification(store, first)
    })
}

/// The bytes of the whole file.
struct WholeFile {
    bytes: u64,
    /// Of a sealed file: its digest, and whether the seal states it.
    digest: Option<([u8; 32], bool)>,
}

impl WholeFile {
    fn read(path: &Path, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Self, PackageError> {
        let fail = |e| PackageError::io(path, e);
        let bytes = std::fs::metadata(path).map_err(fail)?.len();
        let Some((seal, hole)) = read_seal(path)? else { return Ok(Self { bytes, digest: None }) };
        let done = AtomicU64::new(0);
        let tell = |n: u64| progress(done.fetch_add(n, Ordering::Relaxed) + n, bytes);
        let found = file_digest(path, hole, &tell).map_err(fail)?;
        Ok(Self { bytes, digest: Some((found, found == seal.file)) })
    }

    fn is_intact(&self) -> bool {
        self.digest.is_some_and(|(_, right)| right)
    }

    fn problem(&self) -> Option<FoundProblem> {
        let message = "the file does not have the digest that its seal states".to_owned();
        self.digest.is_some_and(|(_, right)| !right).then_some(FoundProblem {
            code: "damaged_store",
            message,
            remedy: Some(StoreRemedy::RestoreOrExportAgain),
        })
    }

    fn verification(
        &self,
        store: Verification,
        first: Option<(&'static str, Option<StoreRemedy>)>,
    ) -> PackageVerification {
        PackageVerification {
            store,
            code: first.map(|(code, _)| code),
            remedy: first.and_then(|(_, remedy)| remedy),
            sealed: self.digest.is_some(),
            file_digest: self.digest.map(|(digest, _)| hex(&digest)),
            signed_by: None,
            valid_until: None,
            tile_by_tile: false,
            bytes: self.bytes,
            manifest: None,
            layers: Vec::new(),
        }
    }

    /// A sealed file that cannot be opened is a bad store if its digest is wrong. Any other file that cannot be opened is not a store.
    fn unopened(&self, error: StoreError) -> Result<PackageVerification, PackageError> {
        let Some(problem) = self.problem() else { return Err(error.into()) };
        let problems = vec![problem.message, error.to_string()];
        let store = Verification { ok: false, digest: String::new(), tiles: 0, bad_tiles: Vec::new(), problems };
        Ok(self.verification(store, Some((problem.code, problem.remedy))))
    }
}

/// The verification of half a copy: nothing else is worth saying about it.
fn cut_off(error: &StoreError, bytes: u64) -> PackageVerification {
    let problems = vec![error.to_string()];
    let store = Verification { ok: false, digest: String::new(), tiles: 0, bad_tiles: Vec::new(), problems };
    WholeFile { bytes, digest: None }.verification(store, Some((error.code(), error.remedy())))
}

fn problem(error: &PackageError) -> FoundProblem {
    FoundProblem { code: error.code(), message: error.to_string(), remedy: error.remedy() }
}

/// Verifies the footprints by the digests of their layers. That is enough if the digest of the whole file is right.
fn footprints_only(reader: &Reader, path: &Path) -> Verification {
    let tiles = reader.layers().iter().map(|l| l.tiles).sum();
    let proved = Reader::open_onboard(path);
    let problems: Vec<String> = proved.err().map(|e| e.to_string()).into_iter().collect();
    let (ok, digest) = (problems.is_empty(), reader.digest().to_owned());
    Verification { ok, digest, tiles, bad_tiles: Vec::new(), problems }
}
