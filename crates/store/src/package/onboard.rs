//! Opens a store as the aircraft does: proves manifest, signature, age and every footprint.

use super::freshness::{Finding, StalePolicy, check_freshness};
use super::sealed_file::{read_seal, require_unopened};
use super::{Manifest, PackageError, PublicKey, Seal};
use crate::whole_file::require_whole;
use crate::{Reader, StoreError};
use jiff::civil::Date;
use std::collections::HashMap;
use std::path::Path;

/// A store that may be flown, and the warnings about it.
#[derive(Debug)]
pub struct Onboard {
    /// The store.
    pub store: Reader,
    /// The manifest, if the store was exported.
    pub manifest: Option<Manifest>,
    /// Warnings about the age of the store.
    pub findings: Vec<Finding>,
}

/// Opens a store onboard. If `required` is given, the store must be signed with that key.
///
/// Opening proves seal, manifest and signature, every footprint by the digest of its layer, and the layers by the manifest.
/// Reading proves each tile by the hash that its footprint states, and cells by the manifest.
///
/// # Errors
/// As [`Reader::open_onboard`], and [`PackageError::Unsigned`], [`PackageError::WrongKey`],
/// [`PackageError::AlteredManifest`], [`PackageError::AlteredSeal`], [`PackageError::Expired`], [`PackageError::Stale`],
/// [`PackageError::Clock`]; [`StoreError::NoLayer`] where a policy names a layer that the store does not have.
pub fn open_onboard(
    path: &Path,
    required: Option<&PublicKey>,
    policies: &[StalePolicy],
    today: Date,
) -> Result<Onboard, PackageError> {
    let store = Reader::open_onboard(path)?;
    require_whole(path)?;
    let manifest = proved_manifest(&store, required)?;
    require_layers(&store, policies)?;
    let findings = check_freshness(path, store.layers(), manifest.as_ref(), policies, today)?;
    let store = match &manifest {
        Some(manifest) => {
            check_layers(&store, manifest)?;
            require_unopened(path)?;
            let cells = stated_cells(manifest, path)?;
            store.with_stated_cells(cells)
        }
        None => store,
    };
    Ok(Onboard { store, manifest, findings })
}

/// Checks that the store has every layer that a policy names: a misspelt one would be checked by nobody.
///
/// # Errors
/// [`StoreError::NoLayer`].
fn require_layers(store: &Reader, policies: &[StalePolicy]) -> Result<(), StoreError> {
    let named = policies.iter().filter_map(|policy| policy.layer.as_deref());
    named.filter(|name| store.layers().iter().all(|layer| layer.name != *name)).try_for_each(|name| {
        store.layer(name)?;
        Ok(())
    })
}

/// Returns the manifest of a store, proved by seal and signature: `None` if the store was not exported and no signature is required.
///
/// # Errors
/// As [`open_onboard`].
pub(super) fn proved_manifest(store: &Reader, required: Option<&PublicKey>) -> Result<Option<Manifest>, PackageError> {
    let path = store.path();
    let altered = |reason: &str| PackageError::AlteredSeal { path: path.into(), reason: reason.into() };
    match (store.manifest(), read_seal(path)?) {
        (None, None) if required.is_some() => Err(PackageError::Unsigned { path: path.into() }),
        (None, None) => Ok(None),
        (Some(_), None) => Err(altered("the store has a manifest, but no seal")),
        (None, Some(_)) => Err(altered("the store has a seal, but no manifest")),
        (Some(text), Some((seal, _))) => prove_manifest(path, text, &seal, required).map(Some),
    }
}

/// Parses a manifest, and proves it by the seal and its signature. `path` is the file of both.
///
/// # Errors
/// As [`open_onboard`].
pub(super) fn prove_manifest(
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
        Some(hex) => Some(PublicKey::from_hex(hex).ok_or_else(|| reject(format!("{hex:?} is not a public key")))?),
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
            Err(altered("its signature does not match the key that the manifest names"))
        }
        None if seal.is_signed() => Err(altered("it has a signature, but the manifest names no signer")),
        _ => Ok(manifest),
    }
}

/// Checks that the layers of a store are those of its manifest.
///
/// # Errors
/// [`PackageError::AlteredManifest`].
pub(super) fn check_layers(store: &Reader, manifest: &Manifest) -> Result<(), PackageError> {
    let same = manifest.layers.len() == store.layers().len()
        && manifest.layers.iter().zip(store.layers()).all(|(stated, found)| stated.matches(found))
        && manifest.digest == store.digest()
        && manifest.descriptor_contract == store.descriptor_contract()
        && manifest.store_format == store.format_version();
    if same {
        return Ok(());
    }
    let reason = "the layers of the store are not those that it states".into();
    Err(PackageError::AlteredManifest { path: store.path().into(), reason })
}

/// Returns the digests of the cells by layer and zoom.
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
