//! Decoding of camera frames: image files and bytes to gray or colour images.

use super::bounds::{FrameBounds, MAX_FILE_BYTES};
use super::error::{FrameError, not_an_image, too_large};
use overfly_core::pixels::{Colour, Gray};
use std::io::Cursor;
use std::path::Path;

/// Reads the frame in a file as gray (luma of ITU-R BT.601). Alpha and orientation tags are not applied: pixels are taken as they
/// are stored.
///
/// # Errors
/// [`FrameError`] where the file cannot be read, is not a valid image, or exceeds the default bounds.
pub fn read_frame(path: &Path) -> Result<Gray, FrameError> {
    read_colour_frame(path).map(|colour| colour.to_gray())
}

/// Reads the frame in a file in colour.
///
/// # Errors
/// As [`read_frame`].
pub fn read_colour_frame(path: &Path) -> Result<Colour, FrameError> {
    decode(&read_file(path)?, &path.display().to_string(), FrameBounds::default())
}

/// Reads the bytes of a frame's file.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, FrameError> {
    let unreadable = |cause| FrameError::Unreadable { path: path.into(), cause };
    let kind = std::fs::metadata(path).map_err(unreadable)?;
    if !kind.is_file() {
        let cause = std::io::Error::other("not a regular file");
        return Err(unreadable(cause));
    }
    if kind.len() > MAX_FILE_BYTES {
        return Err(FrameError::TooLarge {
            name: path.display().to_string(),
            found: format!("{} bytes", kind.len()),
            limit: format!("{MAX_FILE_BYTES} bytes"),
        });
    }
    std::fs::read(path).map_err(unreadable)
}

/// Decodes the frame in the bytes of a PNG, JPEG or WebP file; `name` is its name in errors.
///
/// # Errors
/// As [`read_frame`]; the size is checked in the header before any pixel is decoded.
pub fn decode_frame(bytes: &[u8], name: &str) -> Result<Gray, FrameError> {
    decode_frame_within(bytes, name, FrameBounds::default())
}

/// Decodes a frame as [`decode_frame`], within given bounds.
///
/// # Errors
/// As [`decode_frame`].
pub fn decode_frame_within(bytes: &[u8], name: &str, bounds: FrameBounds) -> Result<Gray, FrameError> {
    decode(bytes, name, bounds).map(|colour| colour.to_gray())
}

fn decode(bytes: &[u8], name: &str, bounds: FrameBounds) -> Result<Colour, FrameError> {
    let FrameBounds { edge_px, pixels } = bounds;
    let bad = |e: image::ImageError| match e {
        image::ImageError::Limits(e) => too_large(name, e.to_string(), bounds),
        other => not_an_image(name, other),
    };
    let (_, [width, height]) = header_of(bytes, name, bounds)?;
    if width.max(height) > edge_px || u64::from(width) * u64::from(height) > pixels {
        return Err(too_large(name, format!("{width} x {height} pixels"), bounds));
    }
    let mut reader =
        image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| not_an_image(name, e))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(edge_px);
    limits.max_image_height = Some(edge_px);
    // Up to 8 bytes a pixel (16-bit RGBA), and the decoder's own tables.
    limits.max_alloc = Some(pixels * 8 + (64 << 20));
    reader.limits(limits);
    let rgb = reader.decode().map_err(bad)?.into_rgb8();
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Ok(Colour::from_values(width, height, rgb.into_raw()).expect("three values a pixel"))
}

/// Reads format, width and height (pixels) from a header.
pub(super) fn header_of(
    bytes: &[u8],
    name: &str,
    bounds: FrameBounds,
) -> Result<(Option<image::ImageFormat>, [u32; 2]), FrameError> {
    let reader =
        image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| not_an_image(name, e))?;
    let format = reader.format();
    match reader.into_dimensions() {
        Ok((width, height)) => Ok((format, [width, height])),
        Err(image::ImageError::Limits(e)) => Err(too_large(name, e.to_string(), bounds)),
        Err(other) => Err(not_an_image(name, other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32, rgb: [u8; 3]) -> Vec<u8> {
        let mut bytes = Vec::new();
        image::RgbImage::from_pixel(width, height, image::Rgb(rgb))
            .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
            .unwrap();
        bytes
    }

    #[test]
    fn grays_by_luma_of_bt_601() {
        let gray = decode_frame(&png(3, 2, [200, 100, 50]), "x").unwrap();
        assert_eq!((gray.width_px(), gray.height_px()), (3, 2));
        assert!((gray.at(2, 1) - 124.2).abs() < 1e-3);
    }

    #[test]
    fn refuses_what_is_not_an_image() {
        for bytes in [&b""[..], b"hello", &png(4, 4, [1, 2, 3])[..40]] {
            assert_eq!(decode_frame(bytes, "x").unwrap_err().code(), "not_an_image");
        }
        assert_eq!(read_frame(Path::new("no/such/file.png")).unwrap_err().code(), "image_unreadable");
        // Reading a device or a pipe may never end.
        #[cfg(unix)]
        assert_eq!(read_frame(Path::new("/dev/zero")).unwrap_err().code(), "image_unreadable");
    }

    #[test]
    fn refuses_a_header_that_promises_too_much() {
        // A PNG whose IHDR says 1,000,000 x 1,000,000, with its checksum right.
        let mut bytes = png(4, 4, [1, 2, 3]);
        bytes[16..20].copy_from_slice(&1_000_000u32.to_be_bytes());
        bytes[20..24].copy_from_slice(&1_000_000u32.to_be_bytes());
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        assert_eq!(decode_frame(&bytes, "bomb").unwrap_err().code(), "image_too_large");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
        })
    }
}
