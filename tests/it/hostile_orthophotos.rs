//! Headers that lie: a clear error that names the file, no panic, no memory for what is only promised.

use overfly_core::tile::TileId;
use overfly_ingest::raster::{OpenOptions, Orthophoto, RasterError};
use std::path::PathBuf;

/// A little-endian TIFF of one directory: (tag, type, values), types 3 short, 4 long, 12 double.
struct Tiff(Vec<(u16, u16, Vec<f64>)>);

impl Tiff {
    /// A gray 64 x 64 image in one uncompressed strip at 10 E, 50 N, one degree / 1000 a pixel.
    fn good() -> Self {
        let keys = [1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326];
        Self(vec![
            (256, 4, vec![64.0]),
            (257, 4, vec![64.0]),
            (258, 3, vec![8.0]),
            (259, 3, vec![1.0]),
            (262, 3, vec![1.0]),
            (273, 4, vec![8.0]),
            (277, 3, vec![1.0]),
            (278, 4, vec![64.0]),
            (279, 4, vec![4096.0]),
            (33550, 12, vec![0.001, 0.001, 0.0]),
            (33922, 12, vec![0.0, 0.0, 0.0, 10.0, 50.0, 0.0]),
            (34735, 3, keys.map(f64::from).to_vec()),
        ])
    }

    fn with(mut self, tag: u16, values: &[f64]) -> Self {
        match self.0.iter_mut().find(|t| t.0 == tag) {
            Some(entry) => entry.2 = values.to_vec(),
            None => self.0.push((tag, 4, values.to_vec())),
        }
        self.0.sort_by_key(|t| t.0);
        self
    }

    fn without(mut self, tag: u16) -> Self {
        self.0.retain(|t| t.0 != tag);
        self
    }

    /// 4096 bytes of image at byte 8, the directory behind it, long values behind that.
    fn bytes(&self) -> Vec<u8> {
        let directory_at = 8 + 4096;
        let mut out = vec![b'I', b'I', 42, 0];
        out.extend((directory_at as u32).to_le_bytes());
        out.extend((0..4096).map(|i| (i % 64 + 50) as u8));
        let mut beyond = Vec::new();
        let beyond_at = directory_at + 2 + 12 * self.0.len() + 4;
        out.extend((self.0.len() as u16).to_le_bytes());
        for (tag, kind, values) in &self.0 {
            let mut data: Vec<u8> = values
                .iter()
                .flat_map(|v| match kind {
                    3 => (*v as u16).to_le_bytes().to_vec(),
                    4 => (*v as u32).to_le_bytes().to_vec(),
                    _ => v.to_le_bytes().to_vec(),
                })
                .collect();
            out.extend(tag.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend((values.len() as u32).to_le_bytes());
            if data.len() <= 4 {
                data.resize(4, 0);
                out.extend(data);
            } else {
                out.extend(((beyond_at + beyond.len()) as u32).to_le_bytes());
                beyond.extend(data);
            }
        }
        out.extend([0; 4]);
        out.extend(beyond);
        out
    }
}

/// Opens it and warps the tile of its place.
fn outcome(bytes: &[u8]) -> Result<bool, RasterError> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("hostile.tif");
    std::fs::write(&path, bytes).unwrap();
    let centre = overfly_core::geodesy::Geodetic::from_degrees(49.97, 10.03).unwrap();
    let source = Orthophoto::open(&path, &OpenOptions::default())?;
    Ok(source.warp(TileId::containing(centre, 9).unwrap())?.is_some())
}

#[track_caller]
fn refuses(tiff: &Tiff, code: &str, words: &str) {
    let error = outcome(&tiff.bytes()).unwrap_err();
    assert_eq!(error.code(), code, "{error}");
    assert!(error.to_string().contains(words) && error.to_string().contains("hostile.tif"), "{error}");
}

#[test]
fn the_pattern_itself_is_good() {
    assert!(outcome(&Tiff::good().bytes()).unwrap());
}

#[test]
fn promises_that_cannot_be_kept_are_refused() {
    let billion = 1e9;
    refuses(&Tiff::good().with(256, &[billion]).with(257, &[billion]), "source_too_large", "limit");
    refuses(
        &Tiff::good().with(256, &[billion]).with(257, &[billion]).with(278, &[billion]),
        "source_too_large",
        "limit",
    );
    let tiled = || Tiff::good().without(273).without(278).without(279).with(324, &[8.0]).with(325, &[4096.0]);
    refuses(
        &tiled().with(322, &[64.0]).with(323, &[64.0]).with(256, &[billion]).with(257, &[billion]),
        "source_damaged",
        "blocks",
    );
    refuses(&tiled().with(322, &[4e9]).with(323, &[4e9]), "source_too_large", "limit");
    refuses(&tiled().with(322, &[0.0]).with(323, &[64.0]), "source_damaged", "");
    refuses(&Tiff::good().with(256, &[0.0]), "source_damaged", "0 x 64");
    refuses(&Tiff::good().with(257, &[0.0]), "source_damaged", "64 x 0");
    refuses(&Tiff::good().with(277, &[0.0]), "source_damaged", "");
    refuses(&Tiff::good().with(277, &[60_000.0]), "source_damaged", "");
    refuses(&Tiff::good().with(258, &[7777.0]), "source_damaged", "");
    if !cfg!(feature = "gdal") {
        refuses(&Tiff::good().with(259, &[34925.0]), "source_unsupported", "compression");
    }
    refuses(&Tiff::good().with(279, &[4e9]), "source_damaged", "truncated");
    refuses(&Tiff::good().with(273, &[4e9]), "source_damaged", "truncated");
    refuses(&Tiff::good().with(279, &[4096.0, 4096.0]), "source_damaged", "");
    refuses(&Tiff::good().with(278, &[32.0]), "source_damaged", "2 blocks");
    refuses(&Tiff::good().without(273), "source_damaged", "");
    // Fewer bytes than the strip needs.
    refuses(&Tiff::good().with(279, &[100.0]), "source_damaged", "");
}

#[test]
fn places_that_are_none_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, 0.0, 1e300, 1e-300] {
        refuses(&Tiff::good().with(33550, &[bad, 0.001, 0.0]), "source_bad_georeference", "");
    }
    refuses(&Tiff::good().with(33922, &[0.0, 0.0, 0.0, f64::NAN, 50.0, 0.0]), "source_bad_georeference", "NaN");
    refuses(&Tiff::good().with(33922, &[0.0, 0.0, 0.0, 10.0, 500.0, 0.0]), "source_bad_georeference", "outside");
    refuses(&Tiff::good().without(33922), "source_no_georeference", "world file");
    refuses(&Tiff::good().without(34735), "source_no_crs", "coordinate reference system");
    let unknown = [1.0, 1.0, 0.0, 2.0, 1024.0, 0.0, 1.0, 1.0, 3072.0, 0.0, 1.0, 1234.0];
    refuses(&Tiff::good().with(34735, &unknown), "crs_unknown", "EPSG:1234");
    let geocentric = [1.0, 1.0, 0.0, 1.0, 1024.0, 0.0, 1.0, 3.0];
    refuses(&Tiff::good().with(34735, &geocentric), "crs_refused", "geocentric");
    let user_defined = [
        1.0, 1.0, 0.0, 4.0, 1024.0, 0.0, 1.0, 1.0, 3072.0, 0.0, 1.0, 32767.0, 2048.0, 0.0, 1.0, 4326.0, 3075.0, 0.0,
        1.0, 3.0,
    ];
    refuses(&Tiff::good().with(34735, &user_defined), "crs_refused", "method 3");
}

#[test]
fn a_flipped_byte_anywhere_never_panics() {
    let good = Tiff::good().bytes();
    let mut refused = 0;
    for at in (0..8).chain(8 + 4096..good.len()) {
        for flip in [0x01, 0x80, 0xFF] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            match outcome(&bytes) {
                Ok(_) => {}
                Err(error) => {
                    assert!(error.to_string().contains("hostile.tif"), "{error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 100, "{refused} refused");
}

#[test]
fn a_png_that_promises_too_much_is_refused_by_its_header() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.png");
    // Signature and an IHDR of 60,000 x 60,000 RGB pixels; its checksum by the crate that reads it.
    let mut ihdr = b"IHDR".to_vec();
    ihdr.extend([60_000u32.to_be_bytes(), 60_000u32.to_be_bytes()].concat());
    ihdr.extend([8, 2, 0, 0, 0]);
    let mut bytes = vec![0x89, b'P', b'N', b'G', 13, 10, 26, 10, 0, 0, 0, 13];
    bytes.extend(&ihdr);
    bytes.extend(crc32(&ihdr).to_be_bytes());
    bytes.extend([0, 0, 0, 0, b'I', b'D', b'A', b'T', 0x35, 0xAF, 0x06, 0x1E]);
    std::fs::write(&path, bytes).unwrap();
    let error = Orthophoto::open(&path, &OpenOptions::default()).unwrap_err();
    assert_eq!(error.code(), "source_too_large", "{error}");
    assert_eq!(error.remedy(), Some(overfly_ingest::Remedy::ConvertToCog));
}

/// CRC of PNG's annex D, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}
