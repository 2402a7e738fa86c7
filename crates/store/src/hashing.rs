//! What hashes of the store are made of: texts after their length, optional texts, errors, places.

use blake3::Hasher;
use overfly_core::tile::TileId;

/// Adds bytes after their length.
pub fn text(hasher: &mut Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

/// Adds a text or that there is none.
pub fn optional(hasher: &mut Hasher, value: Option<&str>) {
    match value {
        Some(value) => text(hasher, value.as_bytes()),
        None => {
            hasher.update(&u64::MAX.to_le_bytes());
        }
    }
}

/// An error as it is hashed; an unknown one has the bits of no number that a store may hold.
pub fn error_bits(error_m: Option<f64>) -> [u8; 8] {
    error_m.map_or([0xff; 8], |error_m| error_m.to_bits().to_le_bytes())
}

/// Adds zoom, row and column.
pub fn place(hasher: &mut Hasher, tile: TileId) {
    hasher.update(&[tile.zoom()]);
    hasher.update(&tile.row().to_le_bytes());
    hasher.update(&tile.column().to_le_bytes());
}

/// Formats bytes as hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
