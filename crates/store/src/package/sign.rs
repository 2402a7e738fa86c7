//! `sign`: signs an export that was made without a key.

use super::onboard::{check_layers, proved_manifest};
use super::sealed_file::{read_seal, write_seal};
use super::{Date, Manifest, PackageError, SEAL_LEN, SecretKey, check_freshness, file_digest, require_past_imagery};
use crate::{AtomicFile, Extract, FileKind, LayerPart, Reader, StoreError, file_len, hex};
use overfly_core::tile::TileId;
use serde::Serialize;
use std::path::Path;

/// A store that was signed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Signed {
    /// The file's size.
    pub bytes: u64,
    /// The store's digest, hexadecimal.
    pub digest: String,
    /// The whole file's digest, which its seal states, hexadecimal.
    pub file_digest: String,
    /// The public key of the signer, hexadecimal.
    pub signed_by: String,
    /// The mission's name, if the export has one.
    pub name: Option<String>,
    /// The serial.
    pub serial: Option<u64>,
    /// The last day on which the export may be flown.
    pub valid_until: Option<String>,
}

/// Signs the export at `path`, and writes it to `out`: byte for byte what the export would be, had it been signed at once. Calls
/// `progress` with the number of tiles done and the total.
///
/// # Errors
/// [`PackageError::NotExported`], [`PackageError::AlreadySigned`], [`PackageError::NoSerial`], [`PackageError::Expired`],
/// [`PackageError::Clock`]; where the export is damaged or the disk is full.
pub fn sign(
    path: &Path,
    key: &SecretKey,
    out: &Path,
    today: Date,
    progress: &dyn Fn(u64, u64),
) -> Result<Signed, PackageError> {
    let store = Reader::open(path)?;
    let manifest = proved_manifest(&store, None)?.ok_or_else(|| PackageError::NotExported { path: path.into() })?;
    if let Some(signer) = manifest.signed_by {
        return Err(PackageError::AlreadySigned { path: path.into(), signer });
    }
    if manifest.serial.is_none() {
        return Err(PackageError::NoSerial { path: path.into() });
    }
    check_layers(&store, &manifest)?;
    check_freshness(path, store.layers(), Some(&manifest), &[], today)?;
    require_past_imagery(path, store.layers(), today)?;
    require_intact(path)?;
    let file = AtomicFile::create(out, FileKind::Export, &[path])?;
    file.require_room(store.bytes())?;
    let mut extract = Extract::begin_version(&file.draft_path(), store.descriptor_contract(), store.format_version())?;
    let total = store.layers().iter().map(|l| l.tiles).sum();
    let mut done = 0;
    for part in whole_layers(&store)? {
        extract.copy(&store, &part, || {
            done += 1;
            progress(done, total);
        })?;
    }
    let signed_by = key.public().to_hex();
    let manifest = Manifest { signed_by: Some(signed_by.clone()), ..manifest };
    extract.finish(file.temporary_path(), Some(&manifest.to_text()), SEAL_LEN as u8)?;
    let seal = write_seal(file.temporary_path(), &manifest.to_text(), Some(key))?;
    let bytes = file_len(file.temporary_path())?;
    file.persist()?;
    let Manifest { digest, name, serial, valid_until, .. } = manifest;
    Ok(Signed { bytes, digest, file_digest: hex(&seal.file), signed_by, name, serial, valid_until })
}

/// Checks that every byte of an export is as its seal states: a signature must not cover damage.
fn require_intact(path: &Path) -> Result<(), PackageError> {
    let Some((seal, hole)) = read_seal(path)? else { return Ok(()) };
    let found = file_digest(path, hole, &|_| ()).map_err(|e| PackageError::io(path, e))?;
    if found == seal.file {
        return Ok(());
    }
    let reason = "the file does not have the digest that its seal states".into();
    Err(StoreError::Damaged { path: path.into(), reason }.into())
}

/// Every layer with all its tiles, as they are, in the order of an export.
fn whole_layers(store: &Reader) -> Result<Vec<LayerPart>, PackageError> {
    let mut parts = Vec::new();
    for layer in store.layers() {
        let mut tiles: Vec<TileId> = store.all_footprints(&layer.name)?.into_iter().map(|f| f.tile).collect();
        tiles.sort();
        parts.push(LayerPart {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            tiles,
            with_descriptors: true,
            jpeg_quality: None,
        });
    }
    Ok(parts)
}
