//! `Seal`: the last bytes of the first page of an exported store. They are reserved space, which SQLite does not use. The digest
//! of the file is computed with these bytes as zeros, and the signature covers the digest: so it covers every byte of the file.
//!
//! | bytes | content |
//! |---|---|
//! | 0..16 | "overfly seal 1", a line feed, a zero |
//! | 16..48 | BLAKE3 hash of the manifest |
//! | 48..80 | BLAKE3 hash of the whole file, with these 144 bytes as zeros |
//! | 80..144 | Ed25519 signature of bytes 0..80; zeros if unsigned |

use crate::file_header::{HEADER_LEN, RESERVED_AT, SQLITE_MAGIC, page_len};
use std::ops::Range;

/// Length of a seal, and of the reserved space at the end of every page, bytes.
pub const SEAL_LEN: usize = 144;

const MAGIC: [u8; 16] = *b"overfly seal 1\n\0";

/// The seal of an exported store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    /// BLAKE3 hash of the manifest.
    pub manifest: [u8; 32],
    /// BLAKE3 hash of the whole file, with the seal as zeros.
    pub file: [u8; 32],
    /// Ed25519 signature of [`Seal::message`]; zeros if unsigned.
    pub signature: [u8; 64],
}

impl Seal {
    /// The signed message: bytes 0..80.
    pub fn message(&self) -> [u8; 80] {
        let mut message = [0; 80];
        message[..16].copy_from_slice(&MAGIC);
        message[16..48].copy_from_slice(&self.manifest);
        message[48..].copy_from_slice(&self.file);
        message
    }

    /// Returns the seal as it is stored.
    pub fn to_bytes(&self) -> [u8; SEAL_LEN] {
        let mut bytes = [0; SEAL_LEN];
        bytes[..80].copy_from_slice(&self.message());
        bytes[80..].copy_from_slice(&self.signature);
        bytes
    }

    /// Parses a stored seal: `None` if the bytes are not a seal.
    pub fn from_bytes(bytes: &[u8; SEAL_LEN]) -> Option<Self> {
        let (mut manifest, mut file, mut signature) = ([0; 32], [0; 32], [0; 64]);
        manifest.copy_from_slice(&bytes[16..48]);
        file.copy_from_slice(&bytes[48..80]);
        signature.copy_from_slice(&bytes[80..]);
        (bytes[..16] == MAGIC).then_some(Self { manifest, file, signature })
    }

    /// Whether the seal has a signature.
    pub fn is_signed(&self) -> bool {
        self.signature != [0; 64]
    }
}

/// Returns the position of the seal in a file with this header, the end of the first page: `None` if the pages do not reserve
/// [`SEAL_LEN`] bytes.
pub(super) fn position(header: &[u8; HEADER_LEN]) -> Option<Range<u64>> {
    let page = page_len(header);
    let fits = header.starts_with(SQLITE_MAGIC) && usize::from(header[RESERVED_AT]) == SEAL_LEN && page >= 512;
    fits.then(|| page - SEAL_LEN as u64..page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_from_its_bytes() {
        let seal = Seal { manifest: [3; 32], file: [5; 32], signature: [7; 64] };
        let bytes = seal.to_bytes();
        assert_eq!(Seal::from_bytes(&bytes), Some(seal));
        assert_eq!(bytes[..80], seal.message());
        for at in 0..16 {
            let mut other = bytes;
            other[at] ^= 4;
            assert_eq!(Seal::from_bytes(&other), None);
        }
    }

    #[test]
    fn is_at_the_end_of_the_first_page() {
        let mut header = [0; HEADER_LEN];
        header[..16].copy_from_slice(b"SQLite format 3\0");
        (header[16], header[20]) = (0x40, 144);
        assert_eq!(position(&header), Some(16_240..16_384));
        (header[16], header[17]) = (0, 1);
        assert_eq!(position(&header), Some(65_392..65_536));
        for (at, value) in [(0, b'T'), (20, 0), (20, 143), (17, 0)] {
            let mut other = header;
            other[at] = value;
            assert_eq!(position(&other), None);
        }
    }
}
