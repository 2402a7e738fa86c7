//! Heights as tiles: each a step of 0.2 m in 16 bits, so that any GeoPackage reader understands them.

use super::StoreError;
use image::{ExtendedColorType, ImageEncoder, ImageFormat};
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{HeightGrid, TILE_SIZE_PX, TileId};
use std::io::Cursor;

/// The height that a step of 0 stands for, metres.
pub const LOWEST_M: f64 = -1000.0;
/// The height of a step, metres.
pub const STEP_M: f64 = 0.2;
/// The step that stands for an unknown height.
pub const UNKNOWN: u16 = u16::MAX;

/// The step of a height, metres: `None` for one beyond -1000 m and 12,106 m, and for what is not a number.
pub fn step_of(height_m: f64) -> Option<u16> {
    let step = ((height_m - LOWEST_M) / STEP_M).round();
    (0.0..f64::from(UNKNOWN)).contains(&step).then_some(step as u16)
}

/// Encodes a tile of heights as a gray PNG of 16 bits. Red and green of a pixel are the higher and the lower byte of its step.
///
/// # Errors
/// [`StoreError::Encode`].
pub fn encode(tile: TileId, pixels: &MaskedColour) -> Result<Vec<u8>, StoreError> {
    let mut bytes = Vec::with_capacity(256 * 1024);
    let steps = pixels.colour.values().chunks_exact(3).zip(pixels.mask.values());
    let steps = steps.map(|(rgb, valid)| if *valid == 0 { UNKNOWN } else { u16::from_be_bytes([rgb[0], rgb[1]]) });
    let gray: Vec<u8> = steps.flat_map(u16::to_ne_bytes).collect();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&gray, TILE_SIZE_PX, TILE_SIZE_PX, ExtendedColorType::L16)
        .map_err(|e| StoreError::Encode { tile, reason: e.to_string() })?;
    Ok(bytes)
}

/// Decodes a tile of heights.
///
/// # Errors
/// What is wrong with the image.
pub fn decode(tile: TileId, bytes: &[u8]) -> Result<HeightGrid, String> {
    let height_m = |step: u16| if step == UNKNOWN { f32::NAN } else { (LOWEST_M + STEP_M * f64::from(step)) as f32 };
    let heights = steps(bytes)?.into_iter().map(height_m).collect();
    let corner = [tile.column(), tile.row()].map(|index| i64::from(index) * i64::from(TILE_SIZE_PX));
    HeightGrid::from_heights(tile.zoom(), corner, TILE_SIZE_PX as usize, heights).ok_or_else(|| "no heights".into())
}

/// Decodes a tile of heights to the pixels that [`encode`] takes.
///
/// # Errors
/// What is wrong with the image.
pub fn decode_pixels(bytes: &[u8]) -> Result<MaskedColour, String> {
    let steps = steps(bytes)?;
    let size = TILE_SIZE_PX as usize;
    let mask = steps.iter().map(|step| if *step == UNKNOWN { 0 } else { 255 }).collect();
    let bytes = |step: &u16| if *step == UNKNOWN { [0; 2] } else { step.to_be_bytes() };
    let rgb = steps.iter().map(bytes).flat_map(|[high, low]| [high, low, 0]).collect();
    let whole = "a value for each pixel";
    Ok(MaskedColour {
        colour: Colour::from_values(size, size, rgb).expect(whole),
        mask: Mask::from_values(size, size, mask).expect(whole),
    })
}

/// The steps of a tile, row by row.
fn steps(bytes: &[u8]) -> Result<Vec<u16>, String> {
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(TILE_SIZE_PX), Some(TILE_SIZE_PX));
    limits.max_alloc = Some(u64::from(TILE_SIZE_PX) * u64::from(TILE_SIZE_PX) * 16);
    reader.limits(limits);
    let image::DynamicImage::ImageLuma16(steps) = reader.decode().map_err(|e| e.to_string())? else {
        return Err("heights that are not gray of 16 bits".into());
    };
    let (width, height) = steps.dimensions();
    if (width, height) != (TILE_SIZE_PX, TILE_SIZE_PX) {
        return Err(format!("{width} x {height} heights instead of {TILE_SIZE_PX} x {TILE_SIZE_PX}"));
    }
    Ok(steps.into_raw())
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::tile::WorldPixel;

    #[test]
    fn heights_come_back_within_half_a_step_and_unknown_ones_as_unknown() {
        let size = TILE_SIZE_PX as usize;
        let height_m = |i: usize| -430.0 + 9300.0 * (i as f64 / (size * size) as f64);
        let mut rgb = Vec::new();
        for i in 0..size * size {
            let [high, low] = step_of(height_m(i)).unwrap().to_be_bytes();
            rgb.extend([high, low, 0]);
        }
        let mut mask = Mask::filled(size, size, true);
        mask.set(7, 0, false);
        let pixels = MaskedColour { colour: Colour::from_values(size, size, rgb).unwrap(), mask };
        let tile = TileId::new(11, 1000, 700).unwrap();
        let encoded = encode(tile, &pixels).unwrap();
        let again = decode_pixels(&encoded).unwrap();
        assert_eq!((&again.mask, again.colour.at(8, 0)), (&pixels.mask, pixels.colour.at(8, 0)));
        let grid = decode(tile, &encoded).unwrap();
        let worst = grid.heights_m().iter().enumerate().filter(|(i, _)| *i != 7);
        let worst = worst.map(|(i, found)| (f64::from(*found) - height_m(i)).abs()).fold(0.0, f64::max);
        assert!(worst <= STEP_M / 2.0 + 1e-3, "{worst}");
        assert!(grid.heights_m()[7].is_nan());
        let middle = WorldPixel { x_px: 1000.0 * 512.0 + 256.0, y_px: 700.0 * 512.0 + 256.0 };
        assert!((grid.at(middle, 11).unwrap() - height_m(size * size / 2 - 128)).abs() < 20.0);
    }

    #[test]
    fn what_no_ground_has_is_no_step() {
        for height_m in [f64::NAN, f64::INFINITY, -1000.2, 12_107.0] {
            assert_eq!(step_of(height_m), None, "{height_m}");
        }
        assert_eq!(step_of(-1000.0), Some(0));
    }

    #[test]
    fn an_image_that_holds_no_heights_is_refused() {
        let tile = TileId::new(3, 1, 2).unwrap();
        assert!(decode(tile, b"no image").is_err());
        let mut small = Vec::new();
        image::codecs::png::PngEncoder::new(&mut small).write_image(&[0; 8], 2, 2, ExtendedColorType::L16).unwrap();
        assert!(decode(tile, &small).unwrap_err().contains("2 x 2"));
    }
}
