//! Verification of a store, exported or built: everything that can be checked, quickly, and all that is wrong.

use super::freshness::freshness;
use super::onboard::{agrees, proved_manifest};
use super::sealed_file::read_seal;
use super::{Date, PackageError, PublicKey, file_digest};
use crate::{Reader, StoreError, Verification, hex, verify};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Something wrong with a store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// A stable word.
    pub code: &'static str,
    /// For people.
    pub message: String,
}

/// What a verification found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PackageVerification {
    /// Rows, tiles and digests.
    #[serde(flatten)]
    pub store: Verification,
    /// The code word of the first thing wrong.
    pub code: Option<&'static str>,
    /// Whether it was exported: then a seal holds the digest of the whole file.
    pub sealed: bool,
    /// The digest of the whole file as it is, hexadecimal; of a sealed store.
    pub file_digest: Option<String>,
    /// The public key whose signature was proved, hexadecimal.
    pub signed_by: Option<String>,
    /// Its last day.
    pub valid_until: Option<String>,
    /// Whether every tile was read by itself: needed where the file's digest is wrong or there is none.
    pub tile_by_tile: bool,
    /// The file's size.
    pub bytes: u64,
}

/// How to verify.
#[derive(Debug, Clone, Copy)]
pub struct Verify<'a> {
    /// Who must have signed.
    pub key: Option<&'a PublicKey>,
    /// The day on which it shall be valid.
    pub today: Date,
    /// Whether every tile is read by itself even where the whole file's digest is right.
    pub every_tile: bool,
}

/// Verifies a store. Of an exported one: the whole file's digest on all cores, seal, manifest, signature, last day, every
/// footprint; where the digest is wrong, every tile by itself, so that all wrong ones are named. Of a built one: every tile by
/// itself. `progress` is told units done and in all, bytes of the file first, tiles after.
///
/// # Errors
/// Where the file cannot be opened as a store at all. What is wrong inside is in the answer.
pub fn verify_package(
    path: &Path,
    how: &Verify<'_>,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<PackageVerification, PackageError> {
    let metadata = std::fs::metadata(path).map_err(|e| PackageError::io(path, e))?;
    if !metadata.is_file() {
        return Err(StoreError::NotAStore { path: path.into(), found: "no regular file".into() }.into());
    }
    let opened = Reader::open(path);
    let whole = Whole::of(path, progress)?;
    let reader = match opened {
        Ok(reader) => reader,
        Err(error) => return whole.unopened(error),
    };
    let mut problems: Vec<PackageError> = Vec::new();
    let manifest = proved_manifest(&reader, how.key).map_err(|e| problems.push(e)).ok().flatten();
    if let Some(manifest) = &manifest {
        problems.extend(agrees(&reader, manifest).err());
        problems.extend(freshness(path, reader.layers(), Some(manifest), &[], how.today).err());
    }
    let mut told: Vec<Problem> = problems.iter().map(problem).collect();
    told.extend(whole.problem());
    let tile_by_tile = !whole.is_intact() || how.every_tile;
    let checked = if tile_by_tile { verify(path, &|a, b| progress(a, b)) } else { Ok(footprints_only(&reader, path)) };
    let mut store = match checked {
        Ok(store) => store,
        Err(error) => return whole.unopened(error),
    };
    let code = told.first().map(|p| p.code).or((!store.ok).then_some("damaged_store"));
    store.problems.splice(0..0, told.into_iter().map(|p| p.message));
    store.ok = code.is_none();
    let (signed_by, valid_until) = manifest.map_or((None, None), |m| (m.signed_by, m.valid_until));
    Ok(PackageVerification { signed_by, valid_until, tile_by_tile, ..whole.verification(store, code) })
}

/// The whole file as bytes.
struct Whole {
    bytes: u64,
    /// Of a sealed file: its digest, and whether that is what the seal states.
    digest: Option<([u8; 32], bool)>,
}

impl Whole {
    fn of(path: &Path, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Self, PackageError> {
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

    fn problem(&self) -> Option<Problem> {
        let message = "the file does not have the digest that its seal states".to_owned();
        self.digest.is_some_and(|(_, right)| !right).then_some(Problem { code: "damaged_store", message })
    }

    fn verification(&self, store: Verification, code: Option<&'static str>) -> PackageVerification {
        PackageVerification {
            store,
            code,
            sealed: self.digest.is_some(),
            file_digest: self.digest.map(|(digest, _)| hex(&digest)),
            signed_by: None,
            valid_until: None,
            tile_by_tile: false,
            bytes: self.bytes,
        }
    }

    /// A sealed file that is not what was sealed is a store that is not good; another that cannot be opened is no store.
    fn unopened(&self, error: StoreError) -> Result<PackageVerification, PackageError> {
        let Some(problem) = self.problem() else { return Err(error.into()) };
        let problems = vec![problem.message, error.to_string()];
        let store = Verification { ok: false, digest: String::new(), tiles: 0, bad_tiles: Vec::new(), problems };
        Ok(self.verification(store, Some(problem.code)))
    }
}

fn problem(error: &PackageError) -> Problem {
    Problem { code: error.code(), message: error.to_string() }
}

/// Of a store whose file is what was sealed: the footprints against their layers' digests.
fn footprints_only(reader: &Reader, path: &Path) -> Verification {
    let tiles = reader.layers().iter().map(|l| l.tiles).sum();
    let proved = Reader::open_onboard(path);
    let problems: Vec<String> = proved.err().map(|e| e.to_string()).into_iter().collect();
    let (ok, digest) = (problems.is_empty(), reader.digest().to_owned());
    Verification { ok, digest, tiles, bad_tiles: Vec::new(), problems }
}
