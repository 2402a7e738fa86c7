//! The header of an SQLite file: the length that it states, and whether the file is a map or an export.

/// Length of the header, bytes.
pub const HEADER_LEN: usize = 100;
/// How an SQLite file begins.
pub const SQLITE_MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// Offset of the number of bytes that each page reserves (the file format, 1.3.4).
pub const RESERVED_AT: usize = 20;

/// Returns the length of a page of a file with this header, bytes.
pub fn page_len(header: &[u8; HEADER_LEN]) -> u64 {
    let stated = u16::from_be_bytes([header[16], header[17]]);
    // 1 stands for 65536 (the file format, 1.3.2).
    if stated == 1 { 65_536 } else { u64::from(stated) }
}

/// Returns the length that the header of an SQLite file states, bytes: `None` if it states none (the file format, 1.3.8).
pub fn stated_len(header: &[u8; HEADER_LEN]) -> Option<u64> {
    let pages = u32::from_be_bytes([header[28], header[29], header[30], header[31]]);
    let is_stated = header.starts_with(SQLITE_MAGIC) && pages > 0 && header[24..28] == header[92..96];
    is_stated.then(|| page_len(header) * u64::from(pages))
}

/// Whether a file that begins with `head` is a GeoPackage.
pub fn is_geopackage(head: &[u8]) -> bool {
    head.starts_with(SQLITE_MAGIC) && head.get(68..72) == Some(b"GPKG")
}

/// Whether a GeoPackage that begins with `head` was exported: its pages reserve room for a seal, those of a built map do not.
pub fn is_export(head: &[u8]) -> bool {
    is_geopackage(head) && head[RESERVED_AT] > 0
}

/// How much of a file is there, in words.
pub fn part_text(found: u64, stated: Option<u64>) -> String {
    match (found, stated) {
        (0, _) => "an empty file".into(),
        (found, Some(stated)) => format!("{:.1} of {:.1} MB", found as f64 / 1e6, stated as f64 / 1e6),
        (found, None) => format!("only {found} bytes"),
    }
}

/// A header of 513 pages of 16 KiB.
#[cfg(test)]
pub fn header_of_8_megabytes() -> [u8; HEADER_LEN] {
    let mut header = [0; HEADER_LEN];
    header[..16].copy_from_slice(SQLITE_MAGIC);
    (header[16], header[30], header[31]) = (0x40, 2, 1);
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_the_length_of_the_file() {
        let mut header = header_of_8_megabytes();
        assert_eq!(stated_len(&header), Some(513 * 16_384));
        header[27] = 9;
        assert_eq!(stated_len(&header), None, "written by a program that does not keep the count");
        assert_eq!(stated_len(&[0; HEADER_LEN]), None);
    }
}
