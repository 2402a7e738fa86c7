//! Compares JPEG decoders: which damages each reports, what it still reads of files with a harmless oddity, and its time at full and
//! reduced size. The figures of "Which JPEG decoder?" in docs/decisions.md.
//!
//! `cargo run --release -p overfly-testkit --example jpeg_decoders -- tiles/flight/frames/019.jpg`; with `--times` before the photos
//! only the times.

use overfly_core::jpeg::{Reduction, decode_gray};
use overfly_core::pixels::Colour;
use overfly_flight::frame::read_colour_frame;
use overfly_lab::trial::{FileChange, FrameFormat};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::io::Cursor;
use std::path::Path;
use std::time::Instant;
use zune_core::{colorspace::ColorSpace, options::DecoderOptions};

/// Gray levels of a file; `None` where the decoder refuses it.
type Decode = fn(&[u8]) -> Option<Vec<f32>>;

const DECODERS: [(&str, Decode); 4] = [
    ("overfly", overfly),
    ("image (zune-jpeg)", image_crate),
    ("zune-jpeg strict", zune_strict),
    ("jpeg-decoder", jpeg_decoder_crate),
];
const FORMATS: [FrameFormat; 4] =
    [FrameFormat::Jpeg, FrameFormat::JpegRestarts, FrameFormat::JpegProgressive, FrameFormat::JpegGray];
/// Damaged files of each format and change, of each photo.
const FILES: u64 = 100;

fn overfly(bytes: &[u8]) -> Option<Vec<f32>> {
    decode_gray(bytes, Reduction::None).ok().map(|gray| gray.values().to_vec())
}

fn image_crate(bytes: &[u8]) -> Option<Vec<f32>> {
    let rgb = image::load_from_memory_with_format(bytes, image::ImageFormat::Jpeg).ok()?.into_rgb8();
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Some(Colour::from_values(width, height, rgb.into_raw())?.to_gray().values().to_vec())
}

fn zune_strict(bytes: &[u8]) -> Option<Vec<f32>> {
    let options = DecoderOptions::default().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::Luma);
    let pixels = zune_jpeg::JpegDecoder::new_with_options(Cursor::new(bytes), options).decode().ok()?;
    Some(pixels.into_iter().map(f32::from).collect())
}

fn jpeg_decoder_crate(bytes: &[u8]) -> Option<Vec<f32>> {
    reduced_by_jpeg_decoder(bytes, 1)
}

fn reduced_by_jpeg_decoder(bytes: &[u8], divisor: u16) -> Option<Vec<f32>> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.read_info().ok()?;
    let info = decoder.info()?;
    decoder.scale(info.width.div_ceil(divisor), info.height.div_ceil(divisor)).ok()?;
    let pixels = decoder.decode().ok()?;
    Some(match decoder.info()?.pixel_format {
        jpeg_decoder::PixelFormat::RGB24 => pixels
            .chunks_exact(3)
            .map(|p| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]))
            .collect(),
        _ => pixels.into_iter().map(f32::from).collect(),
    })
}

/// What one decoder made of the files of one change.
#[derive(Default)]
struct Tally {
    files: usize,
    refused: usize,
    /// Read, and more than 1 % of the pixels differ by more than 8 levels.
    wrong: usize,
}

fn main() {
    let (options, photos): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|a| a == "--times");
    assert!(!photos.is_empty(), "state a photo or more");
    if options.is_empty() {
        print_shares(&photos);
    }
    photos.iter().for_each(|photo| times(photo));
}

fn print_shares(photos: &[String]) {
    println!("share of the files refused / read with more than 1 % of the pixels changed");
    let header: String = DECODERS.iter().map(|(name, _)| format!("{name:>20}")).collect();
    println!("{:<14}{header}", "");
    for change in FileChange::ALL {
        let mut tallies: [Tally; 4] = Default::default();
        photos.iter().for_each(|photo| count(Path::new(photo), change, &mut tallies));
        let cells: String = tallies
            .iter()
            .map(|t| {
                let share = |n: usize| 100.0 * n as f64 / t.files.max(1) as f64;
                format!("{:>11.1} % / {:>4.1}", share(t.refused), share(t.wrong))
            })
            .collect();
        println!("{:<14}{cells}  ({} files)", change.word(), tallies[0].files);
    }
}

fn count(photo: &Path, change: FileChange, tallies: &mut [Tally; 4]) {
    let colour = read_colour_frame(photo).expect("the photo can be read");
    for format in FORMATS.into_iter().filter(|f| f.takes(change)) {
        let sound = format.encoded(&colour, &[]).expect("the photo can be encoded");
        let files: Vec<Vec<u8>> =
            (0..FILES).map(|seed| change.applied(&sound, &mut ChaCha8Rng::seed_from_u64(seed))).collect();
        for ((_, decode), tally) in DECODERS.iter().zip(tallies.iter_mut()) {
            let expected = decode(&sound).expect("a sound file is read");
            for file in files.iter().filter(|file| **file != sound) {
                tally.files += 1;
                match decode(file) {
                    None => tally.refused += 1,
                    Some(found) => {
                        let changed = found.iter().zip(&expected).filter(|(a, b)| (*a - *b).abs() > 8.0).count();
                        tally.wrong += usize::from(found.len() != expected.len() || changed * 100 > expected.len());
                    }
                }
            }
        }
    }
}

fn times(photo: &str) {
    let bytes = std::fs::read(photo).expect("the photo can be read");
    println!("\n{photo}, best of five, ms to gray levels");
    let report = |name: &str, decode: &dyn Fn() -> bool| {
        let once = |_| {
            let begun = Instant::now();
            let is_read = decode();
            (begun.elapsed().as_secs_f64() * 1e3, is_read)
        };
        let best = (0..5).map(once).reduce(|a, b| if a.0 < b.0 { a } else { b }).expect("five times");
        println!("  {name:<28}{:>8.1}{}", best.0, if best.1 { "" } else { " (refused)" });
    };
    for (name, decode) in DECODERS {
        report(name, &|| decode(&bytes).is_some());
    }
    for reduction in [Reduction::Half, Reduction::Quarter, Reduction::Eighth] {
        let divisor = reduction.divisor() as u16;
        report(&format!("overfly 1/{divisor}"), &|| decode_gray(&bytes, reduction).is_ok());
        report(&format!("jpeg-decoder 1/{divisor}"), &|| reduced_by_jpeg_decoder(&bytes, divisor).is_some());
    }
}
