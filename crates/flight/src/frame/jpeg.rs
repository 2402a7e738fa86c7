//! JPEG frames, by the strict decoder of the core.

use super::error::Fault;
use overfly_core::jpeg::{JpegError, JpegHeader, Reduction, decode_colour, decode_gray, header};
use overfly_core::pixels::{Colour, Gray};

/// Reads the header.
pub(super) fn read_header(bytes: &[u8]) -> Result<JpegHeader, Fault> {
    header(bytes).map_err(fault)
}

/// Decodes to gray, at a reduced size.
pub(super) fn gray(bytes: &[u8], reduction: Reduction) -> Result<Gray, Fault> {
    decode_gray(bytes, reduction).map_err(fault)
}

/// Decodes to colours.
pub(super) fn colour(bytes: &[u8]) -> Result<Colour, Fault> {
    decode_colour(bytes, Reduction::None).map_err(fault)
}

fn fault(error: JpegError) -> Fault {
    match error {
        JpegError::NotJpeg | JpegError::Unsupported(_) => Fault::NotAnImage(error.to_string()),
        JpegError::Damaged { .. } => Fault::damaged(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::decode_frame;
    use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
    use std::ops::Range;

    const SIZE: [u16; 2] = [327, 203];

    /// Smooth colours with some texture.
    fn scene() -> Vec<u8> {
        let level = |x: f32, y: f32, k: f32| {
            128.0 + 70.0 * (x / (19.0 * k)).sin() * (y / 23.0).cos() + 30.0 * ((x * y) / (311.0 * k)).sin()
        };
        let [width, height] = SIZE.map(usize::from);
        (0..width * height)
            .flat_map(|i| [1.0, 1.7, 2.3].map(|k| level((i % width) as f32, (i / width) as f32, k) as u8))
            .collect()
    }

    fn encoded(set: impl Fn(&mut Encoder<&mut Vec<u8>>)) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 85);
        set(&mut encoder);
        encoder.encode(&scene(), SIZE[0], SIZE[1], ColorType::Rgb).unwrap();
        bytes
    }

    /// Files of every kind that encoders write: sampling, tables, scans, restart markers.
    fn kinds() -> Vec<(String, Vec<u8>)> {
        let mut kinds = Vec::new();
        for sampling in [
            SamplingFactor::F_1_1,
            SamplingFactor::F_2_1,
            SamplingFactor::F_1_2,
            SamplingFactor::F_2_2,
            SamplingFactor::F_4_1,
        ] {
            for (name, progressive, optimized, restart) in [
                ("plain", false, false, 0),
                ("restarts", false, true, 5),
                ("progressive", true, true, 0),
                ("both", true, true, 7),
            ] {
                let bytes = encoded(|e| {
                    e.set_sampling_factor(sampling);
                    e.set_progressive(progressive);
                    e.set_optimized_huffman_tables(optimized);
                    e.set_restart_interval(restart);
                });
                kinds.push((format!("{sampling:?} {name}"), bytes));
            }
        }
        let mut gray = Vec::new();
        let luma: Vec<u8> = scene().chunks_exact(3).map(|p| p[1]).collect();
        Encoder::new(&mut gray, 90).encode(&luma, SIZE[0], SIZE[1], ColorType::Luma).unwrap();
        let mut inks = Vec::new();
        let four: Vec<u8> = scene().chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 40]).collect();
        Encoder::new(&mut inks, 90).encode(&four, SIZE[0], SIZE[1], ColorType::Cmyk).unwrap();
        kinds.extend([("gray".into(), gray), ("inks".into(), inks)]);
        kinds
    }

    fn damage(bytes: &[u8]) -> bool {
        decode_frame(bytes, "x").is_err_and(|e| e.code() == "image_damaged")
    }

    /// Where the coded data of the first scan lie.
    fn coded(bytes: &[u8]) -> Range<usize> {
        let start = bytes.windows(2).position(|w| w == [0xff, 0xda]).unwrap() + 14;
        start..bytes.len() - 2
    }

    /// The files of one sampling hold the same coefficients, in other orders and with other tables.
    #[test]
    fn tables_scans_and_restarts_change_no_pixel() {
        for same in kinds()[..20].chunks_exact(4) {
            let expected = colour(&same[0].1).unwrap();
            for (kind, bytes) in &same[1..] {
                assert!(colour(bytes).unwrap() == expected, "{kind}");
            }
        }
    }

    #[test]
    fn decodes_as_another_decoder_does() {
        // The other one reads components in scans of their own wrongly, and interpolates chroma by its own rule.
        for (kind, bytes) in kinds().iter().filter(|(kind, _)| !kind.contains("restarts")) {
            let found = colour(bytes).unwrap();
            let other = image::load_from_memory(bytes).unwrap().into_rgb8();
            let sum = found.values().iter().zip(other.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
            let (mean, most) = (sum / other.len() as f64, if kind.contains("F_4_1") { 5.0 } else { 1.0 });
            assert!(mean < most, "{kind}: {mean} levels");
        }
    }

    #[test]
    fn gray_is_the_luma_of_the_colours() {
        for (kind, bytes) in kinds() {
            let (luma, expected) = (gray(&bytes, Reduction::None).unwrap(), colour(&bytes).unwrap().to_gray());
            let far = luma.values().iter().zip(expected.values()).map(|(a, b)| (a - b).abs()).sum::<f32>();
            assert!(far / (luma.values().len() as f32) < 0.6, "{kind}: {far}");
        }
    }

    #[test]
    fn refuses_coded_data_that_were_zeroed_cut_or_removed() {
        for (kind, bytes) in kinds() {
            let data = coded(&bytes);
            let middle = (data.start + data.end) / 2;
            let mut zeroed = bytes.clone();
            zeroed[middle..middle + 300].fill(0);
            assert!(damage(&zeroed), "{kind} zeroed");
            for length in [2, 10, bytes.len() / 2, data.end - 1, data.end, bytes.len() - 1] {
                let cut = decode_frame(&bytes[..length], "x").unwrap_err();
                assert!(cut.code() == "image_damaged" || length == 2, "{kind} {length}: {cut}");
            }
            let missing = [&bytes[..middle], &bytes[middle + 100..]].concat();
            assert!(damage(&missing), "{kind}: 100 bytes missing");
        }
    }

    #[test]
    fn refuses_restart_markers_out_of_order() {
        let bytes = encoded(|e| {
            e.set_restart_interval(5);
        });
        let markers: Vec<usize> =
            (0..bytes.len() - 1).filter(|&i| bytes[i] == 0xff && (0xd0..=0xd7).contains(&bytes[i + 1])).collect();
        assert!(markers.len() > 8);
        let mut other = bytes.clone();
        other[markers[3] + 1] = 0xd5;
        assert!(damage(&other));
        // A whole interval is missing.
        assert!(damage(&[&bytes[..markers[3]], &bytes[markers[4]..]].concat()));
    }

    #[test]
    fn reads_what_is_unusual_and_harmless() {
        let plain = encoded(|_| {});
        let restarts = encoded(|e| {
            e.set_restart_interval(5);
        });
        let expected = decode_frame(&plain, "x").unwrap();
        let mut cases = vec![("trailing bytes", [&plain[..], &[7; 999]].concat())];
        // Thumbnails and the images of a multi-picture file follow the first, or stand in a segment.
        cases.push(("a second image", [&plain[..], &plain[..]].concat()));
        let small = [0xff, 0xd8, 0xff, 0xdb, 0xff, 0xd9];
        cases.push(("a thumbnail in a segment", [&plain[..2], &[0xff, 0xe1, 0, 8], &small, &plain[2..]].concat()));
        cases.push(("an empty segment", [&plain[..2], &[0xff, 0xef, 0, 2], &plain[2..]].concat()));
        cases.push(("fill bytes", [&plain[..2], &[0xff, 0xff], &plain[2..]].concat()));
        let end = plain.len() - 2;
        cases.push(("fill before the end", [&plain[..end], &[0xff; 3], &plain[end..]].concat()));
        cases.push(("zeros before the end", [&plain[..end], &[0; 6], &plain[end..]].concat()));
        for junk in [&[0u8; 3][..], &[0x5a], &[1, 2, 3, 4, 5, 6, 7, 8]] {
            let mut bytes = Vec::new();
            for (i, &byte) in restarts.iter().enumerate() {
                if byte == 0xff && restarts.get(i + 1).is_some_and(|b| (0xd0..=0xd7).contains(b)) {
                    bytes.extend(junk);
                }
                bytes.push(byte);
            }
            cases.push(("junk before restart markers", bytes));
        }
        // A frame of a Motion JPEG stream: the standard tables are left out.
        let mut bare = plain.clone();
        while let Some(at) = bare.windows(2).position(|w| w == [0xff, 0xc4]) {
            let length = usize::from(u16::from_be_bytes([bare[at + 2], bare[at + 3]]));
            bare.drain(at..at + 2 + length);
        }
        cases.push(("no Huffman tables", bare));
        for (what, bytes) in cases {
            let found = decode_frame(&bytes, "x").unwrap_or_else(|e| panic!("{what}: {e}"));
            assert_eq!(found, expected, "{what}");
        }
    }

    #[test]
    fn kinds_that_are_not_read_are_no_image() {
        let mut arithmetic = encoded(|_| {});
        let at = arithmetic.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
        arithmetic[at + 1] = 0xc9;
        assert_eq!(decode_frame(&arithmetic, "x").unwrap_err().code(), "not_an_image");
    }
}
