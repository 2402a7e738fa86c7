//! `apply`: makes the new store from the old store and a patch, proves it, and replaces the target atomically.

use super::diff::{inputs, stored};
use super::header::{PatchHeader, PatchLayer};
use super::patch_file::{self, FileRecords, malformed_error};
use super::record::{InputsRecord, MalformedPatch, PatchBlob, PutTile, TileRecord};
use crate::package::onboard::{check_layers, prove_manifest};
use crate::package::sealed_file::{file_is_sealed_by, put_seal, read_seal};
use crate::package::serial::{require_serial, serial_of};
use crate::package::{Manifest, PackageError, PublicKey, SEAL_LEN, Seal};
use crate::{
    AtomicFile, Extract, FORMAT_VERSION, FileKind, OLDEST_READABLE, Reader, StoreError, StoredTile, content_hash,
    file_len, media_type,
};
use jiff::civil::Date;
use serde::Serialize;
use std::path::Path;

/// The parameters of [`apply`].
#[derive(Debug, Clone, Copy)]
pub struct ApplyRequest<'a> {
    /// The old store.
    pub store: &'a Path,
    /// The patch.
    pub patch: &'a Path,
    /// The target: it may be the old store.
    pub out: &'a Path,
    /// The key with which the new store must be signed, if any.
    pub key: Option<&'a PublicKey>,
    /// The day on which the new store must be valid.
    pub today: Date,
    /// Whether a store of a lower serial than the old one's may replace it.
    pub allow_older: bool,
}

/// The result of [`apply`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Applied {
    /// Whether the target changed: false if the old store was already the new one.
    pub changed: bool,
    /// Digest of the new store, hexadecimal.
    pub digest: String,
    /// Number of tiles from the old store.
    pub kept_tiles: u64,
    /// Number of tiles from the patch.
    pub patched_tiles: u64,
    /// Size of the new store, bytes.
    pub bytes: u64,
    /// The public key of the verified signature, hexadecimal.
    pub signed_by: Option<String>,
    /// The serial of the new store, if it is an export that states one.
    pub serial: Option<u64>,
}

/// Applies a patch. The new store is written beside `out`, proved by the digests that the patch states (for an exported store, also
/// by the digest of the whole file and the signature), and renamed. So `out` is always the old file or the new store. Calls
/// `progress` with the number of tiles done, and roughly the number of all tiles.
///
/// # Errors
/// [`PackageError::NotAPatch`], [`PackageError::AlteredPatch`], [`PackageError::WrongBase`], [`PackageError::OtherResult`];
/// signature and manifest as [`crate::package::open_onboard`]; [`PackageError::OlderSerial`]; a damaged tile of the old store; a full
/// disk.
pub fn apply(request: &ApplyRequest<'_>, progress: &dyn Fn(u64, u64)) -> Result<Applied, PackageError> {
    // The new store is about as large as the old one, and is written twice: as a draft, and compact.
    let needed = std::fs::metadata(request.store).map_or(0, |m| 2 * m.len());
    make(request, progress).map_err(|error| match error {
        PackageError::Store(error) => error.needing(needed).into(),
        other => other,
    })
}

fn make(request: &ApplyRequest<'_>, progress: &dyn Fn(u64, u64)) -> Result<Applied, PackageError> {
    let (header, records) = patch_file::open(request.patch)?;
    let sealed = stated_seal(&header, request)?;
    let signed_by = sealed.as_ref().and_then(|(manifest, _)| manifest.signed_by.clone());
    let serial = sealed.as_ref().and_then(|(manifest, _)| manifest.serial);
    let base = Reader::open(request.store)?;
    let seal = sealed.as_ref().map(|(_, seal)| seal);
    require_same_kind(&base, seal.is_some(), request)?;
    if request.store == request.out && is_result(&base, &header, seal)? {
        let (digest, bytes) = (header.result, base.bytes());
        return Ok(Applied {
            changed: false,
            digest,
            kept_tiles: base_tiles(&base),
            patched_tiles: 0,
            bytes,
            signed_by,
            serial,
        });
    }
    check_base(&base, &header, request.store)?;
    require_same_signer(&base, signed_by.as_deref(), request)?;
    if !request.allow_older {
        let manifest = sealed.as_ref().map(|(manifest, _)| manifest);
        require_serial(request.patch, manifest, serial_of(base.manifest()))?;
    }
    let file = result_file(request, seal.is_some())?;
    let extract = Extract::begin_version(&file.draft_path(), base.descriptor_contract(), header.store_format)?;
    let mut writer = ResultWriter { base: &base, extract: &extract, request, progress, kept: 0, patched: 0 };
    writer.layers(&header, records)?;
    let (kept_tiles, patched_tiles) = (writer.kept, writer.patched);
    if extract.digest()? != header.result {
        return Err(other_result(request, "its layers do not have the digest that the patch states"));
    }
    write(extract, &file, &header, seal, request)?;
    if let Some((manifest, _)) = &sealed {
        check_layers(&Reader::open(file.temporary_path())?, manifest)?;
    }
    let bytes = file_len(file.temporary_path())?;
    base.check_unchanged()?;
    drop(base);
    file.persist()?;
    Ok(Applied { changed: true, digest: header.result, kept_tiles, patched_tiles, bytes, signed_by, serial })
}

/// Returns manifest and seal of an exported result, proved by the signature.
fn stated_seal(header: &PatchHeader, request: &ApplyRequest<'_>) -> Result<Option<(Manifest, Seal)>, PackageError> {
    match &header.sealed {
        None if request.key.is_some() => Err(PackageError::Unsigned { path: request.patch.into() }),
        None => Ok(None),
        Some(sealed) => {
            let seal = sealed.seal().ok_or_else(|| malformed(request, "its seal is not valid"))?;
            let manifest = prove_manifest(request.patch, &sealed.manifest, &seal, request.key)?;
            if let Some(valid_until) = manifest.valid_until().filter(|last| *last < request.today) {
                return Err(PackageError::Expired { path: request.patch.into(), valid_until, today: request.today });
            }
            Ok(Some((manifest, seal)))
        }
    }
}

/// Creates the file of the result.
fn result_file(request: &ApplyRequest<'_>, is_export: bool) -> Result<AtomicFile, StoreError> {
    if request.store == request.out {
        return AtomicFile::create_in_place(request.out, &[request.patch]);
    }
    let kind = if is_export { FileKind::Export } else { FileKind::Map };
    AtomicFile::create(request.out, kind, &[request.patch, request.store])
}

/// Checks that, in place, an export stays an export and a map a map: a sealed map could not be built any more.
fn require_same_kind(base: &Reader, makes_export: bool, request: &ApplyRequest<'_>) -> Result<(), PackageError> {
    let (found, made) = match (base.manifest().is_some(), makes_export) {
        (false, true) => ("it is a map", "an export"),
        (true, false) => ("it is an export", "a map"),
        _ => return Ok(()),
    };
    if request.store == request.out {
        Err(PackageError::OtherKind { path: request.store.into(), found, made })
    } else {
        Ok(())
    }
}

/// Whether a store is already the result of the patch: for an exported store, byte for byte.
///
/// # Errors
/// Where the store states the digest of the result, but does not match it.
fn is_result(store: &Reader, header: &PatchHeader, seal: Option<&Seal>) -> Result<bool, PackageError> {
    let path = store.path();
    if store.digest() != header.result || header.result == header.base {
        return Ok(store.digest() == header.result && seal.is_some_and(|s| file_is_sealed_by(path, s).unwrap_or(false)));
    }
    match (seal, read_seal(path)?.map(|(seal, _)| seal)) {
        (None, None) => Ok(true),
        (Some(stated), Some(found)) if *stated == found => {
            let reason =
                "it is the result of the patch, but the file does not have the digest that its seal states".into();
            let damaged = || StoreError::Damaged { path: path.into(), reason };
            if file_is_sealed_by(path, stated)? { Ok(true) } else { Err(damaged().into()) }
        }
        _ => {
            let reason = "it has the content of the result, but another seal".into();
            Err(PackageError::AlteredSeal { path: path.into(), reason })
        }
    }
}

/// Number of tiles of a store.
fn base_tiles(store: &Reader) -> u64 {
    store.finished_layers().map(|l| l.tiles).sum()
}

/// Whether this program can read and make stores of a format version.
fn readable(version: u32) -> bool {
    (OLDEST_READABLE..=FORMAT_VERSION).contains(&version)
}

/// Checks that the patch is for this store. The old store may have another readable format than the new one.
fn check_base(base: &Reader, header: &PatchHeader, store: &Path) -> Result<(), PackageError> {
    if base.digest() != header.base {
        let (found, expected) = (base.digest().to_owned(), header.base.clone());
        return Err(PackageError::WrongBase { path: store.into(), found, expected });
    }
    if !readable(header.store_format) || base.descriptor_contract() != header.descriptor_contract {
        let reason = "the patch was made by another version of overfly".into();
        return Err(PackageError::OtherResult { path: store.into(), reason });
    }
    Ok(base.require_no_pending_build()?)
}

/// Checks the signer: a signed store can be replaced only by one with the same signer, unless `key` names another.
fn require_same_signer(base: &Reader, signed_by: Option<&str>, request: &ApplyRequest<'_>) -> Result<(), PackageError> {
    let before = base.manifest().and_then(|text| Manifest::from_text(text).ok()).and_then(|m| m.signed_by);
    let path = || request.patch.into();
    match (before, signed_by) {
        _ if request.key.is_some() || request.store != request.out => Ok(()),
        (Some(required), Some(found)) if required != found => {
            Err(PackageError::WrongKey { path: path(), found: found.into(), required })
        }
        (Some(_), None) => Err(PackageError::Unsigned { path: path() }),
        _ => Ok(()),
    }
}

/// Writes the new store to the temporary file: an exported store byte for byte.
fn write(
    extract: Extract,
    file: &AtomicFile,
    header: &PatchHeader,
    seal: Option<&Seal>,
    request: &ApplyRequest<'_>,
) -> Result<(), PackageError> {
    let manifest = header.sealed.as_ref().map(|sealed| sealed.manifest.as_str());
    extract.finish(file.temporary_path(), manifest, if seal.is_some() { SEAL_LEN as u8 } else { 0 })?;
    let Some(seal) = seal else { return Ok(()) };
    put_seal(file.temporary_path(), seal)?;
    if file_is_sealed_by(file.temporary_path(), seal)? {
        return Ok(());
    }
    Err(other_result(
        request,
        "its bytes do not have the digest that the seal states: another version of overfly wrote the store",
    ))
}

fn malformed(request: &ApplyRequest<'_>, reason: &str) -> PackageError {
    malformed_error(request.patch, MalformedPatch::Content(reason.into()))
}

fn other_result(request: &ApplyRequest<'_>, reason: &str) -> PackageError {
    PackageError::OtherResult { path: request.store.into(), reason: reason.into() }
}

/// The new store while it is written.
struct ResultWriter<'a> {
    base: &'a Reader,
    extract: &'a Extract,
    request: &'a ApplyRequest<'a>,
    progress: &'a dyn Fn(u64, u64),
    kept: u64,
    patched: u64,
}

impl ResultWriter<'_> {
    fn layers(&mut self, header: &PatchHeader, mut records: FileRecords) -> Result<(), PackageError> {
        for layer in &header.layers {
            self.layer(layer, &mut records, header.sealed.is_some())?;
        }
        let at_end = records.is_at_end().map_err(|e| malformed_error(self.request.patch, e))?;
        if at_end { Ok(()) } else { Err(malformed(self.request, "it continues after its last record")) }
    }

    fn layer(&mut self, layer: &PatchLayer, records: &mut FileRecords, sealed: bool) -> Result<(), PackageError> {
        self.extract.begin_layer(&layer.head)?;
        self.tiles(&layer.head.name, records)?;
        self.inputs(&layer.head.name, records, sealed)?;
        Ok(self.extract.end_layer(&layer.head, layer.sources.clone())?)
    }

    /// Writes the tiles of the old store and of the patch, in order.
    fn tiles(&mut self, name: &str, records: &mut FileRecords) -> Result<(), PackageError> {
        let mut old = self.base.all_footprints(name)?.into_iter().map(|f| f.tile).peekable();
        loop {
            let record = records.tile().map_err(|e| malformed_error(self.request.patch, e))?;
            let next = record.as_ref().map(TileRecord::tile);
            while let Some(tile) = old.next_if(|tile| next.is_none_or(|next| *tile < next)) {
                self.extract.put(name, &stored(self.base, name, tile)?)?;
                self.kept += 1;
                self.advance();
            }
            let Some(record) = record else { return Ok(()) };
            let replaced = old.next_if(|tile| Some(*tile) == next);
            match record {
                TileRecord::Gone(_) if replaced.is_some() => {}
                TileRecord::Gone(tile) => {
                    return Err(malformed(self.request, &format!("tile {tile} is to be removed, but does not exist")));
                }
                TileRecord::Put(put) => {
                    let base = replaced.map(|tile| stored(self.base, name, tile)).transpose()?;
                    self.extract.put(name, &self.result_tile(*put, base)?)?;
                    self.patched += 1;
                    self.advance();
                }
            }
        }
    }

    /// Returns an added or replaced tile, proved by its content hash.
    fn result_tile(&self, put: PutTile, base: Option<StoredTile>) -> Result<StoredTile, PackageError> {
        let tile = put.footprint.tile;
        let wrong = |what: &str| malformed(self.request, &format!("tile {tile} {what}"));
        let (image, descriptors, cells) =
            base.map_or((None, None, None), |base| (Some(base.image), base.descriptors, base.cells));
        let blob = |part: PatchBlob, base: Option<Vec<u8>>| match part {
            PatchBlob::Absent => Ok(None),
            PatchBlob::Given(bytes) => Ok(Some(bytes)),
            PatchBlob::AsInBase => {
                base.map(Some).ok_or_else(|| wrong("takes a blob from the old store that does not exist"))
            }
        };
        let image = blob(put.image, image)?.ok_or_else(|| wrong("has no imagery"))?;
        let (descriptors, cells) = (blob(put.descriptors, descriptors)?, blob(put.cells, cells)?);
        let media_type = media_type(&image).ok_or_else(|| wrong("is neither JPEG nor PNG"))?;
        let described = descriptors.as_deref().unwrap_or_default();
        if content_hash(media_type, &image, described, cells.as_deref()) != put.footprint.content_hash {
            return Err(wrong("does not have the stated hash"));
        }
        Ok(StoredTile { footprint: put.footprint, media_type, image, descriptors, cells })
    }

    /// Writes the inputs hashes of the old store and of the patch.
    fn inputs(&self, name: &str, records: &mut FileRecords, sealed: bool) -> Result<(), PackageError> {
        let mut hashes = if sealed { Default::default() } else { inputs(self.base, name)? };
        while let Some(record) = records.inputs().map_err(|e| malformed_error(self.request.patch, e))? {
            match record {
                InputsRecord::Gone(tile) => drop(hashes.remove(&tile)),
                InputsRecord::Put(tile, hash) => drop(hashes.insert(tile, hash)),
            }
        }
        for (tile, hash) in &hashes {
            self.extract.put_inputs(name, *tile, hash)?;
        }
        Ok(())
    }

    fn advance(&self) {
        let done = self.kept + self.patched;
        (self.progress)(done, done.max(base_tiles(self.base)));
    }
}
