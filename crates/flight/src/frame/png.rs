//! PNG frames. The checksum of every chunk and that of the pixels must be right, and the end chunk must be there; bytes after it
//! are not read.

use super::error::Fault;
use overfly_core::pixels::{Colour, Gray};
use png::{BitDepth, ColorType, DecodeOptions, Decoder, DecodingError, Reader, Transformations};
use std::io::Cursor;

/// Reads columns and rows from the header.
pub(super) fn size_px(bytes: &[u8]) -> Result<[u32; 2], Fault> {
    let mut decoder = decoder(bytes);
    let info = decoder.read_header_info().map_err(fault)?;
    Ok([info.width, info.height])
}

/// Decodes to colours; alpha is dropped.
pub(super) fn colour(bytes: &[u8]) -> Result<Colour, Fault> {
    let mut reader = opened(bytes, Transformations::EXPAND)?;
    let size = reader.output_buffer_size().ok_or_else(|| Fault::TooLarge("more bytes than can be addressed".into()))?;
    let mut values = vec![0; size];
    let info = reader.next_frame(&mut values).map_err(fault)?;
    reader.finish().map_err(fault)?;
    values.truncate(info.buffer_size());
    if info.bit_depth == BitDepth::Sixteen {
        // As fractions of the full range, rounded.
        let byte = |pair: &[u8]| ((u32::from(u16::from_be_bytes([pair[0], pair[1]])) + 128) / 257) as u8;
        values = values.chunks_exact(2).map(byte).collect();
    }
    let rgb = match info.color_type {
        ColorType::Rgb => values,
        ColorType::Rgba => values.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect(),
        ColorType::GrayscaleAlpha => values.chunks_exact(2).flat_map(|p| [p[0]; 3]).collect(),
        _ => values.iter().flat_map(|&v| [v; 3]).collect(),
    };
    Ok(Colour::from_values(info.width as usize, info.height as usize, rgb).expect("three values a pixel"))
}

/// Reduces row by row to the means of `reduction` x `reduction` pixels; `None` where the file is interlaced. Rows and columns that
/// fill no pixel are dropped.
pub(super) fn reduced(bytes: &[u8], reduction: usize) -> Result<Option<Gray>, Fault> {
    let mut reader = opened(bytes, Transformations::normalize_to_color8())?;
    let (width, height, interlaced) =
        (reader.info().width as usize, reader.info().height as usize, reader.info().interlaced);
    if interlaced {
        return Ok(None);
    }
    let samples = reader.output_color_type().0.samples();
    let (columns, rows) = (width / reduction, height / reduction);
    let mut out = Gray::filled(columns, rows, 0.0);
    let share = 1.0 / (reduction * reduction) as f32;
    for y in 0..height {
        let Some(row) = reader.next_row().map_err(fault)? else { break };
        let Some(target) = out.values_mut().get_mut(y / reduction * columns..(y / reduction + 1) * columns) else {
            continue;
        };
        for (sum, pixels) in target.iter_mut().zip(row.data().chunks_exact(samples * reduction)) {
            *sum += share * pixels.chunks_exact(samples).map(luma).sum::<f32>();
        }
    }
    reader.finish().map_err(fault)?;
    Ok(Some(out))
}

fn decoder(bytes: &[u8]) -> Decoder<Cursor<&[u8]>> {
    let mut options = DecodeOptions::default();
    options.set_ignore_checksums(false);
    options.set_skip_ancillary_crc_failures(false);
    // Their content does not matter; their checksums do.
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    Decoder::new_with_options(Cursor::new(bytes), options)
}

fn opened(bytes: &[u8], transformations: Transformations) -> Result<Reader<Cursor<&[u8]>>, Fault> {
    let mut decoder = decoder(bytes);
    decoder.set_limits(png::Limits { bytes: bytes.len() + (64 << 20) });
    decoder.set_transformations(transformations);
    decoder.read_info().map_err(fault)
}

fn fault(error: DecodingError) -> Fault {
    match error {
        DecodingError::LimitsExceeded => Fault::TooLarge("its metadata".into()),
        DecodingError::IoError(_) => Fault::damaged("the file ends before the image's end chunk"),
        other => Fault::damaged(other),
    }
}

/// Luma (ITU-R BT.601) of a gray or colour pixel, with or without alpha.
fn luma(pixel: &[u8]) -> f32 {
    match *pixel {
        [r, g, b, ..] => 0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b),
        [gray, ..] => f32::from(gray),
        [] => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use crate::frame::decode_frame;

    /// A PNG of some texture.
    fn png() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 120, 90);
        encoder.set_color(png::ColorType::Rgb);
        encoder.add_text_chunk("Comment".into(), "over the ground".into()).unwrap();
        let pixels: Vec<u8> = (0..120 * 90 * 3u32).map(|i| (i * i / 7 % 251) as u8).collect();
        encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
        bytes
    }

    #[test]
    fn every_changed_byte_is_found() {
        let sound = png();
        let expected = decode_frame(&sound, "x").unwrap();
        for at in (8..sound.len()).step_by(37).chain([40, 60, sound.len() - 20, sound.len() - 1]) {
            let mut bytes = sound.clone();
            bytes[at] ^= 0x10;
            assert_eq!(decode_frame(&bytes, "x").unwrap_err().code(), "image_damaged", "byte {at}");
            let cut = decode_frame(&sound[..at], "x").unwrap_err();
            assert_eq!(cut.code(), "image_damaged", "cut at {at}");
        }
        assert_eq!(decode_frame(&[&sound[..], &[9; 77]].concat(), "x").unwrap(), expected, "trailing bytes");
    }

    /// The pixels' own checksum is kept too: here every chunk's checksum is right.
    #[test]
    fn a_wrong_checksum_of_the_pixels_is_found() {
        let mut bytes = png();
        let at = bytes.windows(4).rposition(|w| w == b"IDAT").unwrap();
        let length = u32::from_be_bytes(bytes[at - 4..at].try_into().unwrap()) as usize;
        bytes[at + 4 + length - 1] ^= 1;
        let crc = crc32(&bytes[at..at + 4 + length]);
        bytes[at + 4 + length..][..4].copy_from_slice(&crc.to_be_bytes());
        assert_eq!(decode_frame(&bytes, "x").unwrap_err().code(), "image_damaged");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
        })
    }

    #[test]
    fn reads_depths_and_kinds() {
        for (colour, depth, values, expected) in [
            (png::ColorType::Grayscale, png::BitDepth::Sixteen, vec![0x80, 0x80], 128.0),
            (png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, vec![77, 3], 77.0),
            (png::ColorType::Rgba, png::BitDepth::Eight, vec![10, 10, 10, 0], 10.0),
            (png::ColorType::Grayscale, png::BitDepth::One, vec![0x80], 255.0),
        ] {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
            encoder.set_color(colour);
            encoder.set_depth(depth);
            encoder.write_header().unwrap().write_image_data(&values).unwrap();
            let found = decode_frame(&bytes, "x").unwrap();
            assert!((found.at(0, 0) - expected).abs() < 1e-3, "{colour:?} {depth:?}: {}", found.at(0, 0));
        }
    }
}
