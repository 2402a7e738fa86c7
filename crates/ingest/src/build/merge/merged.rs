//! `Merged`: what a merge did.

use serde::Serialize;

/// How a layer was merged.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct MergedLayer {
    /// The layer's name.
    pub layer: String,
    /// The number of stores that have the layer.
    pub stores: usize,
    /// Tiles taken unchanged from a store.
    pub taken_tiles: u64,
    /// Base tiles made of the pixels of several stores.
    pub blended_tiles: u64,
    /// Overviews that were computed.
    pub remade_overviews: u64,
}

/// The result of a merge.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Merged {
    /// The layers, sorted by name.
    pub layers: Vec<MergedLayer>,
    /// The new store's digest, hexadecimal.
    pub digest: String,
    /// The size of its file.
    pub bytes: u64,
}
