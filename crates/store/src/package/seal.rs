//! `Seal`: the last bytes of a store's first page. SQLite leaves them alone (they are the page's reserved space), so no byte
//! of the file is outside: the file's digest is taken with the seal's bytes as zeros, and the signature covers the digest.
//!
//! | bytes | what |
//! |---|---|
//! | 0..16 | "overfly seal 1", a line feed, a zero |
//! | 16..48 | BLAKE3 of the manifest's bytes |
//! | 48..80 | BLAKE3 of the whole file, these 144 bytes taken as zeros |
//! | 80..144 | Ed25519 signature of bytes 0..80; zeros where nobody signed |

use std::ops::Range;

/// Length of a seal, and of the space that is reserved at the end of every page, bytes.
pub const SEAL_LEN: usize = 144;

const MAGIC: [u8; 16] = *b"overfly seal 1\n\0";
/// Of the file that a header is taken from: SQLite's.
pub(super) const HEADER_LEN: usize = 100;

/// What a seal says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    /// BLAKE3 of the manifest's bytes.
    pub manifest: [u8; 32],
    /// BLAKE3 of the whole file, the seal taken as zeros.
    pub file: [u8; 32],
    /// Ed25519 signature of [`Seal::message`]; zeros where nobody signed.
    pub signature: [u8; 64],
}

impl Seal {
    /// What is signed: bytes 0..80.
    pub fn message(&self) -> [u8; 80] {
        let mut message = [0; 80];
        message[..16].copy_from_slice(&MAGIC);
        message[16..48].copy_from_slice(&self.manifest);
        message[48..].copy_from_slice(&self.file);
        message
    }

    /// As it stands in the file.
    pub fn to_bytes(&self) -> [u8; SEAL_LEN] {
        let mut bytes = [0; SEAL_LEN];
        bytes[..80].copy_from_slice(&self.message());
        bytes[80..].copy_from_slice(&self.signature);
        bytes
    }

    /// The seal of these bytes; `None` where they are none.
    pub fn from_bytes(bytes: &[u8; SEAL_LEN]) -> Option<Self> {
        let (mut manifest, mut file, mut signature) = ([0; 32], [0; 32], [0; 64]);
        manifest.copy_from_slice(&bytes[16..48]);
        file.copy_from_slice(&bytes[48..80]);
        signature.copy_from_slice(&bytes[80..]);
        (bytes[..16] == MAGIC).then_some(Self { manifest, file, signature })
    }

    /// Whether somebody signed.
    pub fn is_signed(&self) -> bool {
        self.signature != [0; 64]
    }
}

/// Where the seal of a store with this header stands: at the end of the first page, where so much is reserved there.
pub(super) fn place(header: &[u8; HEADER_LEN]) -> Option<Range<u64>> {
    let stated = u16::from_be_bytes([header[16], header[17]]);
    // 1 stands for 65536 (the file format, 1.3.2).
    let page = if stated == 1 { 65_536 } else { u64::from(stated) };
    let fits = header.starts_with(b"SQLite format 3\0") && usize::from(header[20]) == SEAL_LEN && page >= 512;
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
    fn stands_at_the_end_of_the_first_page() {
        let mut header = [0; HEADER_LEN];
        header[..16].copy_from_slice(b"SQLite format 3\0");
        (header[16], header[20]) = (0x40, 144);
        assert_eq!(place(&header), Some(16_240..16_384));
        (header[16], header[17]) = (0, 1);
        assert_eq!(place(&header), Some(65_392..65_536));
        for (at, value) in [(0, b'T'), (20, 0), (20, 143), (17, 0)] {
            let mut other = header;
            other[at] = value;
            assert_eq!(place(&other), None);
        }
    }
}
