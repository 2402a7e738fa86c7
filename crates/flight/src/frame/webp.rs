//! WebP frames. The format has no checksums: what can be seen of a damage is that the coded data end before the last pixel, or go
//! on after it. The decoder reports the first; the second is found by decoding again without the last bytes, which must fail.

use super::error::Fault;
use image::codecs::webp::WebPDecoder;
use image::{DynamicImage, ImageDecoder, ImageError};
use overfly_core::pixels::Colour;
use std::io::Cursor;

/// Coded bytes after the last pixel that encoders may leave.
const LOSSY_REST_BYTES: usize = 8;
const LOSSLESS_REST_BYTES: usize = 1;

/// Reads columns and rows from the header.
pub(super) fn size_px(bytes: &[u8]) -> Result<[u32; 2], Fault> {
    let (width, height) = decoder(bytes)?.dimensions();
    Ok([width, height])
}

/// Decodes to colours; alpha is dropped.
pub(super) fn colour(bytes: &[u8]) -> Result<Colour, Fault> {
    let parts = image_chunks(bytes)?;
    let size = size_px(bytes)?;
    for (four_cc, content) in &parts {
        // The decoder takes memory for the coded picture before it compares both sizes.
        if *four_cc == *b"VP8 " && lossy_size_px(content).is_some_and(|coded| coded != size) {
            return Err(Fault::damaged("the coded picture has another size than the file states"));
        }
    }
    let rgb = DynamicImage::from_decoder(decoder(bytes)?).map_err(fault)?.into_rgb8();
    for (four_cc, content) in parts {
        let rest = if four_cc == *b"VP8L" { LOSSLESS_REST_BYTES } else { LOSSY_REST_BYTES };
        let shorter = alone(four_cc, &content[..content.len().saturating_sub(rest)]);
        if decoder(&shorter).and_then(|d| DynamicImage::from_decoder(d).map_err(fault)).is_ok() {
            return Err(Fault::damaged("coded data remain after the last pixel"));
        }
    }
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Ok(Colour::from_values(width, height, rgb.into_raw()).expect("three values a pixel"))
}

fn decoder(bytes: &[u8]) -> Result<WebPDecoder<Cursor<&[u8]>>, Fault> {
    let decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(fault)?;
    if decoder.has_animation() { Err(Fault::NotAnImage("an animation".into())) } else { Ok(decoder) }
}

/// The four-character code of a chunk, and its content.
type Chunk<'a> = ([u8; 4], &'a [u8]);

/// The chunks that hold pixels. The chunks must fill the file as it states; bytes after that are not read.
fn image_chunks(bytes: &[u8]) -> Result<Vec<Chunk<'_>>, Fault> {
    let short = || Fault::damaged("the file is shorter than it states");
    let size_at = |at: usize| -> Option<usize> {
        let size = bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)?;
        usize::try_from(size).ok()
    };
    let end = size_at(4).and_then(|size| size.checked_add(8)).filter(|&end| end <= bytes.len()).ok_or_else(short)?;
    let mut at = 12;
    let mut found = Vec::new();
    while at < end {
        let size = size_at(at + 4).ok_or_else(short)?;
        let content = bytes[..end].get(at + 8..).and_then(|rest| rest.get(..size)).ok_or_else(short)?;
        let four_cc = bytes[at..at + 4].try_into().expect("four bytes");
        if matches!(&four_cc, b"VP8 " | b"VP8L") {
            found.push((four_cc, content));
        }
        // A byte fills chunks of odd length; some writers forget the last one.
        at += 8 + size + size % 2;
    }
    if found.len() == 1 { Ok(found) } else { Err(Fault::damaged("it has no image, or more than one")) }
}

/// Columns and rows of a lossy picture; `None` if it does not begin as one (RFC 6386, section 9.1).
fn lossy_size_px(content: &[u8]) -> Option<[u32; 2]> {
    let header = content.get(..10).filter(|header| header[3..6] == [0x9d, 0x01, 0x2a])?;
    let size = |at: usize| u32::from(u16::from_le_bytes([header[at], header[at + 1]]) & 0x3fff);
    Some([size(6), size(8)])
}

/// A file of one chunk.
fn alone(four_cc: [u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(content.len() + 21);
    let filled = content.len() + content.len() % 2;
    bytes.extend(b"RIFF");
    bytes.extend((filled as u32 + 12).to_le_bytes());
    bytes.extend(b"WEBP");
    bytes.extend(four_cc);
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(content);
    bytes.resize(filled + 20, 0);
    bytes
}

fn fault(error: ImageError) -> Fault {
    match error {
        ImageError::Limits(e) => Fault::TooLarge(e.to_string()),
        ImageError::Unsupported(e) => Fault::NotAnImage(e.to_string()),
        other => Fault::damaged(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::decode_frame;

    fn lossless() -> Vec<u8> {
        let picture = image::RgbImage::from_fn(160, 120, |x, y| {
            image::Rgb([(x * 3 + y) as u8, (x * y / 9) as u8, ((x * 7) ^ (y * 5)) as u8])
        });
        let mut bytes = Vec::new();
        picture.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::WebP).unwrap();
        bytes
    }

    #[test]
    fn a_file_that_is_shorter_than_it_states_is_damaged() {
        let sound = lossless();
        let expected = decode_frame(&sound, "x").unwrap();
        for length in [30, 100, sound.len() / 2, sound.len() - 3] {
            assert_eq!(decode_frame(&sound[..length], "x").unwrap_err().code(), "image_damaged", "{length}");
        }
        assert_eq!(decode_frame(&[&sound[..], &[0; 50]].concat(), "x").unwrap(), expected, "trailing bytes");
    }

    #[test]
    fn a_small_file_with_a_huge_coded_picture_is_refused_before_it_is_decoded() {
        let lossy = |size: u16| {
            let [low, high] = size.to_le_bytes();
            [&[0x10, 0, 0, 0x9d, 0x01, 0x2a, low, high, low, high][..], &[0; 400]].concat()
        };
        let file = |coded: Vec<u8>| {
            // VP8X: no features, a canvas of 64 x 64 pixels.
            let mut bytes = b"RIFF\0\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\x3f\0\0\x3f\0\0VP8 ".to_vec();
            bytes.extend((coded.len() as u32).to_le_bytes());
            bytes.extend(coded);
            let size = bytes.len() as u32 - 8;
            bytes[4..8].copy_from_slice(&size.to_le_bytes());
            bytes
        };
        let refused = |size| decode_frame(&file(lossy(size)), "x").unwrap_err().to_string();
        assert!(refused(16_383).contains("another size than the file states"), "{}", refused(16_383));
        assert!(!refused(64).contains("another size"), "{}", refused(64));
    }

    #[test]
    fn coded_data_after_the_last_pixel_are_damage() {
        let sound = lossless();
        let content = &sound[20..];
        let longer = alone(*b"VP8L", &[content, &[0x55; 12]].concat());
        assert_eq!(decode_frame(&longer, "x").unwrap_err().code(), "image_damaged");
    }
}
