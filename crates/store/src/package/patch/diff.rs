//! `diff` counts the differences between two stores; `write_patch` writes them to a patch.

use super::changes::{Change, changes};
use super::header::{PatchHeader, PatchLayer, SealedResult};
use super::patch_file;
use super::record::{InputsRecord, PatchBlob, PutTile, TileRecord, write_end};
use crate::package::PackageError;
use crate::package::sealed_file::read_seal;
use crate::{AtomicFile, FileKind, Layer, LayerHead, LayerState, Reader, StoreError, StoredTile, file_len};
use overfly_core::tile::TileId;
use serde::Serialize;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The differences of a layer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LayerDifference {
    /// Name of the layer.
    pub layer: String,
    /// Number of tiles that only the new store has.
    pub added: usize,
    /// Number of tiles whose imagery, descriptors, cells or properties differ.
    pub changed: usize,
    /// Number of tiles that only the old store has.
    pub removed: usize,
    /// Number of tiles that are equal in both stores.
    pub same: usize,
}

/// The differences between two stores.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Digest of the old store, hexadecimal.
    pub base: String,
    /// Digest of the new store, hexadecimal.
    pub result: String,
    /// The differences of each layer of either store, by name.
    pub layers: Vec<LayerDifference>,
    /// Whether the manifests differ (route, last day, signer), or only one store has a manifest.
    pub other_manifest: bool,
    /// Size of the patch, bytes, if one was written.
    pub patch_bytes: Option<u64>,
    /// Size of the new store, bytes.
    pub result_bytes: u64,
}

/// The old and the new store.
struct StorePair<'a> {
    old: &'a Reader,
    new: &'a Reader,
}

/// Counts the differences between the finished layers of two stores.
///
/// # Errors
/// Where a store cannot be read.
pub fn diff(old: &Reader, new: &Reader) -> Result<Difference, PackageError> {
    let mut names: Vec<&str> = old.finished_layers().chain(new.finished_layers()).map(|l| l.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let mut layers = Vec::new();
    for name in names {
        let (before, after) = (old.all_footprints(name)?, new.all_footprints(name)?);
        let found = changes(&before, &after);
        let count = |matches: fn(&Change) -> bool| found.iter().filter(|c| matches(c)).count();
        let (added, changed) = (count(|c| matches!(c, Change::Added(_))), count(|c| matches!(c, Change::Changed(_))));
        let (removed, same) = (found.len() - added - changed, after.len() - added - changed);
        layers.push(LayerDifference { layer: name.into(), added, changed, removed, same });
    }
    let (base, result) = (old.digest().to_owned(), new.digest().to_owned());
    let other_manifest = old.manifest() != new.manifest();
    Ok(Difference { base, result, layers, other_manifest, patch_bytes: None, result_bytes: new.bytes() })
}

/// Writes the patch from `old` to `new` to the file `out`, atomically. Calls `progress` with the numbers of tiles done and of all
/// differing tiles. Equal stores give equal bytes.
///
/// # Errors
/// Where a store cannot be read, is damaged or unfinished, or the disk is full.
pub fn write_patch(
    old: &Reader,
    new: &Reader,
    out: &Path,
    progress: &dyn Fn(u64, u64),
) -> Result<Difference, PackageError> {
    for store in [old, new] {
        store.require_no_pending_build()?;
        store.prove()?;
    }
    let file = AtomicFile::create(out, FileKind::Patch, &[old.path(), new.path()])?;
    let mut difference = diff(old, new)?;
    let path = file.temporary_path();
    let fail = |e| PackageError::io(path, e);
    let pair = StorePair { old, new };
    let header = pair.header()?;
    let mut to = BufWriter::new(File::options().write(true).open(path).map_err(fail)?);
    header.write(&mut to).map_err(fail)?;
    let total = difference.layers.iter().map(|l| (l.added + l.changed + l.removed) as u64).sum();
    let mut done = 0;
    let mut advance = || {
        done += 1;
        progress(done, total);
    };
    for layer in &header.layers {
        pair.write_tiles(&mut to, path, &layer.head.name, &mut advance)?;
        pair.write_inputs(&layer.head.name, header.sealed.is_some(), &mut to).map_err(|e| e.with_path(path))?;
    }
    to.into_inner().map_err(|e| fail(e.into_error()))?;
    patch_file::append_digest(path)?;
    difference.patch_bytes = Some(file_len(path)?);
    file.persist()?;
    Ok(difference)
}

/// A failure of a store, or of the writer of the patch.
enum WriteFailure {
    Store(StoreError),
    Io(std::io::Error),
}

impl WriteFailure {
    fn with_path(self, path: &Path) -> PackageError {
        match self {
            Self::Store(error) => error.into(),
            Self::Io(error) => PackageError::io(path, error),
        }
    }
}

impl From<StoreError> for WriteFailure {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<std::io::Error> for WriteFailure {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl StorePair<'_> {
    fn header(&self) -> Result<PatchHeader, PackageError> {
        let sealed = match (self.new.manifest(), read_seal(self.new.path())?) {
            (Some(manifest), Some((seal, _))) => Some(SealedResult::new(manifest, &seal)),
            _ => None,
        };
        let layers = self.new.finished_layers().map(|layer| self.layer(layer)).collect::<Result<_, _>>()?;
        Ok(PatchHeader {
            store_format: self.new.format_version(),
            descriptor_contract: self.new.descriptor_contract().into(),
            base: self.old.digest().into(),
            result: self.new.digest().into(),
            sealed,
            layers,
        })
    }

    fn layer(&self, layer: &Layer) -> Result<PatchLayer, StoreError> {
        let zoom_override = LayerState::read(self.new.path(), &layer.name)?.zoom_override;
        let (base_zoom, min_zoom) = (layer.base_zoom, layer.min_zoom);
        let (name, terms, terrain) = (layer.name.clone(), layer.terms.clone(), layer.terrain);
        let head = LayerHead { name, base_zoom, min_zoom, zoom_override, terms, terrain };
        let mut sources = self.new.sources(layer)?;
        sources.sort_by_key(|s| s.content_hash);
        Ok(PatchLayer { head, sources })
    }

    /// Writes the records of the tiles that differ.
    fn write_tiles(
        &self,
        to: &mut impl Write,
        path: &Path,
        layer: &str,
        advance: &mut dyn FnMut(),
    ) -> Result<(), PackageError> {
        for change in changes(&self.old.all_footprints(layer)?, &self.new.all_footprints(layer)?) {
            let record = match change {
                Change::Removed(tile) => TileRecord::Gone(tile),
                Change::Added(tile) => put(None, stored(self.new, layer, tile)?),
                Change::Changed(tile) => put(Some(&stored(self.old, layer, tile)?), stored(self.new, layer, tile)?),
            };
            record.write(to, self.new.format_version()).map_err(|e| PackageError::io(path, e))?;
            advance();
        }
        write_end(to).map_err(|e| PackageError::io(path, e))
    }

    /// Writes the inputs hashes that differ. An exported store has none.
    fn write_inputs(&self, layer: &str, sealed: bool, to: &mut impl Write) -> Result<(), WriteFailure> {
        if !sealed {
            let (old, new) = (inputs(self.old, layer)?, inputs(self.new, layer)?);
            let gone = old.keys().filter(|tile| !new.contains_key(tile)).map(|tile| InputsRecord::Gone(*tile));
            let other = new.iter().filter(|(tile, hash)| old.get(tile) != Some(hash));
            let mut records: Vec<_> = gone.chain(other.map(|(tile, hash)| InputsRecord::Put(*tile, *hash))).collect();
            records.sort_by_key(InputsRecord::tile);
            records.iter().try_for_each(|record| record.write(to))?;
        }
        Ok(write_end(to)?)
    }
}

/// Makes the record of an added or replaced tile.
fn put(old: Option<&StoredTile>, new: StoredTile) -> TileRecord {
    let image = PatchBlob::new(old.map(|t| &t.image[..]), Some(&new.image));
    let descriptors = PatchBlob::new(old.and_then(|t| t.descriptors.as_deref()), new.descriptors.as_deref());
    let cells = PatchBlob::new(old.and_then(|t| t.cells.as_deref()), new.cells.as_deref());
    TileRecord::Put(Box::new(PutTile { footprint: new.footprint, image, descriptors, cells }))
}

/// Returns a tile that has a footprint.
pub(super) fn stored(store: &Reader, layer: &str, tile: TileId) -> Result<StoredTile, StoreError> {
    let gone = || StoreError::Changed { path: store.path().into() };
    store.stored_tile(store.layer(layer)?, tile)?.ok_or_else(gone)
}

/// Returns the inputs hash of each tile of a finished layer. The result is empty if there is no such layer.
pub(super) fn inputs(store: &Reader, name: &str) -> Result<HashMap<TileId, [u8; 32]>, StoreError> {
    if store.finished_layers().all(|l| l.name != name) {
        return Ok(HashMap::new());
    }
    Ok(LayerState::read(store.path(), name)?.inputs)
}
