//! `merge`: several built stores into one. Layers of different names stand side by side; of layers of one name the newer tiles
//! cover the older, as within a build.

mod blend;
mod error;
mod shard;
mod union;

pub use error::MergeError;

use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{AtomicFile, Extract, FileKind, Reader, file_len};
use serde::Serialize;
use shard::Shard;
use std::path::{Path, PathBuf};
use union::Union;

/// What covers where two stores have another tile at the same place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Conflict {
    /// The newer, as within a build; unknown dates are the oldest.
    #[default]
    Newest,
    /// The store that is named first.
    First,
    /// Nothing: the merge is refused.
    Refuse,
}

/// What to merge.
#[derive(Debug, Clone)]
pub struct MergeRequest {
    /// The stores.
    pub stores: Vec<PathBuf>,
    /// The file to write.
    pub out: PathBuf,
    /// What covers.
    pub conflict: Conflict,
}

/// How a layer came about.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct MergedLayer {
    /// Its name.
    pub layer: String,
    /// In how many stores it was.
    pub stores: usize,
    /// Tiles taken as they were.
    pub taken_tiles: u64,
    /// Base tiles in which one store's pixels cover another's.
    pub blended_tiles: u64,
    /// Overviews made anew.
    pub remade_overviews: u64,
}

/// What was merged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Merged {
    /// By name.
    pub layers: Vec<MergedLayer>,
    /// The new store's digest, hexadecimal.
    pub digest: String,
    /// Its file's size.
    pub bytes: u64,
}

/// Merges stores into the file `out`, which comes into being whole or not at all. `progress` is told tiles done and in all.
///
/// # Errors
/// Where a store cannot be read, is exported or unfinished, layers of one name do not fit, tiles are in conflict and that is to
/// be refused, or the disk is full.
pub fn merge(request: &MergeRequest, progress: &dyn Fn(u64, u64)) -> Result<Merged, MergeError> {
    if request.stores.len() < 2 {
        return Err(MergeError::TooFew);
    }
    let readers = request.stores.iter().map(|path| opened(path)).collect::<Result<Vec<_>, _>>()?;
    let mut names: Vec<&str> = readers.iter().flat_map(Reader::finished_layers).map(|l| l.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let unions = names
        .iter()
        .map(|name| {
            let shards = readers.iter().filter_map(|r| Shard::of(r, name).transpose()).collect::<Result<_, _>>()?;
            Union::of(name, shards, request.conflict)
        })
        .collect::<Result<Vec<_>, MergeError>>()?;
    let read: Vec<&Path> = request.stores.iter().map(PathBuf::as_path).collect();
    let file = AtomicFile::create(&request.out, FileKind::Store, &read)?;
    let extract = Extract::begin(&file.draft_path(), CONTRACT)?;
    let total = unions.iter().map(Union::jobs).sum();
    let mut done = 0;
    let mut told = || {
        done += 1;
        progress(done, total);
    };
    let layers = unions.iter().map(|union| union.write(&extract, &mut told)).collect::<Result<_, _>>()?;
    let digest = extract.digest()?;
    extract.finish(file.temporary_path(), None, 0)?;
    let bytes = file_len(file.temporary_path())?;
    file.persist()?;
    Ok(Merged { layers, digest, bytes })
}

/// A store that may be merged.
fn opened(path: &Path) -> Result<Reader, MergeError> {
    let reader = Reader::open(path)?;
    if reader.manifest().is_some() {
        return Err(MergeError::Exported { path: path.into() });
    }
    reader.require_no_pending_build()?;
    Ok(reader)
}
