//! The size of a store's file, from the content of its tiles.

/// Bytes of a store without tiles: its tables and indexes, a page of 16 KiB or more each.
pub const EMPTY_STORE_BYTES: u64 = 580_000;
/// Bytes that a tile adds besides its content: its footprint row, index entries, and the unused ends of pages after imagery and cells.
const TILE_BYTES: u64 = 5_600;
/// Bytes that a tile's descriptors add besides themselves.
const DESCRIBED_BYTES: u64 = 2_400;

/// Returns the bytes that tiles take in the file of a store, within a few percent, besides [`EMPTY_STORE_BYTES`].
/// `content_bytes` are their imagery, descriptors and cells; `described` is the number of tiles with descriptors.
///
/// Measured on stores of `tiles/` and of NAIP imagery, built and exported.
pub fn stored_bytes(content_bytes: u64, tiles: u64, described: u64) -> u64 {
    content_bytes + tiles * TILE_BYTES + described * DESCRIBED_BYTES
}
