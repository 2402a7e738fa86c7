//! The digest of a whole file on all cores: BLAKE3 as `b3sum` prints it, with a range of bytes taken as zeros.
//!
//! BLAKE3 is a tree hash: a left subtree of 2^k bytes can be hashed independently. So threads read and hash pieces of 1 MiB, which
//! are then merged. The file is not mapped into memory: a file that shrinks is an error, and not a signal.

use blake3::hazmat::{ChainingValue, HasherExt, Mode, left_subtree_len, merge_subtrees_non_root, merge_subtrees_root};
use blake3::{Hash, Hasher};
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes that are read and hashed at once: a power of two, so a whole subtree, and small enough for the cache of a core.
const PIECE: u64 = 1 << 20;

thread_local! {
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Returns the BLAKE3 hash of the file at `path`, with the bytes of `hole` taken as zeros. Calls `progress` with the number of bytes
/// of each piece.
///
/// # Errors
/// Where the file cannot be read, or shrinks in the meantime.
pub fn file_digest(path: &Path, hole: Range<u64>, progress: &(dyn Fn(u64) + Sync)) -> io::Result<[u8; 32]> {
    let file = File::open(path)?;
    let whole = 0..file.metadata()?.len();
    let source = HashedFile { file: &file, hole, progress };
    let hash = if whole.end <= PIECE {
        source.piece(&whole, blake3::hash)?
    } else {
        let (left, right) = source.halves(&whole)?;
        merge_subtrees_root(&left, &right, Mode::Hash)
    };
    Ok(Hash::into(hash))
}

/// The file to hash.
struct HashedFile<'a> {
    file: &'a File,
    hole: Range<u64>,
    progress: &'a (dyn Fn(u64) + Sync),
}

impl HashedFile<'_> {
    /// Returns the chaining value of a part of the file that is a subtree.
    fn subtree(&self, part: &Range<u64>) -> io::Result<ChainingValue> {
        if part.end - part.start <= PIECE {
            return self.piece(part, |bytes| {
                let mut hasher = Hasher::new();
                hasher.set_input_offset(part.start).update(bytes).finalize_non_root()
            });
        }
        let (left, right) = self.halves(part)?;
        Ok(merge_subtrees_non_root(&left, &right, Mode::Hash))
    }

    /// Returns the chaining values of the two subtrees of a part.
    fn halves(&self, part: &Range<u64>) -> io::Result<(ChainingValue, ChainingValue)> {
        let middle = part.start + left_subtree_len(part.end - part.start);
        let (left, right) = rayon::join(|| self.subtree(&(part.start..middle)), || self.subtree(&(middle..part.end)));
        Ok((left?, right?))
    }

    /// Reads a part of the file and passes its bytes to `hash`.
    fn piece<T>(&self, part: &Range<u64>, hash: impl FnOnce(&[u8]) -> T) -> io::Result<T> {
        BUFFER.with_borrow_mut(|buffer| {
            buffer.resize(PIECE as usize, 0);
            let bytes = &mut buffer[..(part.end - part.start) as usize];
            self.file.read_exact_at(bytes, part.start)?;
            let (from, to) = (self.hole.start.max(part.start), self.hole.end.min(part.end));
            if from < to {
                bytes[(from - part.start) as usize..(to - part.start) as usize].fill(0);
            }
            (self.progress)(bytes.len() as u64);
            Ok(hash(bytes))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn is_the_plain_hash_of_the_bytes_with_a_hole_of_zeros() {
        for (len, hole) in [
            (0, 0..0),
            (1, 0..1),
            (1023, 5..9),
            (1 << 20, 16_240..16_384),
            ((1 << 20) + 1, 0..0),
            (5 << 20, (1 << 20) - 7..(1 << 20) + 9),
            ((7 << 20) + 12_345, 16_240..16_384),
            ((9 << 20) - 1, (9 << 20) - 5..(9 << 20) - 1),
        ] {
            let mut bytes: Vec<u8> = (0..len).map(|i: u64| (i.wrapping_mul(0x9E37_79B9) >> 13) as u8).collect();
            let mut file = tempfile::NamedTempFile::new().unwrap();
            file.write_all(&bytes).unwrap();
            bytes[hole.start as usize..hole.end as usize].fill(0);
            let found = file_digest(file.path(), hole, &|_| ()).unwrap();
            assert_eq!(found, *blake3::hash(&bytes).as_bytes(), "{len}");
        }
    }
}
