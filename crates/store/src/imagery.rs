//! `EncodedTile`: the pixels of a tile as stored. JPEG if every pixel is valid, else PNG with alpha.

use super::StoreError;
use image::{ExtendedColorType, ImageEncoder, ImageFormat};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use std::io::Cursor;

/// JPEG quality of tiles whose pixels are all valid.
pub const JPEG_QUALITY: u8 = 90;

/// Most memory that decoding a tile may take: 16 bytes per pixel. A colour profile of a few hundred kilobytes can inflate to as many
/// megabytes.
const DECODING_BYTES: u64 = 16 * (TILE_SIZE_PX as u64) * (TILE_SIZE_PX as u64);

/// The imagery of a tile as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedTile {
    /// `image/jpeg` or `image/png`.
    pub media_type: &'static str,
    /// The encoded image.
    pub bytes: Vec<u8>,
    /// BLAKE3 hash of the content of the tile, for ETags.
    pub content_hash: [u8; 32],
}

/// Encodes the pixels of a tile, and returns media type and bytes.
///
/// # Errors
/// [`StoreError::Encode`].
pub fn encode(tile: TileId, pixels: &MaskedColour) -> Result<(&'static str, Vec<u8>), StoreError> {
    let refuse = |reason: String| StoreError::Encode { tile, reason };
    if pixels.mask.is_full() {
        return Ok(("image/jpeg", jpeg(&pixels.colour, JPEG_QUALITY).map_err(refuse)?));
    }
    let mut bytes = Vec::with_capacity(128 * 1024);
    let mut rgba = Vec::with_capacity(pixels.mask.values().len() * 4);
    for (rgb, &valid) in pixels.colour.values().chunks_exact(3).zip(pixels.mask.values()) {
        // Missing pixels are written black: equal tiles have equal bytes.
        rgba.extend_from_slice(&if valid == 0 { [0; 4] } else { [rgb[0], rgb[1], rgb[2], 255] });
    }
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&rgba, TILE_SIZE_PX, TILE_SIZE_PX, ExtendedColorType::Rgba8)
        .map_err(|e| refuse(e.to_string()))?;
    Ok(("image/png", bytes))
}

fn jpeg(colour: &Colour, quality: u8) -> Result<Vec<u8>, String> {
    let size = TILE_SIZE_PX as u16;
    let mut bytes = Vec::with_capacity(128 * 1024);
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.encode(colour.values(), size, size, ColorType::Rgb).map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// Encodes the JPEG of a stored tile again with a quality of 1 to 100. Returns it unchanged if that makes it no smaller. A PNG is
/// always returned unchanged, because its mask must stay exact.
///
/// # Errors
/// [`StoreError::Encode`] if it cannot be decoded or encoded.
pub fn recode(tile: TileId, bytes: Vec<u8>, quality: u8) -> Result<Vec<u8>, StoreError> {
    if media_type(&bytes) != Some("image/jpeg") {
        return Ok(bytes);
    }
    let recoded = decode(&bytes).and_then(|pixels| jpeg(&pixels.colour, quality));
    let recoded = recoded.map_err(|reason| StoreError::Encode { tile, reason })?;
    Ok(if recoded.len() < bytes.len() { recoded } else { bytes })
}

/// Recognises the media type of a stored tile by its first bytes.
pub fn media_type(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xd8, 0xff, ..] => Some("image/jpeg"),
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        _ => None,
    }
}

/// Decodes the pixels and mask of a stored tile.
///
/// # Errors
/// What is wrong with the image.
pub fn decode(bytes: &[u8]) -> Result<MaskedColour, String> {
    let format = match media_type(bytes) {
        Some("image/jpeg") => ImageFormat::Jpeg,
        Some(_) => ImageFormat::Png,
        None => return Err("neither JPEG nor PNG".into()),
    };
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(TILE_SIZE_PX), Some(TILE_SIZE_PX));
    limits.max_alloc = Some(DECODING_BYTES);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| e.to_string())?;
    let size = TILE_SIZE_PX as usize;
    if (decoded.width(), decoded.height()) != (TILE_SIZE_PX, TILE_SIZE_PX) {
        return Err(format!("{} x {} pixels instead of {size} x {size}", decoded.width(), decoded.height()));
    }
    let (colour, mask) = if decoded.color().has_alpha() {
        let rgba = decoded.into_rgba8().into_raw();
        let rgb = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let alpha = rgba.chunks_exact(4).map(|p| p[3]).collect();
        (Colour::from_values(size, size, rgb), Mask::from_values(size, size, alpha))
    } else {
        (Colour::from_values(size, size, decoded.into_rgb8().into_raw()), Some(Mask::filled(size, size, true)))
    };
    let whole = "a value for each pixel";
    Ok(MaskedColour { colour: colour.expect(whole), mask: mask.expect(whole) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn striped() -> MaskedColour {
        let size = TILE_SIZE_PX as usize;
        let values = (0..size * size).flat_map(|i| [(i % 251) as u8 / 4 + 90, 120, (i / size / 4) as u8]).collect();
        MaskedColour { colour: Colour::from_values(size, size, values).unwrap(), mask: Mask::filled(size, size, true) }
    }

    #[test]
    fn keeps_missing_pixels_exactly() {
        let mut tile = striped();
        let id = TileId::new(3, 1, 1).unwrap();
        for y in 0..200 {
            for x in 0..y {
                tile.mask.set(x, y, false);
                tile.colour.set(x, y, [0, 0, 0]);
            }
        }
        let (media, bytes) = encode(id, &tile).unwrap();
        assert_eq!(media, "image/png");
        assert_eq!(decode(&bytes).unwrap(), tile);
    }

    #[test]
    fn keeps_whole_tiles_within_jpeg_error() {
        let tile = striped();
        let (media, bytes) = encode(TileId::new(3, 1, 1).unwrap(), &tile).unwrap();
        assert_eq!((media, media_type(&bytes)), ("image/jpeg", Some("image/jpeg")));
        let back = decode(&bytes).unwrap();
        let total: u64 =
            back.colour.values().iter().zip(tile.colour.values()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        assert!(total as f64 / (back.colour.values().len() as f64) < 4.0, "mean difference of gray levels");
        assert!(back.mask.is_full());
    }

    #[test]
    fn rejects_images_that_are_not_tiles() {
        let mut small = Vec::new();
        Encoder::new(&mut small, 90).encode(&[0; 12], 2, 2, ColorType::Rgb).unwrap();
        for bytes in [&b""[..], b"hello", &[0xff, 0xd8, 0xff, 0xe0], &small] {
            assert!(decode(bytes).is_err());
        }
    }
}
