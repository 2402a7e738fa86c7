//! Opening a store as the aircraft does: manifest, signature and age first, then every footprint.

use super::freshness::{Finding, StalePolicy, freshness};
use super::sealed_file::read_seal;
use super::{Date, Manifest, PackageError, PublicKey, Seal};
use crate::Reader;
use std::collections::HashMap;
use std::path::Path;

/// A store that may be flown, and what is to be said of it.
#[derive(Debug)]
pub struct Onboard {
    /// The store.
    pub store: Reader,
    /// Its manifest, where it was exported.
    pub manifest: Option<Manifest>,
    /// What is told of and not refused.
    pub findings: Vec<Finding>,
}

/// Opens a store onboard. With `required` it must be signed by that key. What is proved now: seal, manifest and signature,
/// every footprint against its layer's digest, layers against the manifest. What is proved when it is read: each tile against
/// the hash that its footprint states, cells against the manifest.
///
/// # Errors
/// As [`Reader::open_onboard`], and [`PackageError::Unsigned`], [`PackageError::WrongKey`],
/// [`PackageError::AlteredManifest`], [`PackageError::AlteredSeal`], [`PackageError::Expired`], [`PackageError::Stale`],
/// [`PackageError::Clock`].
pub fn open_onboard(
    path: &Path,
    required: Option<&PublicKey>,
    policies: &[StalePolicy],
    today: Date,
) -> Result<Onboard, PackageError> {
    let store = Reader::open_onboard(path)?;
    let manifest = proved_manifest(&store, required)?;
    let findings = freshness(path, store.layers(), manifest.as_ref(), policies, today)?;
    let store = match &manifest {
        Some(manifest) => {
            agrees(&store, manifest)?;
            let cells = stated_cells(manifest, path)?;
            store.with_stated_cells(cells)
        }
        None => store,
    };
    Ok(Onboard { store, manifest, findings })
}

/// The manifest of a store, its seal and signature proved; `None` where it was not exported and no signature is required.
///
/// # Errors
/// As [`open_onboard`].
pub(super) fn proved_manifest(store: &Reader, required: Option<&PublicKey>) -> Result<Option<Manifest>, PackageError> {
    let path = store.path();
    let altered = |reason: &str| PackageError::AlteredSeal { path: path.into(), reason: reason.into() };
    match (store.manifest(), read_seal(path)?) {
        (None, None) if required.is_some() => Err(PackageError::Unsigned { path: path.into() }),
        (None, None) => Ok(None),
        (Some(_), None) => Err(altered("the store holds a manifest, and has no seal")),
        (None, Some(_)) => Err(altered("the store has a seal, and holds no manifest")),
        (Some(text), Some((seal, _))) => prove(path, text, &seal, required).map(Some),
    }
}

/// A manifest of its text, held against the seal and its signature; `path` is where both stand.
///
/// # Errors
/// As [`open_onboard`].
pub(super) fn prove(
    path: &Path,
    text: &str,
    seal: &Seal,
    required: Option<&PublicKey>,
) -> Result<Manifest, PackageError> {
    let altered = |reason: &str| PackageError::AlteredSeal { path: path.into(), reason: reason.into() };
    let reject = |reason: String| PackageError::AlteredManifest { path: path.into(), reason };
    if *blake3::hash(text.as_bytes()).as_bytes() != seal.manifest {
        return Err(reject("it does not have the digest that the seal states".into()));
    }
    let manifest = Manifest::from_text(text).map_err(reject)?;
    let signer = match &manifest.signed_by {
        Some(hex) => Some(PublicKey::from_hex(hex).ok_or_else(|| reject(format!("{hex:?} is no public key")))?),
        None => None,
    };
    match (&signer, required) {
        (None, Some(_)) => return Err(PackageError::Unsigned { path: path.into() }),
        (Some(found), Some(required)) if found != required => {
            let (found, required) = (found.to_hex(), required.to_hex());
            return Err(PackageError::WrongKey { path: path.into(), found, required });
        }
        _ => {}
    }
    match &signer {
        Some(key) if !key.verifies(&seal.message(), &seal.signature) => {
            Err(altered("its signature is not that of the key that the manifest names"))
        }
        None if seal.is_signed() => Err(altered("it bears a signature, and the manifest names nobody who signed")),
        _ => Ok(manifest),
    }
}

/// Holds the layers of a store against its manifest.
///
/// # Errors
/// [`PackageError::AlteredManifest`].
pub(super) fn agrees(store: &Reader, manifest: &Manifest) -> Result<(), PackageError> {
    let same = manifest.layers.len() == store.layers().len()
        && manifest.layers.iter().zip(store.layers()).all(|(stated, found)| stated.is(found))
        && manifest.digest == store.digest()
        && manifest.descriptor_contract == store.descriptor_contract()
        && manifest.store_format == store.format_version();
    if same {
        return Ok(());
    }
    let reason = "the store's layers are not those that it states".into();
    Err(PackageError::AlteredManifest { path: store.path().into(), reason })
}

/// What the cells of each layer and level must hash to.
fn stated_cells(manifest: &Manifest, path: &Path) -> Result<HashMap<(String, u8), [u8; 32]>, PackageError> {
    let mut stated = HashMap::new();
    for layer in &manifest.layers {
        for level in &layer.levels {
            let digest = blake3::Hash::from_hex(&level.cells)
                .map_err(|e| PackageError::AlteredManifest { path: path.into(), reason: e.to_string() })?;
            stated.insert((layer.name.clone(), level.zoom), *digest.as_bytes());
        }
    }
    Ok(stated)
}
