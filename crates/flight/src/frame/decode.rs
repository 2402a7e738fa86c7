//! Decoding of camera frames: image files and bytes to gray or colour images.

use super::bounds::{FrameBounds, MAX_FILE_BYTES};
use super::error::{Fault, FrameError};
use super::format::Format;
use super::{jpeg, png, webp};
use overfly_core::jpeg::Reduction;
use overfly_core::pixels::{Colour, Gray};
use std::path::Path;

/// Reads the frame in a file as gray (luma of ITU-R BT.601). Alpha and orientation tags are not applied: pixels are taken as they
/// are stored.
///
/// # Errors
/// [`FrameError`] where the file cannot be read, is not an image, does not decode exactly, or exceeds the default bounds.
pub fn read_frame(path: &Path) -> Result<Gray, FrameError> {
    decode_frame(&read_file(path)?, &path.display().to_string())
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
    match Format::from_first_bytes(bytes) {
        Some(Format::Jpeg) => header_of(bytes, bounds)
            .and_then(|_| jpeg::gray(bytes, Reduction::None))
            .map_err(|fault| fault.named(name, bounds)),
        _ => decode(bytes, name, bounds).map(|colour| colour.to_gray()),
    }
}

/// Decodes to colours, within bounds.
fn decode(bytes: &[u8], name: &str, bounds: FrameBounds) -> Result<Colour, FrameError> {
    let colour = || match header_of(bytes, bounds)?.0 {
        Format::Jpeg => jpeg::colour(bytes),
        Format::Png => png::colour(bytes),
        Format::WebP => webp::colour(bytes),
    };
    colour().map_err(|fault| fault.named(name, bounds))
}

/// Reads format, columns and rows from a header, which must not exceed the bounds.
fn header_of(bytes: &[u8], bounds: FrameBounds) -> Result<(Format, [u32; 2]), Fault> {
    let (format, [width, height]) = size_of(bytes)?;
    if width.max(height) > bounds.edge_px || u64::from(width) * u64::from(height) > bounds.pixels {
        return Err(Fault::TooLarge(format!("{width} x {height} pixels")));
    }
    Ok((format, [width, height]))
}

/// Reads format, columns and rows from a header.
pub(super) fn size_of(bytes: &[u8]) -> Result<(Format, [u32; 2]), Fault> {
    let format =
        Format::from_first_bytes(bytes).ok_or_else(|| Fault::NotAnImage("its first bytes are those of none".into()))?;
    let size = match format {
        Format::Jpeg => jpeg::read_header(bytes).map(|header| [header.width_px, header.height_px]),
        Format::Png => png::size_px(bytes),
        Format::WebP => webp::size_px(bytes),
    }?;
    Ok((format, size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

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
        for bytes in [&b""[..], b"hello", b"GIF89a\x01\0\x01\0\0\0\0"] {
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
