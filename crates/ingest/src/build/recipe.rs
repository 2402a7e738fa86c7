//! The hash of a tile's inputs: everything that determines its content.

use blake3::Hasher;
use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{JPEG_QUALITY, Source, hash_source};

/// The most keypoints described in a tile.
pub const KEYPOINTS_PER_TILE: usize = 500;
/// The version of the code that makes tiles. It must change with any change of a tile's content that no other input hashes
/// (warping, compositing, encoding, cells).
const VERSION: u32 = 2;

/// Returns the hash of a base tile's inputs: the sources that meet it, in covering order. `heights`: of a tile of heights.
pub fn base_inputs<'a>(sources: impl Iterator<Item = &'a Source>, heights: bool) -> [u8; 32] {
    if heights {
        return height_inputs(sources);
    }
    let mut hasher = Hasher::new_derive_key("overfly base tile inputs 1");
    hasher.update(&VERSION.to_le_bytes());
    hasher.update(&[JPEG_QUALITY]);
    hasher.update(&(KEYPOINTS_PER_TILE as u64).to_le_bytes());
    hasher.update(&(CONTRACT.len() as u64).to_le_bytes());
    hasher.update(CONTRACT.as_bytes());
    for source in sources {
        hash_source(&mut hasher, source);
    }
    hasher.finalize().into()
}

/// Returns the hash of the inputs of a tile of heights.
fn height_inputs<'a>(sources: impl Iterator<Item = &'a Source>) -> [u8; 32] {
    let mut hasher = Hasher::new_derive_key("overfly height tile inputs 1");
    hasher.update(&VERSION.to_le_bytes());
    for source in sources {
        hash_source(&mut hasher, source);
    }
    hasher.finalize().into()
}

/// Returns the hash of an overview's inputs: the hashes of its children, where there are such children.
pub fn overview_inputs(children: [Option<[u8; 32]>; 4]) -> [u8; 32] {
    let mut hasher = Hasher::new_derive_key("overfly overview inputs 1");
    hasher.update(&VERSION.to_le_bytes());
    for child in children {
        hasher.update(&child.unwrap_or([0; 32]));
    }
    hasher.finalize().into()
}
