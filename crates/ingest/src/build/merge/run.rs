//! `merge`: several built stores into one.

use super::error::MergeError;
use super::merged::Merged;
use super::request::MergeRequest;
use super::shard::Shard;
use super::union::Union;
use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{AtomicFile, Extract, FileKind, Reader, file_len};
use std::path::{Path, PathBuf};

/// Merges stores into a new file, which appears complete or not at all. `progress` is called with the number of tiles done
/// and the total.
///
/// # Errors
/// [`MergeError`] where a store cannot be read, is exported or unfinished, layers of one name do not match, tiles differ and
/// the request refuses that, or the disk is full.
pub fn merge(request: &MergeRequest, progress: &dyn Fn(u64, u64)) -> Result<Merged, MergeError> {
    if request.stores.len() < 2 {
        return Err(MergeError::TooFew);
    }
    let readers = request.stores.iter().map(|path| open_built_store(path)).collect::<Result<Vec<_>, _>>()?;
    let mut names: Vec<&str> = readers.iter().flat_map(Reader::finished_layers).map(|l| l.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let unions = names
        .iter()
        .map(|name| {
            let shards = readers.iter().filter_map(|r| Shard::open(r, name).transpose()).collect::<Result<_, _>>()?;
            Union::new(name, shards, request.conflict)
        })
        .collect::<Result<Vec<_>, MergeError>>()?;
    let read: Vec<&Path> = request.stores.iter().map(PathBuf::as_path).collect();
    let file = AtomicFile::create(&request.out, FileKind::Map, &read)?;
    let extract = Extract::begin(&file.draft_path(), CONTRACT)?;
    let total = unions.iter().map(Union::jobs).sum();
    let mut done = 0;
    let mut advance = || {
        done += 1;
        progress(done, total);
    };
    let layers = unions.iter().map(|union| union.write(&extract, &mut advance)).collect::<Result<_, _>>()?;
    let digest = extract.digest()?;
    extract.finish(file.temporary_path(), None, 0)?;
    let bytes = file_len(file.temporary_path())?;
    file.persist()?;
    Ok(Merged { layers, digest, bytes })
}

/// Opens a store and checks that it can be merged.
fn open_built_store(path: &Path) -> Result<Reader, MergeError> {
    let reader = Reader::open_proved(path)?;
    if reader.manifest().is_some() {
        return Err(MergeError::Exported { path: path.into() });
    }
    reader.require_no_pending_build()?;
    Ok(reader)
}
