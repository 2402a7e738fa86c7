//! `apply`: makes the new store of the old one and a patch, beside its place, proves it, and puts it there.

use super::diff::{inputs, stored};
use super::header::{PatchHeader, PatchLayer};
use super::patch_file::{self, FileRecords, refused};
use super::record::{InputsRecord, Malformed, Part, PutTile, TileRecord};
use crate::package::onboard::{agrees, prove};
use crate::package::sealed_file::{file_is_sealed_by, put_seal, read_seal};
use crate::package::{Date, Manifest, PackageError, PublicKey, SEAL_LEN, Seal};
use crate::{Extract, Kind, Outlet, Reader, StoreError, StoredTile, content_hash, media_type, size_of};
use serde::Serialize;
use std::path::Path;

/// What to apply to what.
#[derive(Debug, Clone, Copy)]
pub struct ApplyRequest<'a> {
    /// The old store.
    pub store: &'a Path,
    /// The patch.
    pub patch: &'a Path,
    /// Where the new store goes; the old one's place is allowed.
    pub out: &'a Path,
    /// Who must have signed the new store.
    pub key: Option<&'a PublicKey>,
    /// The day on which the new store shall be valid.
    pub today: Date,
}

/// What was done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Applied {
    /// Whether anything was: false where the store was the new one already.
    pub changed: bool,
    /// The new store's digest, hexadecimal.
    pub digest: String,
    /// Tiles taken from the old store.
    pub kept_tiles: u64,
    /// Tiles of the patch.
    pub patched_tiles: u64,
    /// The new file's size.
    pub bytes: u64,
    /// Whose signature it bears, proved: the public key, hexadecimal.
    pub signed_by: Option<String>,
}

/// Applies a patch. The new store is written beside `out`, held against the digests that the patch states (of an exported store
/// that of the whole file, and its signature), and renamed into place: whatever happens, `out` is what it was or the new store.
/// `progress` is told tiles done and in all, about.
///
/// # Errors
/// [`PackageError::NotAPatch`], [`PackageError::AlteredPatch`], [`PackageError::WrongBase`], [`PackageError::OtherResult`];
/// signature and manifest as [`super::super::open_onboard`]; a damaged tile of the old store; a full disk.
pub fn apply(request: &ApplyRequest<'_>, progress: &dyn Fn(u64, u64)) -> Result<Applied, PackageError> {
    let (header, records) = patch_file::open(request.patch)?;
    let sealed = stated_seal(&header, request)?;
    let signed_by = sealed.as_ref().and_then(|(manifest, _)| manifest.signed_by.clone());
    let base = Reader::open(request.store)?;
    let seal = sealed.as_ref().map(|(_, seal)| seal);
    if request.store == request.out && is_result(&base, &header, seal)? {
        let (digest, bytes) = (header.result, base.bytes());
        return Ok(Applied {
            changed: false,
            digest,
            kept_tiles: base_tiles(&base),
            patched_tiles: 0,
            bytes,
            signed_by,
        });
    }
    check_base(&base, &header, request.store)?;
    keep_signer(&base, signed_by.as_deref(), request)?;
    let read = if request.store == request.out { &[request.patch][..] } else { &[request.patch, request.store] };
    let outlet = Outlet::at(request.out, Kind::Store, read)?;
    let extract = Extract::begin(&outlet.draft(), base.descriptor_contract())?;
    let mut making = Making { base: &base, extract: &extract, request, progress, kept: 0, patched: 0 };
    making.layers(&header, records)?;
    let (kept_tiles, patched_tiles) = (making.kept, making.patched);
    if extract.digest()? != header.result {
        return Err(other_result(request, "its layers do not have the digest that the patch states"));
    }
    write(extract, &outlet, &header, seal, request)?;
    if let Some((manifest, _)) = &sealed {
        agrees(&Reader::open(outlet.beside())?, manifest)?;
    }
    let bytes = size_of(outlet.beside())?;
    base.check_unchanged()?;
    drop(base);
    outlet.publish()?;
    Ok(Applied { changed: true, digest: header.result, kept_tiles, patched_tiles, bytes, signed_by })
}

/// Manifest and seal of an exported result, its signature proved.
fn stated_seal(header: &PatchHeader, request: &ApplyRequest<'_>) -> Result<Option<(Manifest, Seal)>, PackageError> {
    match &header.sealed {
        None if request.key.is_some() => Err(PackageError::Unsigned { path: request.patch.into() }),
        None => Ok(None),
        Some(sealed) => {
            let seal = sealed.seal().ok_or_else(|| malformed(request, "its seal is none"))?;
            let manifest = prove(request.patch, &sealed.manifest, &seal, request.key)?;
            if let Some(valid_until) = manifest.valid_until().filter(|last| *last < request.today) {
                return Err(PackageError::Expired { path: request.patch.into(), valid_until, today: request.today });
            }
            Ok(Some((manifest, seal)))
        }
    }
}

/// Whether a store is what the patch makes already: of an exported one every byte.
///
/// # Errors
/// Where it states that it is, and is not.
fn is_result(store: &Reader, header: &PatchHeader, seal: Option<&Seal>) -> Result<bool, PackageError> {
    let path = store.path();
    if store.digest() != header.result || header.result == header.base {
        return Ok(store.digest() == header.result && seal.is_some_and(|s| file_is_sealed_by(path, s).unwrap_or(false)));
    }
    match (seal, read_seal(path)?.map(|(seal, _)| seal)) {
        (None, None) => Ok(true),
        (Some(stated), Some(found)) if *stated == found => {
            let reason = "it is what the patch makes, and not all of it has the digest that its seal states".into();
            let damaged = || StoreError::Damaged { path: path.into(), reason };
            if file_is_sealed_by(path, stated)? { Ok(true) } else { Err(damaged().into()) }
        }
        _ => {
            let reason = "it holds what the patch makes, and its seal is another".into();
            Err(PackageError::AlteredSeal { path: path.into(), reason })
        }
    }
}

fn base_tiles(store: &Reader) -> u64 {
    store.finished_layers().map(|l| l.tiles).sum()
}

fn check_base(base: &Reader, header: &PatchHeader, store: &Path) -> Result<(), PackageError> {
    if base.digest() != header.base {
        let (found, expected) = (base.digest().to_owned(), header.base.clone());
        return Err(PackageError::WrongBase { path: store.into(), found, expected });
    }
    if base.format_version() != header.store_format || base.descriptor_contract() != header.descriptor_contract {
        let reason = "the patch is of another version of overfly".into();
        return Err(PackageError::OtherResult { path: store.into(), reason });
    }
    Ok(base.require_settled()?)
}

/// What somebody signed is replaced by what the same one signed alone, unless a key says whose it shall be.
fn keep_signer(base: &Reader, signed_by: Option<&str>, request: &ApplyRequest<'_>) -> Result<(), PackageError> {
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

/// Writes the new store beside its place; an exported one byte for byte.
fn write(
    extract: Extract,
    outlet: &Outlet,
    header: &PatchHeader,
    seal: Option<&Seal>,
    request: &ApplyRequest<'_>,
) -> Result<(), PackageError> {
    let manifest = header.sealed.as_ref().map(|sealed| sealed.manifest.as_str());
    extract.finish(outlet.beside(), manifest, if seal.is_some() { SEAL_LEN as u8 } else { 0 })?;
    let Some(seal) = seal else { return Ok(()) };
    put_seal(outlet.beside(), seal)?;
    if file_is_sealed_by(outlet.beside(), seal)? {
        return Ok(());
    }
    Err(other_result(
        request,
        "its bytes do not have the digest that the seal states: another version of overfly wrote the store",
    ))
}

fn malformed(request: &ApplyRequest<'_>, reason: &str) -> PackageError {
    refused(request.patch, Malformed::Content(reason.into()))
}

fn other_result(request: &ApplyRequest<'_>, reason: &str) -> PackageError {
    PackageError::OtherResult { path: request.store.into(), reason: reason.into() }
}

/// A new store being made.
struct Making<'a> {
    base: &'a Reader,
    extract: &'a Extract,
    request: &'a ApplyRequest<'a>,
    progress: &'a dyn Fn(u64, u64),
    kept: u64,
    patched: u64,
}

impl Making<'_> {
    fn layers(&mut self, header: &PatchHeader, mut records: FileRecords) -> Result<(), PackageError> {
        for layer in &header.layers {
            self.layer(layer, &mut records, header.sealed.is_some())?;
        }
        let at_end = records.is_at_end().map_err(|e| refused(self.request.patch, e))?;
        if at_end { Ok(()) } else { Err(malformed(self.request, "it goes on behind its last record")) }
    }

    fn layer(&mut self, layer: &PatchLayer, records: &mut FileRecords, sealed: bool) -> Result<(), PackageError> {
        self.extract.begin_layer(&layer.head)?;
        self.tiles(&layer.head.name, records)?;
        self.inputs(&layer.head.name, records, sealed)?;
        Ok(self.extract.end_layer(&layer.head, layer.sources.clone())?)
    }

    /// The base's tiles and the patch's, in order.
    fn tiles(&mut self, name: &str, records: &mut FileRecords) -> Result<(), PackageError> {
        let mut old = self.base.all_footprints(name)?.into_iter().map(|f| f.tile).peekable();
        loop {
            let record = records.tile().map_err(|e| refused(self.request.patch, e))?;
            let next = record.as_ref().map(TileRecord::tile);
            while let Some(tile) = old.next_if(|tile| next.is_none_or(|next| *tile < next)) {
                self.extract.put(name, &stored(self.base, name, tile)?)?;
                self.kept += 1;
                self.tell();
            }
            let Some(record) = record else { return Ok(()) };
            let replaced = old.next_if(|tile| Some(*tile) == next);
            match record {
                TileRecord::Gone(_) if replaced.is_some() => {}
                TileRecord::Gone(tile) => {
                    return Err(malformed(self.request, &format!("tile {tile} shall go, and is not there")));
                }
                TileRecord::Put(put) => {
                    let base = replaced.map(|tile| stored(self.base, name, tile)).transpose()?;
                    self.extract.put(name, &self.made(*put, base)?)?;
                    self.patched += 1;
                    self.tell();
                }
            }
        }
    }

    /// The result's tile, its content hash proved.
    fn made(&self, put: PutTile, base: Option<StoredTile>) -> Result<StoredTile, PackageError> {
        let tile = put.footprint.tile;
        let wrong = |what: &str| malformed(self.request, &format!("tile {tile} {what}"));
        let (image, descriptors, cells) =
            base.map_or((None, None, None), |base| (Some(base.image), base.descriptors, base.cells));
        let blob = |part: Part, base: Option<Vec<u8>>| match part {
            Part::Absent => Ok(None),
            Part::Given(bytes) => Ok(Some(bytes)),
            Part::AsInBase => base.map(Some).ok_or_else(|| wrong("takes from the old store what is not there")),
        };
        let image = blob(put.image, image)?.ok_or_else(|| wrong("has no imagery"))?;
        let (descriptors, cells) = (blob(put.descriptors, descriptors)?, blob(put.cells, cells)?);
        let media_type = media_type(&image).ok_or_else(|| wrong("is neither JPEG nor PNG"))?;
        let described = descriptors.as_deref().unwrap_or_default();
        if content_hash(media_type, &image, described, cells.as_deref()) != put.footprint.content_hash {
            return Err(wrong("does not have the hash that is stated"));
        }
        Ok(StoredTile { footprint: put.footprint, media_type, image, descriptors, cells })
    }

    fn inputs(&self, name: &str, records: &mut FileRecords, sealed: bool) -> Result<(), PackageError> {
        let mut noted = if sealed { Default::default() } else { inputs(self.base, name)? };
        while let Some(record) = records.inputs().map_err(|e| refused(self.request.patch, e))? {
            match record {
                InputsRecord::Gone(tile) => drop(noted.remove(&tile)),
                InputsRecord::Are(tile, hash) => drop(noted.insert(tile, hash)),
            }
        }
        for (tile, hash) in &noted {
            self.extract.note_inputs(name, *tile, hash)?;
        }
        Ok(())
    }

    fn tell(&self) {
        let done = self.kept + self.patched;
        (self.progress)(done, done.max(base_tiles(self.base)));
    }
}
