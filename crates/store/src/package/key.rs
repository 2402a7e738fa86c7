//! Ed25519 keys (RFC 8032) in files that OpenSSL reads: PKCS#8 PEM for signing, SPKI PEM for verification (RFC 8410).

use super::PackageError;
use crate::hex;
use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{DecodePrivateKey, DecodePublicKey, EncodePrivateKey, EncodePublicKey, KeypairBytes};
use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};
use std::fmt;
use std::fs::OpenOptions;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Largest key file, bytes. Real ones have a few hundred.
const MOST_BYTES: u64 = 64 << 10;

/// A secret key, which signs. Its `Debug` text shows only the public key.
pub struct SecretKey(SigningKey);

/// A public key, which verifies signatures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl fmt::Debug for SecretKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SecretKey(of {})", self.public().to_hex())
    }
}

impl SecretKey {
    /// Parses a PKCS#8 PEM text.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn from_pem(text: &str) -> Result<Self, String> {
        if text.contains("PUBLIC KEY") {
            return Err("it is a public key, and signing needs the secret key".into());
        }
        SigningKey::from_pkcs8_pem(text).map(Self).map_err(|e| format!("not an Ed25519 key in PKCS#8 PEM ({e})"))
    }

    /// Reads a key file.
    ///
    /// # Errors
    /// [`PackageError::NotAKey`], or where the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, PackageError> {
        Self::from_pem(&read_text(path)?).map_err(|reason| PackageError::NotAKey { path: path.into(), reason })
    }

    /// Returns the public key.
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    /// Signs a message.
    pub fn sign(&self, message: &[u8]) -> [u8; 64] {
        self.0.sign(message).to_bytes()
    }

    /// Encodes the key as PKCS#8 version 1, without the public key: OpenSSL reads no other version.
    fn to_pem(&self) -> Result<String, String> {
        let bytes = KeypairBytes { secret_key: self.0.to_bytes(), public_key: None };
        bytes.to_pkcs8_pem(LineEnding::LF).map(|pem| pem.to_string()).map_err(|e| e.to_string())
    }
}

impl PublicKey {
    /// Parses an SPKI PEM text.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn from_pem(text: &str) -> Result<Self, String> {
        if text.contains("PRIVATE KEY") {
            return Err("it is a secret key, and verification needs the public key".into());
        }
        VerifyingKey::from_public_key_pem(text).map(Self).map_err(|e| format!("not an Ed25519 key in SPKI PEM ({e})"))
    }

    /// Reads a key file.
    ///
    /// # Errors
    /// [`PackageError::NotAKey`], or where the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, PackageError> {
        Self::from_pem(&read_text(path)?).map_err(|reason| PackageError::NotAKey { path: path.into(), reason })
    }

    /// Parses 32 bytes in hexadecimal: `None` if they are not a key.
    pub fn from_hex(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        if text.len() != 64 || !text.is_ascii() {
            return None;
        }
        for (byte, digits) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
            *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
        }
        VerifyingKey::from_bytes(&bytes).ok().map(Self)
    }

    /// Returns the 32 bytes of the key, hexadecimal.
    pub fn to_hex(&self) -> String {
        hex(self.0.as_bytes())
    }

    /// Returns the first eight bytes of the key as people compare them: four groups of four digits.
    pub fn fingerprint(&self) -> String {
        let hex = self.to_hex();
        [0, 4, 8, 12].map(|at| &hex[at..at + 4]).join(" ")
    }

    /// Whether this key verifies the signature of a message. Weak keys and malleable signatures are rejected.
    pub fn verifies(&self, message: &[u8], signature: &[u8; 64]) -> bool {
        self.0.verify_strict(message, &Signature::from_bytes(signature)).is_ok()
    }

    fn to_pem(&self) -> Result<String, String> {
        self.0.to_public_key_pem(LineEnding::LF).map_err(|e| e.to_string())
    }
}

/// Generates a pair of keys: the secret key in `path`, readable only by its owner, and the public key in `path` with the suffix
/// `.pub`. Returns the path of the public key, and the key.
///
/// # Errors
/// [`PackageError::KeyExists`] if either file exists: nothing is written then. Where the folder cannot be written.
///
/// # Example
/// ```
/// use overfly_store::package::{PublicKey, SecretKey, generate};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("ground.key");
/// let (public_path, public) = generate(&path)?;
/// let signature = SecretKey::read(&path)?.sign(b"message");
/// assert!(PublicKey::read(&public_path)?.verifies(b"message", &signature));
/// assert!(!public.verifies(b"another message", &signature));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn generate(path: &Path) -> Result<(PathBuf, PublicKey), PackageError> {
    let mut name = path.as_os_str().to_os_string();
    name.push(".pub");
    let public_path = PathBuf::from(name);
    if let Some(path) = [path, &public_path].into_iter().find(|p| p.symlink_metadata().is_ok()) {
        return Err(PackageError::KeyExists { path: path.into() });
    }
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).map_err(|e| PackageError::Randomness { reason: e.to_string() })?;
    let secret = SecretKey(SigningKey::from_bytes(&seed));
    let refuse = |reason| PackageError::NotAKey { path: path.into(), reason };
    create(path, 0o600, &secret.to_pem().map_err(refuse)?)?;
    let public = secret.public();
    let written = public.to_pem().map_err(refuse).and_then(|pem| create(&public_path, 0o644, &pem));
    if written.is_err() {
        // Half a pair is of no use. The first failure is the one to report.
        let _ = std::fs::remove_file(path);
    }
    written.map(|()| (public_path, public))
}

/// Creates a file, which must not exist, and syncs it.
fn create(path: &Path, mode: u32, text: &str) -> Result<(), PackageError> {
    let opened = OpenOptions::new().write(true).create_new(true).mode(mode).open(path);
    let outcome = opened.and_then(|mut file| {
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
        // A truncated key is of no use, and would prevent the next attempt.
        written.inspect_err(|_| drop(std::fs::remove_file(path)))
    });
    outcome.map_err(|cause| match cause.kind() {
        std::io::ErrorKind::AlreadyExists => PackageError::KeyExists { path: path.into() },
        std::io::ErrorKind::NotFound => PackageError::Store(crate::StoreError::NoFolder { path: path.into() }),
        _ => match PackageError::io(path, cause) {
            PackageError::Store(error) => error.needing(MOST_BYTES).into(),
            other => other,
        },
    })
}

/// Reads the text of a key file.
fn read_text(path: &Path) -> Result<String, PackageError> {
    let refuse = |reason: &str| PackageError::NotAKey { path: path.into(), reason: reason.into() };
    let metadata = std::fs::metadata(path).map_err(|cause| match cause.kind() {
        std::io::ErrorKind::NotFound => refuse("no such file"),
        _ => PackageError::io(path, cause),
    })?;
    if metadata.len() > MOST_BYTES || !metadata.is_file() {
        return Err(refuse("it is not a key file"));
    }
    let bytes = std::fs::read(path).map_err(|cause| PackageError::io(path, cause))?;
    String::from_utf8(bytes).map_err(|_| refuse("it is not text"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 8032, 7.1, test 1: the secret key's seed, its public key, the signature of the empty message.
    const SEED: &str = "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60";
    const PUBLIC: &str = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";

    #[test]
    fn public_keys_round_trip_through_text_and_hex() {
        let seed: Vec<u8> = (0..32).map(|i| u8::from_str_radix(&SEED[2 * i..2 * i + 2], 16).unwrap()).collect();
        let secret = SecretKey(SigningKey::from_bytes(seed.as_slice().try_into().unwrap()));
        let public = secret.public();
        assert_eq!(public.to_hex(), PUBLIC);
        assert_eq!(public.fingerprint(), "d75a 9801 82b1 0ab7");
        assert_eq!(PublicKey::from_hex(PUBLIC), Some(public.clone()));
        assert_eq!(PublicKey::from_pem(&public.to_pem().unwrap()), Ok(public.clone()));
        assert_eq!(SecretKey::from_pem(&secret.to_pem().unwrap()).unwrap().public(), public);
        let signature = secret.sign(b"");
        assert!(public.verifies(b"", &signature) && !public.verifies(b"a", &signature));
        assert!(hex(&signature).starts_with("e5564300c360ac729086e2cc806e828a"), "{}", hex(&signature));
        assert!(SecretKey::from_pem(&public.to_pem().unwrap()).unwrap_err().contains("public"));
        assert!(PublicKey::from_pem(&secret.to_pem().unwrap()).unwrap_err().contains("secret"));
        for wrong in ["", "zz", &"f".repeat(63), &"é".repeat(32)] {
            assert_eq!(PublicKey::from_hex(wrong), None, "{wrong}");
        }
    }
}
