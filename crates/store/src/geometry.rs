//! Footprint geometries as GeoPackage binary (OGC 12-128r18, 2.1.3), and the `ST_` functions that the triggers of the R-tree
//! call.

use overfly_core::tile::MercatorBounds;
use rusqlite::Connection;
use rusqlite::functions::{Context, FunctionFlags};

/// The spatial reference system of tiles and footprints.
pub const SRS_ID: i32 = 3857;

const ENVELOPE_XY: u8 = 1 << 1;
const LITTLE_ENDIAN: u8 = 1;
const EMPTY: u8 = 1 << 4;

/// Encodes a rectangle as a polygon of five points, with its envelope (min x, max x, min y, max y) in the header.
pub fn polygon_blob(bounds: &MercatorBounds) -> Vec<u8> {
    let MercatorBounds { min_x_m, min_y_m, max_x_m, max_y_m } = *bounds;
    let mut blob = Vec::with_capacity(40 + 93);
    blob.extend_from_slice(b"GP\0");
    blob.push(ENVELOPE_XY | LITTLE_ENDIAN);
    blob.extend_from_slice(&SRS_ID.to_le_bytes());
    for value in envelope_of(bounds) {
        blob.extend_from_slice(&value.to_le_bytes());
    }
    blob.push(LITTLE_ENDIAN);
    for value in [3u32, 1, 5] {
        blob.extend_from_slice(&value.to_le_bytes());
    }
    let corners = [(min_x_m, min_y_m), (max_x_m, min_y_m), (max_x_m, max_y_m), (min_x_m, max_y_m), (min_x_m, min_y_m)];
    for (x, y) in corners {
        blob.extend_from_slice(&x.to_le_bytes());
        blob.extend_from_slice(&y.to_le_bytes());
    }
    blob
}

/// The envelope of a rectangle as a geometry blob has it: min x, max x, min y, max y.
pub fn envelope_of(bounds: &MercatorBounds) -> [f64; 4] {
    [bounds.min_x_m, bounds.max_x_m, bounds.min_y_m, bounds.max_y_m]
}

/// Reads the envelope of a geometry blob: min x, max x, min y, max y. `None` if the geometry is empty, has no envelope, or the
/// bytes are not a geometry blob.
pub fn envelope(blob: &[u8]) -> Option<[f64; 4]> {
    let flags = *blob.get(3)?;
    let kind = (flags >> 1) & 7;
    if &blob[..3] != b"GP\0" || flags & EMPTY != 0 || !(1..=4).contains(&kind) {
        return None;
    }
    let mut values = [0.0; 4];
    for (value, bytes) in values.iter_mut().zip(blob.get(8..40)?.chunks_exact(8)) {
        let bytes: [u8; 8] = bytes.try_into().expect("chunks of eight bytes");
        *value = if flags & LITTLE_ENDIAN != 0 { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) };
    }
    Some(values)
}

/// Registers `ST_MinX ST_MaxX ST_MinY ST_MaxY ST_IsEmpty`. Every connection that writes footprints needs them.
///
/// # Errors
/// Where SQLite cannot register them.
pub fn register_functions(connection: &Connection) -> rusqlite::Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC | FunctionFlags::SQLITE_INNOCUOUS;
    let read = |context: &Context<'_>| context.get_raw(0).as_blob().ok().and_then(envelope);
    for (index, name) in ["ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"].into_iter().enumerate() {
        connection.create_scalar_function(name, 1, flags, move |context| Ok(read(context).map(|e| e[index])))?;
    }
    connection.create_scalar_function("ST_IsEmpty", 1, flags, move |context| Ok(read(context).is_none()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_the_envelope() {
        let bounds = MercatorBounds { min_x_m: -1.5, min_y_m: 2.0, max_x_m: 3.25, max_y_m: 4.0 };
        let blob = polygon_blob(&bounds);
        assert_eq!(blob.len(), 8 + 32 + 13 + 80);
        assert_eq!(envelope(&blob), Some([-1.5, 3.25, 2.0, 4.0]));
        assert_eq!(envelope(b"GP"), None);
        assert_eq!(envelope(&blob[..20]), None);
    }
}
